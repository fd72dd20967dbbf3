# SPDX-License-Identifier: GPL-3.0-or-later
"""Which squares of a picture take more samples (Mitchell 1991, section 9; Mitchell 1987).

A square's rate is decided by the eight squares around it, and never by its own samples: a square that was too bright by
chance would otherwise be diluted by further samples more often than one that was too dark, and the picture would lose
light (Kirk and Arvo, "Unbiased Sampling Techniques for Image Synthesis", 1991).  A square's own samples judge instead:
what rates would bring is foretold by noise that had no say in choosing them, so that chance cannot flatter them.

Rates are powers of two times the samples that all pixels have (`Rates`), so that every pixel ends with 2^k samples of
its own Sobol sequence, a net.
"""

import itertools
from typing import NamedTuple

import numpy as np

from ..blender.region import Rectangle

#: Weights of red, green and blue.
LUMINANCE = np.array((0.2126, 0.7152, 0.0722), np.float32)

#: Luminance beyond which a display shows no difference.
BRIGHTEST = 4.0

#: Luminance below which noise is hardly seen.
DARKEST = 0.01

# Share of the picture's mean variance that every square is credited with: its neighbours may be silent by chance.
_DOUBT = 0.01

# Halvings of an interval of some 64 doublings, down to a hundredth of one.
_HALVINGS = 12


class Rates(NamedTuple):
    """How many samples a pixel may have, by level: as many as all have, and doublings of that.

    Attributes
    ----------
    base : int
        Samples of level 0.
    length : int
        Samples up to which a pixel goes on with those that it has; of more, it takes all anew.
    most : int
        Samples of the last level, which need be no doubling.
    """

    base: int
    length: int
    most: int

    @property
    def top(self):
        """The last level."""
        return max(int(np.ceil(np.log2(self.most / self.base))), 0)

    def samples(self, levels):
        """Samples of a pixel at each of some levels."""
        return np.minimum(self.base << np.asarray(levels), self.most)

    def kept(self, levels, wanted):
        """Samples that a pixel keeps on its way from some levels to others."""
        return np.where((self.samples(wanted) <= self.length) | (wanted == levels), self.samples(levels), 0)

    def further(self, levels, wanted):
        """Samples that it takes on this way."""
        return self.samples(wanted) - self.kept(levels, wanted)


class Squares:
    """A picture cut into squares; those at the right and the top may be smaller.

    Parameters
    ----------
    size : (int, int)
        Width and height of the picture in pixels.
    side : int
        Of a square, in pixels.

    Attributes
    ----------
    areas : float array, shape (rows, columns)
        Pixels of each square.
    """

    def __init__(self, size, side):
        self.size = size
        self._x, self._y = (np.arange(0, length, side) for length in size)
        self._widths, self._heights = (
            np.diff(edges, append=length) for edges, length in zip((self._x, self._y), size, strict=True)
        )
        self.areas = np.outer(self._heights, self._widths).astype(float)

    def sums(self, pixels):
        """Sums over squares of values of pixels, (height, width) -> (rows, columns)."""
        rows = np.add.reduceat(pixels, self._y, axis=0, dtype=float)
        return np.add.reduceat(rows, self._x, axis=1)

    def each(self):
        """The `Rectangle` of every square, row by row."""
        rows = zip(self._y.tolist(), self._heights.tolist(), strict=True)
        columns = zip(self._x.tolist(), self._widths.tolist(), strict=True)
        cells = itertools.product(rows, columns)
        return [Rectangle(left, bottom, width, height) for (bottom, height), (left, width) in cells]

    def rectangles(self, wanted):
        """Few rectangles that cover the wanted squares, and only these.

        Parameters
        ----------
        wanted : bool array, shape (rows, columns)

        Returns
        -------
        list of Rectangle
        """
        edges = np.diff(np.pad(wanted, ((0, 0), (1, 1))).astype(np.int8), axis=1)
        rows, begins = np.nonzero(edges == 1)
        ends = np.nonzero(edges == -1)[1]
        # Runs of squares that are the same in rows below each other make a rectangle.
        order = np.lexsort((rows, ends, begins))
        rows, begins, ends = rows[order], begins[order], ends[order]
        is_new = np.ones(len(rows), bool)
        is_new[1:] = (np.diff(begins) != 0) | (np.diff(ends) != 0) | (np.diff(rows) != 1)
        first = np.nonzero(is_new)[0]
        heights = np.diff(first, append=len(rows))
        left, bottom = self._x[begins[first]], self._y[rows[first]]
        right = np.append(self._x, self.size[0])[ends[first]]
        top = np.append(self._y, self.size[1])[rows[first] + heights]
        return list(map(Rectangle, *(each.tolist() for each in (left, bottom, right - left, top - bottom))))


def around(sums, areas):
    """Mean over the squares around each one, itself left out; next neighbours count twice.

    Parameters
    ----------
    sums, areas : float array, shape (rows, columns)
        Of values of pixels, and their numbers.

    Returns
    -------
    float array, shape (rows, columns)
        A picture of a single square has no neighbours: 0.
    """
    weight = _ring(areas)
    return np.divide(_ring(sums), weight, out=np.zeros_like(weight), where=weight > 0.0)


def _ring(values):
    padded = np.pad(values, 1)
    cross = padded[:-2, 1:-1] + padded[2:, 1:-1] + padded[1:-1, :-2] + padded[1:-1, 2:]
    corners = padded[:-2, :-2] + padded[:-2, 2:] + padded[2:, :-2] + padded[2:, 2:]
    return 2.0 * cross + corners


def visible_variance(mean, half):
    """Square error of each pixel's luminance that its halves tell, over the root of the luminance.

    That lies between the error of light, to which shadows matter little, and that of what a display shows, which is
    about the square error over the luminance itself.

    Parameters
    ----------
    mean, half : float32 array, shape (height, width, 3)
        Mean of all samples, and of one half of them.

    Returns
    -------
    float32 array, shape (height, width)
    """
    one, other = (np.minimum(_finite(picture @ LUMINANCE), BRIGHTEST) for picture in (half, 2.0 * mean - half))
    return 0.25 * np.square(one - other) / np.sqrt(np.maximum(0.5 * (one + other), DARKEST))


def cycles_error(mean, half):
    """The error that Cycles' noise threshold bounds (`kernel/film/adaptive_sampling.h`).

    Parameters and result as of `visible_variance`; the difference of mean and half, over the root of the intensity
    where it is below 1, over the intensity elsewhere.
    """
    intensity = np.maximum(mean.sum(axis=2), 0.0)
    difference = np.abs(mean - half).sum(axis=2)
    return _finite(difference / (1e-4 + np.where(intensity < 1.0, np.sqrt(intensity), intensity)))


def _finite(values):
    return np.where(np.isfinite(values), values, 0.0)


def wishes(variance, squares, power):
    """How many doublings more than others each square would have, if these could be any number.

    Parameters
    ----------
    variance : float array, shape (height, width)
        Of a single sample of each pixel.
    squares : Squares
    power : float
        Of the variance that samples grow with.  One half leaves the least mean square error if that falls like 1 / n
        and the variance is known; it falls faster in most scenes, and is guessed.  Where samples take longer there
        should be fewer, but that is where the error falls slowly, too: on real files both even out.

    Returns
    -------
    float array, shape (rows, columns)
    """
    return power * np.log2(guessed(squares.sums(variance), squares.areas))


def guessed(sums, areas):
    """Variance of a pixel of each square, as the squares around tell; parameters as of `around`."""
    return around(sums, areas) + _DOUBT * sums.sum() / areas.sum() + 1e-30


def levels_in_time(wish, costs, levels, rates, most, seconds):
    """Levels of each square that fill the time best, int array (rows, columns).

    Parameters
    ----------
    wish, costs, levels : array, shape (rows, columns)
        Of each square: of `wishes`, seconds of a sample of all its pixels, and the level so far.
    rates : Rates
    most : int, or int array of that shape
        Level at most.
    seconds : float
        What the further samples may take.
    """

    def wanted(shift):
        return np.maximum(np.clip(np.rint(wish + shift), 0, most).astype(int), levels)

    low, high = -wish.max() - 1.0, np.max(most) - wish.min() + 1.0
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        fits = float((costs * rates.further(levels, wanted(middle))).sum()) <= seconds
        low, high = (middle, high) if fits else (low, middle)
    return wanted(low)
