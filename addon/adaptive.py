# SPDX-License-Identifier: GPL-3.0-or-later
"""Adaptive sampling: which pixels get more samples, judged by a few everywhere (Mitchell 1991, section 9).

Rates are the base rate times powers of two.  A pixel's samples are then a leading part of one block of Cycles'
sequence, well stratified at any rate, and further samples complete what was taken before.

A pixel's own samples have no say in its rate, only its neighbours' have: a pixel that was too bright by chance would
otherwise be diluted by further samples more often than one that was too dark, and the picture would lose light (Kirk
and Arvo, "Unbiased Sampling Techniques for Image Synthesis", 1991).
"""

import numpy as np

# Doublings of the base rate at most.  A third one gains at the pixel's scale, but loses more after a low-pass.
LEVELS = 2

_LUMINANCE = np.array((0.2126, 0.7152, 0.0722), np.float32)

# Neighbours weigh in by a Gaussian of this many pixels: a sample or two of each tell little.
_SIGMA = 4.0

# Share of the picture's mean variance that every pixel is credited with: neighbours may be silent by chance.
_DOUBT = 0.1

# Mitchell 1987, section 3: contrasts of red, green and blue that ask for more samples.
_CONTRASTS = np.array((0.4, 0.3, 0.6), np.float32)


def base_rate(samples):
    """Samples a pixel that are taken first when the mean is to be `samples`."""
    return max(1, samples // 2)


def levels_in_budget(picture, base, samples):
    """Levels that leave the least mean square error at a given mean number of samples.

    Doubling s samples of a pixel of variance v lowers its error by v / 2s and costs s, so those with the largest
    v / s^2 are doubled.

    Parameters
    ----------
    picture : float32 array, shape (height, width, 4)
        Combined pass at the base rate.
    base, samples : int
        The base rate, and the mean number of samples to reach.

    Returns
    -------
    int8 array, shape (height, width)
        A pixel gets base * 2 ** level samples.
    """
    variance = _variance(picture)
    worth = np.log2(variance + _DOUBT * variance.mean() + 1e-30)
    # Pixels of equal worth are taken in random order, so that a budget that ends among them leaves no edge.
    worth += 1e-3 * np.random.default_rng(0).random(worth.shape, np.float32)
    level = np.arange(LEVELS)[:, None, None]
    best_first = np.argsort(2 * level - worth, axis=None)
    spent = np.cumsum(np.broadcast_to(base << level, (LEVELS, *worth.shape)).ravel()[best_first])
    paid = np.zeros(best_first.size, bool)
    paid[best_first] = spent <= (samples - base) * worth.size
    return paid.reshape(LEVELS, *worth.shape).sum(axis=0, dtype=np.int8)


def levels_over_threshold(picture, threshold):
    """Highest level where the contrast of the eight neighbours exceeds a threshold, none elsewhere.

    Parameters
    ----------
    picture : float32 array, shape (height, width, 4)
        Combined pass at the base rate.
    threshold : float
        Times Mitchell's contrasts.

    Returns
    -------
    int8 array, shape (height, width)
    """
    padded = np.pad(
        picture[..., :3], ((1, 1), (1, 1), (0, 0)), mode="reflect" if min(picture.shape[:2]) > 1 else "edge"
    )
    height, width = picture.shape[:2]
    around = [padded[y : y + height, x : x + width] for y in range(3) for x in range(3) if (y, x) != (1, 1)]
    brightest, darkest = np.maximum.reduce(around), np.minimum.reduce(around)
    contrast = (brightest - darkest) / np.maximum(brightest + darkest, 1e-6)
    return np.where((contrast > threshold * _CONTRASTS).any(axis=2), LEVELS, 0).astype(np.int8)


def _variance(picture):
    """Variance of luminance and alpha around each pixel, its own value left out: (height, width).

    Half the mean square difference of next neighbours.  What changes slowly, or at an edge only, adds little to that,
    unlike to the variance of all neighbours together.
    """
    seen = np.stack([picture[..., :3] @ _LUMINANCE, picture[..., 3]])
    # Of each pixel: the sum over its pairs with a neighbour, and how many these are.
    sums = np.zeros((2, *seen.shape[1:]), np.float32)
    for axis in (1, 2):
        halves = 0.5 * np.square(np.diff(seen, axis=axis)).sum(axis=0)
        pairs = np.stack([halves, np.ones_like(halves)])
        for ends in (slice(None, -1), slice(1, None)):
            sums[(slice(None),) * axis + (ends,)] += pairs
    squares, count = _around(sums)
    return np.maximum(squares, 0.0) / np.maximum(count, 1e-6)


def _around(sums):
    """Weighted sums over all pixels' pairs but the pixel's own ones, which are in its sum and its neighbours'."""
    reach = int(3.0 * _SIGMA)
    kernel = np.exp(-0.5 * (np.arange(-reach, reach + 1) / _SIGMA) ** 2).astype(np.float32)
    kernel /= kernel.sum()
    blurred = sums
    for axis in (1, 2):
        margin = [(0, 0)] * 3
        margin[axis] = (reach, reach)
        views = np.lib.stride_tricks.sliding_window_view(np.pad(blurred, margin), 2 * reach + 1, axis=axis)
        blurred = views @ kernel
    return blurred - kernel[reach] * (kernel[reach] + kernel[reach + 1]) * sums
