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


@dataclass(frozen=True)
class Passbands:
    """What is let through, of images and of pixels.

    Attributes
    ----------
    mixtures : ndarray of float32, shape (r, n)
        Linear combinations of the layers, such that their powers add up to that of all views. There are as many as the
        views have dimensions, which is less to filter than all layers: 5 of 16 where prefixes are looked at.
    band : ndarray of float32, shape (T, T)
        Weight of the image frequencies of a mixture.
    unfiltered : ndarray of float32, shape (n, n), or None
        Coupling of the layers in single pixels, where their error counts too.
    """

    mixtures: np.ndarray
    band: np.ndarray
    unfiltered: np.ndarray | None


def passbands(size, views, scales):
    """Return the passbands of all views.

    Parameters
    ----------
    size : int
        Side T of the tile in pixels.
    views : ndarray, shape (views, n)
        See `generator.layer_views`.
    scales : dict of float to float
        See `SCALES`.

    Returns
    -------
    Passbands
    """
    squares = {sigma: gaussian_response(size, sigma) ** 2 for sigma in scales if sigma}
    band = sum(scales[sigma] * square / square.mean() for sigma, square in squares.items())
    power, vectors = np.linalg.eigh(coupling(views))
    kept = power > 1e-6 * power.max()
    mixtures = np.sqrt(power[kept, None]) * vectors.T[kept]
    means = views[np.count_nonzero(views, axis=1) > 1]
    looks_inside = scales.get(0.0) and len(means)
    unfiltered = (scales[0.0] * coupling(means)).astype(np.float32) if looks_inside else None
    return Passbands(mixtures.astype(np.float32), band.astype(np.float32), unfiltered)


def filtered_gradient(points, waves, passed):
    """Return the gradient of the waves' filtered power with respect to the points.

    Parameters
    ----------
    points : ndarray of float32, shape (n, T*T, D)
    waves : PlaneWaves
    passed : Passbands

    Returns
    -------
    ndarray of float32, shape (n, T*T, d)
        For the waves' columns, up to a factor that is common to all points and columns.
    """
    layers = len(points)
    size = len(passed.band)
    phase = np.einsum("wd,npd->wnp", waves.frequencies, points[..., list(waves.columns)])
    wave = np.empty(phase.shape, np.complex64)
    np.cos(phase, out=wave.real)
    np.sin(phase, out=wave.imag)
    errors = (wave - waves.mean[:, None, None]).reshape(-1, layers, size, size)
    spectra = np.fft.fft2(_mix(passed.mixtures, errors)) * passed.band
    filtered = _mix(passed.mixtures.T, np.fft.ifft2(spectra))
    if passed.unfiltered is not None:
        filtered += _mix(passed.unfiltered, errors)
    filtered = filtered.reshape(wave.shape)
    # d/dphase of conj(e) R^2 e is twice the real part of conj(i z) times the filtered image.
    slope = wave.real * filtered.imag - wave.imag * filtered.real
    return np.einsum("wnp,wd->npd", slope, waves.frequencies * waves.weight[:, None])


def _mix(matrix, images):
    """Return linear combinations of layers: matrix (r, n) times images (m, n, T, T).

    Row by row of the images, because BLAS shares larger products among threads of its own; these and ours, waiting for
    one another, took up to ten times as long.
    """
    if matrix.size == 1:
        return matrix[0, 0] * images
    result = np.empty((len(images), len(matrix), *images.shape[2:]), images.dtype)
    np.matmul(matrix.astype(images.dtype), images.swapaxes(1, 2), out=result.swapaxes(1, 2))
    return result


@dataclass(frozen=True)
class VisibleError:
    """The energy that the spectral optimiser minimises.

    Attributes
    ----------
    passed : Passbands
    subsets : list of (tuple of int, float)
        Columns and weight of each marginal subset.
    resolution : int
        Samples that the largest view averages over, see `generator.plane_waves.draw_waves`.
    """

    passed: Passbands
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
        parts = threads.map(filtered_gradient, repeat(points), waves, repeat(self.passed))
        for (columns, weight), part in zip(self.subsets, parts, strict=True):
            gradient[..., columns] += weight * part
        return gradient
