"""Periodic Gaussian low-pass filters: the model of everything that blurs an image between the rays and the eye.

Mitchell 1991, section 3, treats reconstruction, pixel filter and eye together as one linear low-pass filter R.
"""

import numpy as np


def gaussian_response(size, sigma):
    """Return the frequency response R of a Gaussian blur on a `size` x `size` torus.

    Parameters
    ----------
    size : int
        Pixels along each side of the periodic image.
    sigma : float
        Standard deviation in pixels; 0 filters nothing.

    Returns
    -------
    ndarray of float64, shape (size, size)
        R in the order of `numpy.fft.fft2`, 1 at frequency zero.
    """
    omega = 2 * np.pi * np.fft.fftfreq(size)
    line = np.exp(-0.5 * (sigma * omega) ** 2)
    return line[:, None] * line[None, :]


def filtered_power(images, response):
    """Return the mean square of every image after the filter, without going back from the frequency domain (Parseval).

    Parameters
    ----------
    images : ndarray, shape (..., size, size)
    response : ndarray, shape (size, size)
        As returned by `gaussian_response`.

    Returns
    -------
    ndarray, shape (...)
    """
    size = response.shape[0]
    spectra = np.abs(np.fft.fft2(images)) ** 2
    return np.tensordot(spectra, response**2, axes=2) / size**4
