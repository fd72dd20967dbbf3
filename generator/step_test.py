"""The step test: how much of a tile's error survives a low-pass filter, compared with white noise.

For a subset of the dimensions and random functions f, the error image e(p) = mean over the pixel's samples of f(s_p),
minus E f, is filtered with a periodic Gaussian. Its mean square over pixels and functions, divided by what independent
uniform values give, is the figure: 1 for white noise, lower is better. With half-space functions this is the condition
of Mitchell 1991, section 5, in one number: the power inside the cylinders of figure 5, weighted by what edges excite.
"""

import numpy as np

from .dimensions import marginal_subsets
from .low_pass import filtered_power, gaussian_response
from .test_functions import draw
from .tile import check_size

SIGMAS = (1.0, 2.0, 4.0)
_BATCH = 64


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
    images = functions.evaluate(np.asarray(values, dtype=np.float64).reshape(-1, d))
    return images.reshape(-1, size, size, samples).mean(axis=3) - functions.mean[:, None, None]


def relative_error(values, sigmas=SIGMAS, functions=400, seed=0, kind="step"):
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

    Returns
    -------
    ndarray of float64, shape (len(sigmas),)
        Ratios of mean squares; white noise with the same n has expectation 1.

    Raises
    ------
    ValueError
        If `functions` is not positive, `seed` is negative, a sigma is not a number from 0 up, or `kind` is unknown.
    """
    functions = check_size("functions", functions)
    for sigma in sigmas:
        if not 0 <= sigma < np.inf:
            raise ValueError(f"sigmas: expected numbers that are not negative, got {sigma!r}")
    size, _, samples, d = values.shape
    rng = np.random.default_rng(check_size("seed", seed, minimum=0))
    responses = [gaussian_response(size, sigma) for sigma in sigmas]
    power = np.zeros(len(responses))
    white = np.zeros(len(responses))
    for start in range(0, functions, _BATCH):
        family = draw(kind, min(_BATCH, functions - start), d, rng)
        images = error_images(family, values)
        for index, response in enumerate(responses):
            power[index] += filtered_power(images, response).sum()
            white[index] += family.variance.sum() / samples * np.mean(response**2)
    return power / white


def step_test(tile, sigmas=SIGMAS, functions=400, seed=0, kind="step"):
    """Return the step test's table for every marginal subset of a tile.

    Returns
    -------
    dict of str to ndarray of float64, shape (len(sigmas),)
        Subset label (see `generator.dimensions.marginal_subsets`) to relative errors; parameters as in
        `relative_error`.
    """
    return {
        label: relative_error(tile.values[..., list(columns)], sigmas, functions, seed, kind)
        for label, columns in marginal_subsets(tile.dims).items()
    }
