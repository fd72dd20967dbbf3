"""Power spectra of point patterns and of tiles (the figures 3, 5 and 10 of Mitchell 1991 as numbers)."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Periodogram:
    """An averaged power spectrum.

    Attributes
    ----------
    power : ndarray of float64, shape (size, size)
        Zero frequency, set to 0, in the middle; white noise has the expectation 1.
    radius : ndarray of float64, shape (rings,)
        Spatial frequencies in cycles a period (a tile's or the unit square's side).
    radial_mean : ndarray of float64, shape (rings,)
    anisotropy : ndarray of float64, shape (rings,)
        Variance over a ring relative to the squared mean, in dB (Ulichney 1987). A pattern without preferred
        directions has about -10 log10(realisations).
    """

    power: np.ndarray
    radius: np.ndarray
    radial_mean: np.ndarray
    anisotropy: np.ndarray


def _summarise(power):
    size = power.shape[0]
    power = np.fft.fftshift(power)
    axis = np.arange(size) - size // 2
    power[size // 2, size // 2] = 0
    ring = np.rint(np.hypot(axis[:, None], axis)).astype(int)
    radius = np.arange(1, (size - 1) // 2 + 1)
    mean = np.array([power[ring == r].mean() for r in radius])
    variance = np.array([power[ring == r].var(ddof=1) for r in radius])
    ratio = np.divide(variance, mean**2, out=np.full(len(mean), np.nan), where=(mean > 0) & (variance > 0))
    return Periodogram(power, radius.astype(float), mean, 10 * np.log10(ratio))


def pattern_periodogram(patterns, size=64):
    """Return the power spectrum of points in the unit square, |sum of exp(-2 pi i f.x)|^2 / N.

    Parameters
    ----------
    patterns : sequence of ndarray, shape (N, 2)
        Realisations of one process, averaged.
    size : int
        Frequencies -size/2 ... size/2 - 1 in both directions.

    Returns
    -------
    Periodogram
    """
    frequency = np.fft.fftfreq(size, 1 / size)
    total = np.zeros((size, size))
    for points in patterns:
        x = np.exp(-2j * np.pi * frequency[:, None] * points[:, 0])
        y = np.exp(-2j * np.pi * frequency[:, None] * points[:, 1])
        total += np.abs(y @ x.T) ** 2 / len(points)
    return _summarise(total / len(patterns))


def mode_periodogram(values, mode):
    """Return the spectrum of the error image of one integrand, cos(pi m.s) over the tile's pixels.

    Parameters
    ----------
    values : ndarray, shape (T, T, n, d)
        Pixels' samples are averaged.
    mode : sequence of float, shape (d,)
        Half-periods across the cube along each axis.

    Returns
    -------
    Periodogram
        Relative to independent uniform values.
    """
    size, samples = values.shape[0], values.shape[2]
    mode = np.asarray(mode, dtype=float)
    error = np.cos(np.pi * values.astype(float) @ mode).mean(axis=2)
    mean = np.real(np.prod(np.exp(0.5j * np.pi * mode) * np.sinc(mode / 2)))
    square = 0.5 + 0.5 * np.real(np.prod(np.exp(1j * np.pi * mode) * np.sinc(mode)))
    white = (square - mean**2) / samples * size**2
    return _summarise(np.abs(np.fft.fft2(error - mean)) ** 2 / white)


def error_periodogram(errors):
    """Return the spectrum of error images (figures 10a and 10b).

    Parameters
    ----------
    errors : sequence of ndarray, shape (size, size)
        Images less their reference; their spectra are averaged.

    Returns
    -------
    Periodogram
        |DFT|^2 / pixels: an error without structure has its mean square at all frequencies.
    """
    return _summarise(np.mean([np.abs(np.fft.fft2(error)) ** 2 / error.size for error in errors], axis=0))


def cylinder_power(t, harmonics=8, band_limits=(8, 16)):
    """Return the power at each temporal frequency inside cylinders of low spatial frequency (figure 5).

    Parameters
    ----------
    t : ndarray, shape (T, T, n)
        Times of a tile's samples.
    harmonics : int
        Temporal frequencies 1 ... harmonics, in periods of the shutter interval.
    band_limits : sequence of float
        Radii of the cylinders in cycles a tile.

    Returns
    -------
    ndarray of float64, shape (len(band_limits), harmonics)
        1 for white noise. Section 5 wants it small, and for the narrower cylinder small up to higher frequencies.
    """
    size = t.shape[0]
    frequency = np.fft.fftfreq(size, 1 / size)
    radius = np.hypot(frequency[:, None], frequency)
    table = np.empty((len(band_limits), harmonics))
    for k in range(harmonics):
        image = np.exp(2j * np.pi * (k + 1) * t.astype(float)).mean(axis=2)
        power = np.abs(np.fft.fft2(image)) ** 2 * t.shape[2] / size**2
        for row, limit in enumerate(band_limits):
            table[row, k] = power[radius <= limit].mean()
    return table
