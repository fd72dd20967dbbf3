"""The spectral optimiser: gradient descent on the power that a low-pass filter lets through.

Mitchell 1991, section 5, asks for little power inside cylinders of low spatial frequency, and leaves "further work ...
perhaps using exhaustive Monte Carlo search" (section 10). Here that power itself (`generator.visible_error`) is
minimised with Adam (Kingma and Ba 2015). Every step draws new integrands, so what falls is the expectation over all of
them, not the error of some chosen ones.

The gradient is taken where the values will end up, at the nearest exactly stratified ones (`generator.strata`), and
applied to the free values (a straight-through estimator, Bengio et al. 2013), which are pulled along a little.
"""

from concurrent.futures import ThreadPoolExecutor

import numpy as np

from .dimensions import marginal_subsets
from .layer_views import frame_views, prefix_views
from .messages import one_line, quoted
from .strata import Strata
from .tile import check_shape, check_size
from .visible_error import VisibleError, passbands

SCALES = {0.0: 0.1, 1.0: 1.0, 2.0: 0.5, 4.0: 0.3}
"""Standard deviation of a low-pass filter in pixels to its weight, relative to white noise through the same filter.
At 0, the error inside single pixels, only means over several layers count."""

FRAME_SCALES = SCALES | {0.0: 7.0}
"""The same for frames, where the error inside a pixel is what flickers."""

STEPS = 4000
MOST_STEPS = 1_000_000
MOST_FRAMES = 256
MOST_POINTS = 1 << 18
"""Pixels times samples or frames, at most: 512 x 512, or 128 x 128 of 16. A step takes seconds there and 1 GB."""

MOST_SIDE_TIMES_FRAMES = 1 << 12
"""Pixels a side times frames, at most, since every frame is looked at together with all others."""

LARGEST_WEIGHT = 1e6
LARGEST_SIGMA = 1024.0
"""Standard deviation of a filter in pixels, at most."""

FIRST_STEP, FIRST_STEP_OF_MANY, LAST_STEP = 0.2, 0.05, 0.0002
"""Step sizes in units of the cube's side, geometric in between; layers that are looked at together begin with less."""

_MOMENTUM, _SCALING = 0.9, 0.99  # Adam's two decay rates
_PULL = 0.03  # share of the way to the stratified values that the free ones go in a step
_THREADS = 2


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
            raise ValueError(
                f"weights: expected subsets out of {one_line(', '.join(subsets), 80)}, got {quoted(label)}"
            )
        if not 0 <= weight <= LARGEST_WEIGHT:
            raise ValueError(f"weights: expected a number from 0 to {LARGEST_WEIGHT:g} for {label}, got {weight!r}")
    weighted = [(columns, float((weights or {}).get(label, 1))) for label, columns in subsets.items()]
    if not any(weight for _, weight in weighted):
        raise ValueError("weights: expected a positive one, got only zeros")
    return [(columns, weight) for columns, weight in weighted if weight]


def _check_scales(scales):
    for sigma, weight in scales.items():
        if not (0 <= sigma <= LARGEST_SIGMA and 0 <= weight <= LARGEST_WEIGHT):
            bounds = f"sigma from 0 to {LARGEST_SIGMA:g} and weight from 0 to {LARGEST_WEIGHT:g}"
            raise ValueError(f"scales: expected {bounds}, got {sigma!r}: {weight!r}")
    if not any(sigma and weight for sigma, weight in scales.items()):
        raise ValueError("scales: expected a positive sigma with a positive weight, got none")


def _descend(error, strata, layers, pixels, rng, steps, first, progress):
    """Return stratified points, shape (layers, pixels, D), after Adam's descent on `error` from random ones.

    The size of the `steps` steps falls from `first` to `LAST_STEP`.
    """
    free = rng.random((layers, pixels, len(strata.dims)), dtype=np.float32)
    free = strata.nearest(free).astype(np.float32)
    mean = np.zeros_like(free)
    square = np.zeros_like(free)
    total = steps + strata.final_reports(layers)
    with ThreadPoolExecutor(_THREADS) as threads:
        for step in range(steps):
            points = strata.nearest(free).astype(np.float32)
            free += _PULL * (points - free)
            gradient = error.gradient(points, rng, threads)
            mean += (1 - _MOMENTUM) * (gradient - mean)
            square += (1 - _SCALING) * (gradient**2 - square)
            step_size = first * (LAST_STEP / first) ** (step / steps) / (1 - _MOMENTUM ** (step + 1))
            free -= step_size * mean / (np.sqrt(square / (1 - _SCALING ** (step + 1))) + 1e-12)
            _reflect(free)
            if progress:
                progress(step + 1, total)
    finishing = iter(range(steps + 1, total + 1))
    return strata.final(free, progress and (lambda: progress(next(finishing), total)))


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
        Called as ``progress(done, total)`` after each step, and some times while the result is stratified.

    Returns
    -------
    ndarray of float64, shape (size, size, n, len(dims)), in [0, 1)
        n is `samples` or `frames`. Every axis is exactly stratified, T*T*n strata for samples, T*T in every frame. In
        single layers and frames a pair also has one point in each cell of a T x T grid; with several samples it is a
        (0, m, 2)-net in every pixel, but on the fine grid over the whole tile no more even than random points (37 % of
        the cells are empty).

    Raises
    ------
    ValueError
        If an argument is not as described.
    """
    frames = check_size("frames", frames, maximum=MOST_FRAMES)
    steps = check_size("steps", steps, maximum=MOST_STEPS)
    if frames > 1 and samples > 1:
        raise ValueError(f"frames: expected 1 with {samples} samples a pixel, got {frames}")
    if size * size * samples * frames > MOST_POINTS:
        raise ValueError(
            f"size: expected at most {MOST_POINTS} pixels times samples or frames, got {size} pixels a side"
        )
    if frames > 1 and size * frames > MOST_SIDE_TIMES_FRAMES:
        raise ValueError(
            f"frames: expected at most {MOST_SIDE_TIMES_FRAMES // size} of {size} pixels a side, got {frames}"
        )
    check_shape((size, size, samples * frames, len(dims)), len(dims))
    if scales is None:
        scales = SCALES if frames == 1 else FRAME_SCALES
    _check_scales(scales)
    subsets = _subset_weights(dims, weights)
    views = prefix_views(samples) if frames == 1 else frame_views(frames)
    passed = passbands(size, views, scales)
    error = VisibleError(passed, subsets, resolution=np.count_nonzero(views, axis=1).max())
    layers, pixels = samples * frames, size * size
    strata = Strata(pixels, dims, samples, frames, rng)
    first = FIRST_STEP if layers == 1 else FIRST_STEP_OF_MANY
    values = _descend(error, strata, layers, pixels, rng, steps, first, progress)
    return values.transpose(1, 0, 2).reshape(size, size, layers, len(dims))
