# SPDX-License-Identifier: GPL-3.0-or-later
"""Adaptive sampling by sub-renders: which parts of the picture get more samples.

A sub-render fills a rectangle.  Were rates chosen pixel by pixel, nearly every rectangle would be the whole picture,
and most of its samples would be thrown away: as many would do as well everywhere.  So windows of the picture get a rate
each, every sample that is rendered is used, and a budget is what Cycles takes.

What a pixel sampled must have no say in its rate (`addon.adaptive`).  Here halves of the cells judge each other: rates
of even rows of cells follow from what the odd rows saw in the same windows, and the reverse.  A pixel shares its random
numbers with those of its own cell only, which are in its own half.

Cells have their windows moved, each by another amount, so that one rate fades into the next.
"""

import numpy as np

from . import adaptive

# Windows each way: 4 leave a seventh more error, 12 take twice as many sub-renders.
_WINDOWS = 8

# How far windows are moved, at most, in parts of a window.
_MOVED = 0.25

# Part of a window whose contrast asks for more samples: one pixel out of hundreds is always an outlier.
_CONTRASTING = 0.05


class Parts:
    """The parts of a picture that get a rate each: windows of one half of the cells.

    Parameters
    ----------
    region : addon.region.Region
    side : int
        Period of the cells, in pixels; where there are several, the smallest, of which all are multiples.
    """

    def __init__(self, region, side):
        width, height = region.size
        x, y = ((np.arange(size) + corner) % side for size, corner in zip(region.size, region.corner, strict=True))
        moved = np.random.default_rng(0).uniform(-_MOVED, _MOVED, (2, side, side))[:, y[:, None], x]
        column = moved[0] + _WINDOWS / width * (np.arange(width) + 0.5)
        row = moved[1] + _WINDOWS / height * (np.arange(height) + 0.5)[:, None]
        row, column = (np.clip(part, 0, _WINDOWS - 1).astype(np.intp) for part in (row, column))
        self._half = y % 2
        self._part = (self._half[:, None] * _WINDOWS + row) * _WINDOWS + column
        self._pixels = np.bincount(self._part.ravel(), minlength=2 * _WINDOWS**2)

    def levels_in_budget(self, picture, rates):
        """As `adaptive.levels_in_budget`."""
        # Both pixels of a pair along a row are in the same half.
        pairs = adaptive.variance_of_pairs(picture, axis=1)
        pairs = np.pad(pairs, ((0, 0), (0, 1)), mode="edge" if pairs.size else "constant")
        variance = self._as_others_see(pairs).astype(np.float32)
        # Each half spends its own budget: a shared one would have a pixel's own noise raise what others get of it.
        levels = np.zeros(variance.size, np.int8)
        for half in np.split(np.arange(variance.size), 2):
            if self._pixels[half].any():
                levels[half] = adaptive.levels_by_variance(variance[half], rates, self._pixels[half])
        return levels[self._part]

    def levels_over_threshold(self, picture, threshold):
        """As `adaptive.levels_over_threshold`, where a twentieth of the pixels around have such contrasts."""
        contrasting = np.zeros(self._part.shape)
        for half in (0, 1):
            rows = self._half == half
            if rows.any():
                contrasting[rows] = adaptive.levels_over_threshold(picture[rows], threshold) == 2
        return np.where(self._as_others_see(contrasting) > _CONTRASTING, 2, 1).astype(np.int8)[self._part]

    def _as_others_see(self, values):
        """Of each part, the mean of the other half's values in its window."""
        sums = np.bincount(self._part.ravel(), values.ravel(), len(self._pixels))
        return np.roll(sums / np.maximum(self._pixels, 1), _WINDOWS**2)


def rectangles(wanted):
    """Rectangles that hold the wanted pixels and no others.

    Parameters
    ----------
    wanted : bool array, shape (height, width)

    Returns
    -------
    list of (slice, slice)
        Rows and columns.
    """
    left, found = wanted.copy(), []
    while left.any():
        row, column = np.unravel_index(left.argmax(), left.shape)
        width = _run(left[row, column:])
        height = _run(left[row:, column : column + width].all(axis=1))
        found.append((slice(row, row + height), slice(column, column + width)))
        left[found[-1]] = False
    return found


def _run(values):
    """How many are true until the first that is not."""
    return values.size if values.all() else int(values.argmin())
