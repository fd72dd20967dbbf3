"""The step test: how much of a tile's error survives a low-pass filter, compared with white noise.

For a subset of the dimensions and random functions f, the error image e(p) = mean over the pixel's samples of f(s_p),
minus E f, is filtered with a periodic Gaussian. Its mean square over pixels and functions, divided by what independent
uniform values give, is the figure: 1 for white noise, lower is better. With half-space functions this is the condition
of Mitchell 1991, section 5, in one number: the power inside the cylinders of figure 5, weighted by what edges excite.
"""

import numpy as np

from .dimensions import marginal_subsets
from .low_pass import filtered_power, gaussian_response
from .progress import part_of
from .test_functions import draw
from .tile import check_size

SIGMAS = (1.0, 2.0, 4.0)
MOST_FUNCTIONS = 100_000
LARGEST_SIGMA = 1024.0
"""Standard deviation of a filter in pixels, at most."""

_BATCH = 64
_LARGEST_BATCH = 1 << 24  # functions times values of a tile; fewer functions at a time where it is larger


def error_images(functions, values):
    """Return the error images of test functions.

    Parameters
    ----------
    functions : generator.test_functions.TestFunctions
    values : ndarray, shape (T, T, n, d)

    Returns
    -------
    ndarray of float64, shape (count, T, T)
        Mean over each pixel's samples, minus the expectation.
    """
    size, _, samples, d = values.shape
    pixels = np.asarray(values, dtype=np.float64).reshape(-1, samples, d)
    count = len(functions.mean)
    images = np.empty((count, size * size))
    at_once = max(1, _LARGEST_BATCH // (count * samples))  # all pixels, unless the tile is large
    for start in range(0, size * size, at_once):
        part = pixels[start : start + at_once]
        evaluated = functions.evaluate(part.reshape(-1, d)).reshape(count, -1, samples)
        images[:, start : start + at_once] = evaluated.mean(axis=2)
    return images.reshape(count, size, size) - functions.mean[:, None, None]


def relative_error(values, sigmas=SIGMAS, functions=400, seed=0, kind="step", progress=None):
    """Return the filtered error of one set of columns relative to white noise.

    Parameters
    ----------
    values : ndarray, shape (T, T, n, d)
        The columns of a tile to be judged jointly.
    sigmas : sequence of float
        Standard deviations of the low-pass filter in pixels; 0 looks at every pixel alone.
    functions : int
        How many random functions to draw.
    seed : int
        Seed of the functions.
    kind : {'step', 'bump', 'product'}
        See `generator.test_functions`.
    progress : callable, optional
        Called as ``progress(done, total)`` after some functions.

    Returns
    -------
    ndarray of float64, shape (len(sigmas),)
        Ratios of mean squares; white noise with the same n has expectation 1.

    Raises
    ------
    ValueError
        If `functions`, `seed` or a sigma is out of bounds, or `kind` is unknown.
    """
    functions = check_size("functions", functions, maximum=MOST_FUNCTIONS)
    for sigma in sigmas:
        if not 0 <= sigma <= LARGEST_SIGMA:
            raise ValueError(f"sigmas: expected numbers from 0 to {LARGEST_SIGMA:g}, got {sigma!r}")
    size, _, samples, d = values.shape
    rng = np.random.default_rng(check_size("seed", seed, minimum=0))
    responses = [gaussian_response(size, sigma) for sigma in sigmas]
    power = np.zeros(len(responses))
    white = np.zeros(len(responses))
    batch = max(1, min(_BATCH, _LARGEST_BATCH // (size * size)))
    for start in range(0, functions, batch):
        family = draw(kind, min(batch, functions - start), d, rng)
        images = error_images(family, values)
        for index, response in enumerate(responses):
            power[index] += filtered_power(images, response).sum()
            white[index] += family.variance.sum() / samples * np.mean(response**2)
        if progress:
            progress(min(start + batch, functions), functions)
    return power / white


def step_test(tile, sigmas=SIGMAS, functions=400, seed=0, kind="step", progress=None):
    """Return the step test's table for every marginal subset of a tile.

    Returns
    -------
    dict of str to ndarray of float64, shape (len(sigmas),)
        Subset label (see `generator.dimensions.marginal_subsets`) to relative errors; parameters as in
        `relative_error`.
    """
    subsets = marginal_subsets(tile.dims)
    table = {}
    for label, columns in subsets.items():
        report = part_of(progress, len(table), len(subsets))
        table[label] = relative_error(tile.values[..., list(columns)], sigmas, functions, seed, kind, report)
    return table
