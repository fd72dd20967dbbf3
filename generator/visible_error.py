"""What a viewer sees of the error of a tile, as an energy with a gradient.

For an integrand exp(i w.s) the error image of a tile is z(p) = exp(i w.s_p) - E z, and what a low-pass filter R leaves
of it is the sum over image frequencies of R^2 |DFT z|^2: the power inside the cylinders of figure 5 of Mitchell 1991,
with soft walls. Its derivative with respect to the values s_p is exact and costs two FFTs a wave. `VisibleError` is the
expectation of this power over random waves (see `generator.plane_waves`) of every marginal subset.
"""

from dataclasses import dataclass
from itertools import repeat

import numpy as np

from .layer_views import coupling
from .low_pass import gaussian_response
from .plane_waves import draw_waves

WAVES = 64
"""Waves drawn for one gradient, all subsets together."""


def passbands(size, views, scales, emphasis):
    """Return the energy's terms: pairs of a coupling of layers and a weight of image frequencies.

    Parameters
    ----------
    size : int
        Side T of the tile in pixels.
    views : ndarray, shape (views, n)
        See `generator.layer_views`.
    scales : dict of float to float
        See `SCALES`.
    emphasis : float
        Of views of many layers, see `generator.layer_views.coupling`.

    Returns
    -------
    list of (ndarray of float32 (n, n), ndarray of float32 (T, T))
    """
    squares = {sigma: gaussian_response(size, sigma) ** 2 for sigma in scales}
    blurred = sum(scales[sigma] * squares[sigma] / squares[sigma].mean() for sigma in scales if sigma)
    terms = [(coupling(views, emphasis), blurred)]
    means = views[np.count_nonzero(views, axis=1) > 1]
    if scales.get(0.0) and len(means):
        terms.append((coupling(means, emphasis), scales[0.0] * squares[0.0]))
    return [(layers.astype(np.float32), band.astype(np.float32)) for layers, band in terms]


def filtered_gradient(points, waves, terms):
    """Return the gradient of the waves' filtered power with respect to the points.

    Parameters
    ----------
    points : ndarray of float32, shape (n, T*T, D)
    waves : PlaneWaves
    terms : list of (ndarray, ndarray)
        As returned by `passbands`.

    Returns
    -------
    ndarray of float32, shape (n, T*T, d)
        For the waves' columns, up to a factor that is common to all points and columns.
    """
    layers, count, _ = points.shape
    size = terms[0][1].shape[0]
    phase = np.einsum("wd,npd->wnp", waves.frequencies, points[..., list(waves.columns)])
    wave = np.empty(phase.shape, np.complex64)
    np.cos(phase, out=wave.real)
    np.sin(phase, out=wave.imag)
    errors = np.fft.fft2((wave - waves.mean[:, None, None]).reshape(-1, layers, size, size))
    spectra = sum(_couple(matrix, errors) * band for matrix, band in terms)
    filtered = np.fft.ifft2(spectra).reshape(-1, layers, count)
    # d/dphase of conj(e) R^2 e is twice the real part of conj(i z) times the filtered image.
    slope = wave.real * filtered.imag - wave.imag * filtered.real
    return np.tensordot(slope, waves.frequencies * waves.weight[:, None], axes=(0, 0))


def _couple(matrix, images):
    """Apply a coupling of layers, shape (n, n), to images of shape (m, n, T, T)."""
    if len(matrix) == 1:
        return matrix[0, 0] * images
    flat = images.reshape(*images.shape[:2], -1)
    return (matrix @ flat).reshape(images.shape)


@dataclass(frozen=True)
class VisibleError:
    """The energy that the spectral optimiser minimises.

    Attributes
    ----------
    terms : list of (ndarray, ndarray)
        See `passbands`.
    subsets : list of (tuple of int, float)
        Columns and weight of each marginal subset.
    resolution : int
        Samples that the largest view averages over, see `generator.plane_waves.draw_waves`.
    """

    terms: list
    subsets: list
    resolution: int

    def gradient(self, points, rng, threads):
        """Return an unbiased estimate of the gradient, from new random waves.

        Parameters
        ----------
        points : ndarray of float32, shape (n, T*T, D)
        rng : numpy.random.Generator
        threads : concurrent.futures.Executor
            Works on the subsets; the result does not depend on it.

        Returns
        -------
        ndarray of float32, shape (n, T*T, D)
        """
        count = max(2, WAVES // len(self.subsets))
        waves = [draw_waves(columns, count, rng, self.resolution) for columns, _ in self.subsets]
        gradient = np.zeros_like(points)
        parts = threads.map(filtered_gradient, repeat(points), waves, repeat(self.terms))
        for (columns, weight), part in zip(self.subsets, parts, strict=True):
            gradient[..., columns] += weight * part
        return gradient
