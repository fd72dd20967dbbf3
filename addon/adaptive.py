# SPDX-License-Identifier: GPL-3.0-or-later
"""Adaptive sampling: which pixels get more samples, judged by a few everywhere (Mitchell 1991, section 9).

Pixels have one of a few rates.  The plan is the one for the same samples everywhere: all pixels take the first of their
block of it, most complete the block, and the picture is then as blue as without adapting.  Where it is noisier than
elsewhere, pixels take a whole larger block instead (`addon.spots`).  (Parts of larger blocks at all rates gain more at
noisy pixels, but are a tenth to a third worse after a low-pass wherever the noise is even.)

A pixel's own samples have no say in its rate, only its neighbours' have: a pixel that was too bright by chance would
otherwise be diluted by further samples more often than one that was too dark, and the picture would lose light (Kirk
and Arvo, "Unbiased Sampling Techniques for Image Synthesis", 1991).

Noise that the random numbers explain (`addon.control_variates`) is no reason for more samples: it is taken out of the
base before rates are chosen.  A pixel's own samples touch its neighbours' values there by the slopes alone, one voice
among a thousand and as often up as down, so that what they say of its rate has no sign.
"""

from dataclasses import dataclass

import numpy as np

_LUMINANCE = np.array((0.2126, 0.7152, 0.0722), np.float32)

# Neighbours weigh in by a Gaussian of this many pixels: a sample or two of each tell little.
_SIGMA = 4.0
_KERNEL = np.exp(-0.5 * (np.arange(-3.0 * _SIGMA, 3.0 * _SIGMA + 1.0) / _SIGMA) ** 2).astype(np.float32)
_KERNEL /= _KERNEL.sum()

# Share of the picture's mean variance that every pixel is credited with: neighbours may be silent by chance.
_DOUBT = 0.05

# Pixels whose worths differ by less than this many doublings are taken in random order: one rate fades into the next
# where the noise changes slowly, and a budget that ends among equals leaves no edge.
_DITHER = 0.5

# Halvings that leave no float32 between two thresholds.
_HALVINGS = 32

# Error of a part of a block over that of a whole block of that size, seen through a low-pass.
_BROKEN = 1.5

# A sample that is no part of a block tells about half as much as one of the block.
_LOOSE = 0.5

# Mitchell 1987, section 3: contrasts of red, green and blue that ask for more samples.
_CONTRASTS = np.array((0.4, 0.3, 0.6), np.float32)


@dataclass(frozen=True)
class Rates:
    """Samples of a pixel at each level.

    Attributes
    ----------
    base : int
        Samples that every pixel takes first: all that it gets at level 0.
    whole : int
        Samples of the plan's blocks, what a pixel gets at level 1.
    larger : tuple of int
        Samples of the larger blocks, what a pixel gets at levels 2, 3, ... beside the base: 2 or 4 times `whole`.
    """

    base: int
    whole: int
    larger: tuple[int, ...]

    @property
    def counts(self):
        """Samples at each level."""
        return np.array((self.base, self.whole, *(self.base + block for block in self.larger)))

    @property
    def base_weight(self):
        """What a sample of the base weighs beside the others, at each level: it is no part of the larger blocks."""
        return np.array((1.0, 1.0, *(_LOOSE for _ in self.larger)), np.float32)


def apart(level):
    """By which bit the seeds of a level's larger blocks differ from the plan's: beyond any animation's."""
    return 1 << 32 - level


def rates_in_budget(samples):
    """Rates that can have a mean of `samples`, at least 2."""
    return Rates(samples // 2, samples, (2 * samples, 4 * samples))


def rates_over_threshold(samples):
    """Rates of which the lower one is `samples`."""
    return Rates(samples, samples, (4 * samples,))


def rates_of(settings):
    """Rates that a scene's settings (`properties`) ask for; the same rate everywhere has no larger blocks."""
    samples = settings.samples
    if settings.adaptive == "THRESHOLD":
        return rates_over_threshold(samples)
    if settings.adaptive == "BUDGET" and samples > 1:
        return rates_in_budget(samples)
    return Rates(samples, samples, ())


def chooser(settings, in_budget, over_threshold):
    """What a scene's settings have levels chosen by: picture at the base rate -> levels; None for the same everywhere.

    Parameters
    ----------
    settings : properties.SpectralTilesSettings
    in_budget, over_threshold : callable
        As `levels_in_budget` and `levels_over_threshold`.
    """
    rates, threshold = rates_of(settings), settings.adaptive_threshold
    if not rates.larger:
        return None
    if settings.adaptive == "THRESHOLD":
        return lambda picture: over_threshold(picture, threshold)
    return lambda picture: in_budget(picture, rates)


def levels_in_budget(picture, rates):
    """Levels that leave the least mean square error when the mean is to be `rates.whole` samples.

    Parameters
    ----------
    picture : float32 array, shape (height, width, 4)
        Combined pass at the base rate.
    rates : Rates

    Returns
    -------
    int8 array, shape (height, width)
    """
    return levels_by_variance(_variance(picture), rates)


def levels_by_variance(variance, rates, pixels=None):
    """Levels of pixels, or of parts of the picture, that leave the least mean square error within the budget.

    Raising r samples of a pixel of variance v to s lowers its error by v / r - v / s = (s - r) v / rs, so steps are
    taken in the order of v / rs.

    Parameters
    ----------
    variance : float32 array
        Of a pixel's single sample.
    rates : Rates
    pixels : int array of the same shape, optional
        How many pixels each part has; one by default.

    Returns
    -------
    int8 array of the same shape
    """

    def of_pixels(values):
        return values if pixels is None else np.repeat(values, pixels)

    worth = np.log2(variance + _DOUBT * of_pixels(variance).mean() + 1e-30)
    worth += _DITHER * np.random.default_rng(0).random(worth.shape, np.float32)
    counts = rates.counts
    steps = -np.log2(counts[:-1] * counts[1:])
    steps[0] += np.log2(_BROKEN)
    # What a pixel must be worth for each step beside what it must be for the first.
    dearer = (steps[0] - steps).astype(np.float32)
    worths = np.sort(of_pixels(worth), axis=None)
    budget = (rates.whole - rates.base) * worths.size

    # Halves the interval of what the first step may ask for, from one that nobody meets, until the budget is spent.
    low, high = worths[0] - dearer[-1], worths[-1] + np.float32(1.0)
    for _ in range(_HALVINGS):
        middle = np.float32(0.5) * (low + high)
        takers = worths.size - np.searchsorted(worths, middle + dearer)
        low, high = (low, middle) if takers @ np.diff(counts) <= budget else (middle, high)
    return sum((worth >= least).astype(np.int8) for least in high + dearer)


def levels_over_threshold(picture, threshold):
    """Level 2 where the contrast of eight pixels around exceeds a threshold, 1 elsewhere.

    Contrast is Mitchell's, (brightest - darkest) / (brightest + darkest), but it must not tell about the pixel itself.
    In a good pattern the next neighbours of a bright pixel are dark, and those two pixels away bright: the eight are a
    knight's move away.  And their sum would tell by its sign: it is twice the mean of a wider neighbourhood.

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
    height, width = picture.shape[:2]
    padded = np.pad(picture[..., :3], ((2, 2), (2, 2), (0, 0)), mode="reflect" if min(height, width) > 2 else "edge")
    around = [
        padded[y : y + height, x : x + width] for y in range(5) for x in range(5) if {abs(y - 2), abs(x - 2)} == {1, 2}
    ]
    difference = np.maximum.reduce(around) - np.minimum.reduce(around)
    *sums, weight = _blurred(
        np.concatenate([np.moveaxis(picture[..., :3], 2, 0), np.ones((1, height, width), np.float32)])
    )
    contrast = 0.5 * difference / np.maximum(np.stack(sums, axis=2) / weight[..., None], 1e-6)
    return np.where((contrast > threshold * _CONTRASTS).any(axis=2), 2, 1).astype(np.int8)


def _variance(picture):
    """Variance of luminance and alpha around each pixel, its own value left out: (height, width).

    Half the mean square difference of next neighbours.  What changes slowly, or at an edge only, adds little to that,
    unlike to the variance of all neighbours together.
    """
    # Of each pixel: the sum over its pairs with a neighbour, and how many these are.
    sums = np.zeros((2, *picture.shape[:2]), np.float32)
    for axis in (0, 1):
        halves = variance_of_pairs(picture, axis)
        pairs = np.stack([halves, np.ones_like(halves)])
        for ends in (slice(None, -1), slice(1, None)):
            sums[(slice(None),) * (axis + 1) + (ends,)] += pairs
    squares, count = _around(sums)
    return np.maximum(squares, 0.0) / np.maximum(count, 1e-6)


def variance_of_pairs(picture, axis):
    """Variance of luminance and alpha that next neighbours along an axis tell: one less along it than pixels."""
    seen = np.stack([picture[..., :3] @ _LUMINANCE, picture[..., 3]])
    return 0.5 * np.square(np.diff(seen, axis=axis + 1)).sum(axis=0)


def _around(sums):
    """Weighted sums over all pixels' pairs but the pixel's own ones, which are in its sum and its neighbours'."""
    middle, next_to_it = _KERNEL[len(_KERNEL) // 2 :][:2]
    return _blurred(sums) - middle * (middle + next_to_it) * sums


def _blurred(planes):
    """Gaussian of planes, (planes, height, width); nothing is beyond them."""
    reach = len(_KERNEL) // 2
    for axis in (1, 2):
        margin = [(0, 0)] * 3
        margin[axis] = (reach, reach)
        views = np.lib.stride_tricks.sliding_window_view(np.pad(planes, margin), len(_KERNEL), axis=axis)
        planes = views @ _KERNEL
    return planes
