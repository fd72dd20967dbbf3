"""The spectral optimiser: gradient descent on the power that a low-pass filter lets through.

Mitchell 1991, section 5, asks for little power inside cylinders of low spatial frequency, and leaves "further work ...
perhaps using exhaustive Monte Carlo search" (section 10). Here that power is minimised itself. For an integrand
exp(i w.s) the error image is z(p) = exp(i w.s_p) - E z, and what the filter R leaves of it is the sum over image
frequencies of R^2 |DFT z|^2. Its derivative with respect to the values s_p is exact and costs two FFTs a wave. Every
step draws new waves (see `generator.plane_waves`) for each marginal subset and moves the values with Adam (Kingma and
Ba 2015), so what falls is the expectation over all integrands, not the error of some chosen ones.

The gradient is taken where the values will end up, at the nearest exactly stratified ones, and applied to the free
values (a straight-through estimator, Bengio et al. 2013), which are pulled along a little.
"""

from concurrent.futures import ThreadPoolExecutor
from itertools import repeat

import numpy as np

from .dimensions import marginal_subsets
from .layer_views import coupling, frame_views, prefix_views
from .low_pass import gaussian_response
from .plane_waves import draw_waves
from .strata import Strata
from .tile import check_size

SCALES = {0.0: 0.1, 1.0: 1.0, 2.0: 0.5, 4.0: 0.3}
"""Standard deviation of a low-pass filter in pixels to its weight, relative to white noise through the same filter.
At 0, the error inside single pixels, only means over several layers count."""

FRAME_SCALES = SCALES | {0.0: 7.0}
"""The same for frames, where the error inside a pixel is what flickers."""

SAMPLE_EMPHASIS = 2.0
FRAME_EMPHASIS = 1.0
"""How much means over many layers count, see `generator.layer_views.coupling`: a still image is mostly looked at when
all samples are there, an animation also frame by frame."""

STEPS = 4000
WAVES_PER_STEP = 64
STEP_SIZES = (0.05, 0.0002)
"""First and last step size, in units of the cube's side; geometric in between."""

_MOMENTUM, _SCALING = 0.9, 0.99  # Adam's two decay rates
_PULL = 0.03  # share of the way to the stratified values that the free ones go in a step
_THREADS = 2


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


def _reflect(points):
    """Fold values that have left the cube back into it, in place."""
    np.abs(points, out=points)
    np.subtract(1, np.abs(1 - points), out=points)
    np.clip(points, 0, 1, out=points)


def _subset_weights(dims, weights):
    """Return pairs of columns and weight for the marginal subsets that count."""
    subsets = marginal_subsets(dims)
    for label, weight in (weights or {}).items():
        if label not in subsets:
            raise ValueError(f"weights: expected subsets out of {', '.join(subsets)}, got {label!r}")
        if not 0 <= weight < np.inf:
            raise ValueError(f"weights: expected a number that is not negative for {label}, got {weight!r}")
    weighted = [(columns, float((weights or {}).get(label, 1))) for label, columns in subsets.items()]
    if not any(weight for _, weight in weighted):
        raise ValueError("weights: expected a positive one, got only zeros")
    return [(columns, weight) for columns, weight in weighted if weight]


def _check_scales(scales):
    for sigma, weight in scales.items():
        if not (0 <= sigma < np.inf and 0 <= weight < np.inf):
            raise ValueError(f"scales: expected sigma and weight not negative, got {sigma!r}: {weight!r}")
    if not any(sigma and weight for sigma, weight in scales.items()):
        raise ValueError("scales: expected a positive sigma with a positive weight, got none")


def _descend(strata, layers, pixels, terms, subsets, resolution, rng, steps, progress):
    """Return stratified points, shape (layers, pixels, D), after Adam's descent from random ones.

    `terms` are those of `passbands`, `subsets` pairs of columns and weight, `resolution` is the number of samples that
    `generator.plane_waves.draw_waves` asks for.
    """
    free = rng.random((layers, pixels, len(strata.dims)), dtype=np.float32)
    free = strata.nearest(free).astype(np.float32)
    per_subset = max(2, WAVES_PER_STEP // len(subsets))
    mean = np.zeros_like(free)
    square = np.zeros_like(free)
    first, last = STEP_SIZES
    with ThreadPoolExecutor(_THREADS) as threads:
        for step in range(steps):
            points = strata.nearest(free).astype(np.float32)
            free += _PULL * (points - free)
            waves = [draw_waves(columns, per_subset, rng, resolution) for columns, _ in subsets]
            gradient = np.zeros_like(free)
            parts = threads.map(filtered_gradient, repeat(points), waves, repeat(terms))
            for (columns, weight), part in zip(subsets, parts, strict=True):
                gradient[..., columns] += weight * part
            mean += (1 - _MOMENTUM) * (gradient - mean)
            square += (1 - _SCALING) * (gradient**2 - square)
            step_size = first * (last / first) ** (step / steps) / (1 - _MOMENTUM ** (step + 1))
            free -= step_size * mean / (np.sqrt(square / (1 - _SCALING ** (step + 1))) + 1e-12)
            _reflect(free)
            if progress:
                progress(step + 1, steps)
    return strata.final(free)


def spectral(size, dims, samples, rng, frames=1, weights=None, scales=None, steps=STEPS, progress=None):
    """Return values whose errors are high-frequency noise, jointly and in every marginal subset.

    Parameters
    ----------
    size : int
        Side T of the tile in pixels.
    dims : tuple of str
    samples : int
        Samples n of a pixel, a power of two: layers of which every prefix of a power of two is good, inside the pixel
        (see `generator.owen_nets`) and over the image.
    rng : numpy.random.Generator
    frames : int
        Layers of a looped animation instead: each is good alone, and so is the mean over consecutive ones.
    weights : dict of str to float, optional
        Weight of each marginal subset, by its label in `generator.dimensions.marginal_subsets`; 1 where none is given.
    scales : dict of float to float, optional
        Instead of `SCALES` or `FRAME_SCALES`.
    steps : int
        Steps of gradient descent.
    progress : callable, optional
        Called as ``progress(done, total)`` after each step.

    Returns
    -------
    ndarray of float64, shape (size, size, n, len(dims)), in [0, 1)
        n is `samples` or `frames`. Every axis is exactly stratified, T*T*n strata for samples, T*T in every frame. In
        single layers and frames a pair also has one point in each cell of a T x T grid; with several samples it is a
        (0, m, 2)-net in every pixel.

    Raises
    ------
    ValueError
        If an argument is not as described.
    """
    frames, steps = check_size("frames", frames), check_size("steps", steps)
    if frames > 1 and samples > 1:
        raise ValueError(f"frames: expected 1 with {samples} samples a pixel, got {frames}")
    if scales is None:
        scales = SCALES if frames == 1 else FRAME_SCALES
    _check_scales(scales)
    subsets = _subset_weights(dims, weights)
    layers, pixels = samples * frames, size * size
    strata = Strata(pixels, dims, samples, frames, rng)
    views = prefix_views(samples) if frames == 1 else frame_views(frames)
    terms = passbands(size, views, scales, SAMPLE_EMPHASIS if frames == 1 else FRAME_EMPHASIS)
    resolution = np.count_nonzero(views, axis=1).max()
    values = _descend(strata, layers, pixels, terms, subsets, resolution, rng, steps, progress)
    return values.transpose(1, 0, 2).reshape(size, size, layers, len(dims))
