"""Random plane waves exp(i w.s) that stand for the integrands of a distribution ray tracer.

The error of the step test is, in expectation over the half-spaces, an energy with the kernel -|x - y| (half-spaces
separate two points in proportion to their distance). The Fourier transform of -|x - y| in d dimensions falls with
|w|^-(d+1); times the |w|^(d-1) of the shell, a radius r = |w| has the density r^-2 in every dimension. So waves with
uniform directions and such radii are, summed, the step test itself with all its possible functions, but smooth: they
have gradients everywhere, which a step has not.
"""

from dataclasses import dataclass

import numpy as np

SMALLEST_RADIUS = 1.0
"""Radians per side of the cube. Below it the density is left out: half a wave already spans more than the cube."""

LARGEST_RADIUS = 40.0
"""About six periods across the cube; finer differences of values weigh less than the noise of the rest."""


@dataclass(frozen=True)
class PlaneWaves:
    """Waves on some columns of a tile.

    Attributes
    ----------
    columns : tuple of int
    frequencies : ndarray of float32, shape (m, d)
        Radians per side of the cube.
    mean : ndarray of complex64, shape (m,)
        Expectation of each wave over the cube.
    """

    columns: tuple[int, ...]
    frequencies: np.ndarray
    mean: np.ndarray

    @property
    def variance(self):
        """Sum of the waves' variances over the cube: their error power under white noise."""
        return float(np.sum(1 - np.abs(self.mean) ** 2))


def draw_waves(columns, count, rng):
    """Draw random waves with stratified radii.

    Parameters
    ----------
    columns : tuple of int
    count : int
    rng : numpy.random.Generator

    Returns
    -------
    PlaneWaves
    """
    direction = rng.standard_normal((count, len(columns)))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    level = (np.arange(count) + rng.random(count)) / count
    # Invert the distribution function of r^-2 between the two radii.
    radius = 1 / (1 / SMALLEST_RADIUS - level * (1 / SMALLEST_RADIUS - 1 / LARGEST_RADIUS))
    frequencies = direction * radius[:, None]
    mean = np.prod(np.exp(0.5j * frequencies) * np.sinc(frequencies / (2 * np.pi)), axis=1)
    return PlaneWaves(columns, frequencies.astype(np.float32), mean.astype(np.complex64))
