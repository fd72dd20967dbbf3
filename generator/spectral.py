"""The spectral optimiser: gradient descent on the power that a low-pass filter lets through.

Mitchell 1991, section 5, asks for little power inside cylinders of low spatial frequency, and leaves "further work ...
perhaps using exhaustive Monte Carlo search" (section 10). Here that power is minimised itself. For an integrand
exp(i w.s) the error image is z(p) = exp(i w.s_p) - E z, and what the filter R leaves of it is the sum over image
frequencies of R^2 |DFT z|^2. Its derivative with respect to the values s_p is exact and costs two FFTs a wave. Every
step draws new waves (see `generator.plane_waves`) for each marginal subset and moves the values with Adam (Kingma and
Ba 2015), so what falls is the expectation over all integrands, not the error of some chosen ones.
"""

from concurrent.futures import ThreadPoolExecutor
from itertools import repeat

import numpy as np

from .dimensions import groups, marginal_subsets
from .equal_strata import stratify_line, stratify_square
from .low_pass import gaussian_response
from .plane_waves import draw_waves

SCALES = {1.0: 1.0, 2.0: 0.3, 4.0: 0.1}
"""Standard deviation of a low-pass filter in pixels to its weight, relative to white noise through the same filter."""

WAVES_PER_STEP = 64
STEP_SIZES = (0.03, 0.001)
"""First and last step size, in units of the cube's side; geometric in between."""

_MOMENTUM, _SCALING = 0.9, 0.99
_THREADS = 2


def _passband(size):
    """Return the weight of each image frequency: a mixture of squared Gaussian responses, one per scale."""
    squares = {sigma: gaussian_response(size, sigma) ** 2 for sigma in SCALES}
    return sum(SCALES[sigma] * square / square.mean() for sigma, square in squares.items()).astype(np.float32)


def filtered_gradient(points, waves, passband):
    """Return the gradient of the waves' filtered power with respect to the points.

    Parameters
    ----------
    points : ndarray of float32, shape (T*T, D)
    waves : PlaneWaves
    passband : ndarray of float32, shape (T, T)
        Weight of each image frequency.

    Returns
    -------
    ndarray of float32, shape (T*T, d)
        For the waves' columns, up to a factor that is common to all points.
    """
    phase = waves.frequencies @ points[:, waves.columns].T
    wave = np.empty(phase.shape, np.complex64)
    np.cos(phase, out=wave.real)
    np.sin(phase, out=wave.imag)
    images = wave.reshape(-1, *passband.shape) - waves.mean[:, None, None]
    filtered = np.fft.ifft2(np.fft.fft2(images) * passband).reshape(wave.shape)
    # d/dphase of conj(e) R^2 e is twice the real part of conj(i z) times the filtered image.
    slope = wave.real * filtered.imag - wave.imag * filtered.real
    return slope.T @ waves.frequencies / waves.variance


def _reflect(points):
    """Fold values that have left the cube back into it, in place."""
    np.abs(points, out=points)
    np.subtract(1, np.abs(1 - points), out=points)
    np.clip(points, 0, 1, out=points)


def _stratify(points, dims):
    """Return the points with every dimension and every pair exactly stratified."""
    result = np.empty(points.shape)
    for columns in groups(dims).values():
        if len(columns) == 1:
            result[:, columns[0]] = stratify_line(points[:, columns[0]])
        else:
            result[:, columns] = stratify_square(points[:, columns])
    return result


def spectral(size, dims, samples, rng, steps=2500, progress=None):
    """Return values whose errors are high-frequency noise, jointly and in every marginal subset.

    Parameters
    ----------
    size : int
        Side T of the tile in pixels.
    dims : tuple of str
    samples : int
        Samples n of a pixel; each is optimised alone.
    rng : numpy.random.Generator
    steps : int
        Steps of gradient descent.
    progress : callable, optional
        Called as ``progress(done, total)`` after each step.

    Returns
    -------
    ndarray of float64, shape (size, size, samples, len(dims)), in [0, 1)
    """
    layers = []
    for layer in range(samples):
        points = rng.random((size * size, len(dims)), dtype=np.float32)
        for done in _descend(points, size, dims, rng, steps):
            if progress:
                progress(layer * steps + done, samples * steps)
        layers.append(_stratify(points, dims).reshape(size, size, len(dims)))
    return np.stack(layers, axis=2)


def _descend(points, size, dims, rng, steps):
    """Move the points in place by Adam, yielding the number of steps done."""
    subsets = list(marginal_subsets(dims).values())
    per_subset = max(2, WAVES_PER_STEP // len(subsets))
    passband = _passband(size)
    mean = np.zeros_like(points)
    square = np.zeros_like(points)
    first, last = STEP_SIZES
    with ThreadPoolExecutor(_THREADS) as threads:
        for step in range(steps):
            waves = [draw_waves(columns, per_subset, rng) for columns in subsets]
            gradient = np.zeros_like(points)
            parts = threads.map(filtered_gradient, repeat(points), waves, repeat(passband))
            for wave, part in zip(waves, parts, strict=True):
                gradient[:, wave.columns] += part
            mean += (1 - _MOMENTUM) * (gradient - mean)
            square += (1 - _SCALING) * (gradient**2 - square)
            size_now = first * (last / first) ** (step / steps) / (1 - _MOMENTUM ** (step + 1))
            points -= size_now * mean / (np.sqrt(square / (1 - _SCALING ** (step + 1))) + 1e-12)
            _reflect(points)
            yield step + 1
