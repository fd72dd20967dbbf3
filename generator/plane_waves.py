"""Random plane waves exp(i w.s) that stand for the integrands of a distribution ray tracer.

The error of the step test is, in expectation over the half-spaces, an energy with the kernel -|x - y| (half-spaces
separate two points in proportion to their distance). The Fourier transform of -|x - y| in d dimensions falls with
|w|^-(d+1); times the |w|^(d-1) of the shell, a radius r = |w| has the density r^-2 in every dimension. So waves with
uniform directions and such radii are, summed, the step test itself with all its possible functions, but smooth: they
have gradients everywhere, which a step has not.

Radii are drawn with the density 1/r instead and the waves weighted by 1/r. The long waves, which r^-2 draws most
often, are soon suppressed; what is left of the error sits at the short ones, and the weights make it visible to the
gradient with less noise (at equal steps, all figures at sigma = 1 fall by 6 to 11 %).
"""

from dataclasses import dataclass

import numpy as np

SMALLEST_RADIUS = 1.0
"""Radians per side of the cube. Below it the density is left out: half a wave already spans more than the cube."""

LARGEST_RADIUS = 60.0
"""For one sample a pixel: about ten periods across the cube."""


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
    weight : ndarray of float32, shape (m,)
        Such that the weighted error power of white noise is 1.
    """

    columns: tuple[int, ...]
    frequencies: np.ndarray
    mean: np.ndarray
    weight: np.ndarray


def draw_waves(columns, count, rng, samples=1):
    """Draw random waves with stratified radii.

    Parameters
    ----------
    columns : tuple of int
    count : int
    rng : numpy.random.Generator
    samples : int
        Samples n whose mean is looked at. They are n^(1/d) times closer together along each axis, and so are the
        waves that they can resolve.

    Returns
    -------
    PlaneWaves
    """
    d = len(columns)
    direction = rng.standard_normal((count, d))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    level = (np.arange(count) + rng.random(count)) / count
    largest = LARGEST_RADIUS * samples ** (1 / d)
    radius = SMALLEST_RADIUS * (largest / SMALLEST_RADIUS) ** level
    frequencies = direction * radius[:, None]
    mean = np.prod(np.exp(0.5j * frequencies) * np.sinc(frequencies / (2 * np.pi)), axis=1)
    weight = 1 / radius
    weight /= np.sum(weight * (1 - np.abs(mean) ** 2))
    return PlaneWaves(columns, frequencies.astype(np.float32), mean.astype(np.complex64), weight.astype(np.float32))
