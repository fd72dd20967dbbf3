# SPDX-License-Identifier: GPL-3.0-or-later
"""Adaptive sampling by rounds: which rectangles of a picture go on with their pixels' own samples, and how far.

All pixels take the same few samples first, whose halves tell how noisy they are (`rates`).  Then squares double their
samples, round by round: until the time of a picture with the same samples everywhere is spent, or a given time, or until
the error that Cycles' noise threshold bounds is below it everywhere.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from . import rates
from .rates import Squares

# Part of the mean samples that all pixels take first.
_FIRST_PART = 4

#: The fewest samples that have two halves of two.
FEWEST = 4

# Samples that a threshold is first asked at.
_FIRST_TEST = 16

# How many times the mean a pixel takes at most: beyond, the first samples of its sequence would become too white.
_MOST_TIMES = 16

# Squares are so many pixels wide, or a hundred-and-sixtieth of a larger picture, and twice and four times that.
_SIDE = 8
_ACROSS = 160

# Rates must leave less than this share of the error of the same samples everywhere, or all pixels go on together: their
# samples are then stratified together, too.
_WORTH = 0.9

# Share of a round's time that its calls may take beside samples.
_CALLS = 0.1


class Shot(NamedTuple):
    """Samples of a rectangle of the picture.

    Attributes
    ----------
    rectangle : (int, int, int, int)
        Left, bottom, width and height in pixels.
    first, count : int
        First sample of each pixel's sequence, and how many.
    """

    rectangle: tuple[int, int, int, int]
    first: int
    count: int


@dataclass(frozen=True)
class Goal:
    """When a picture is finished.

    Attributes
    ----------
    samples : int
        Mean of all pixels; the most of one if there is a threshold or a time.
    threshold : float or None
        As Cycles' noise threshold.
    least : int
        Samples that every pixel takes at least.
    seconds : float or None
        What the whole picture may take.
    """

    samples: int
    threshold: float | None = None
    least: int = 0
    seconds: float | None = None

    @property
    def is_mean(self):
        """Whether `samples` is the mean."""
        return self.threshold is None and self.seconds is None

    @property
    def most(self):
        """Samples of a pixel at most, a power of two: the length of its sequence."""
        return _power_of_two_from(self.samples * (_MOST_TIMES if self.is_mean else 1))

    @property
    def base(self):
        """Samples that every pixel takes first, a power of two; all of them if there is nothing to adapt."""
        first = self.samples // _FIRST_PART if self.is_mean else _FIRST_TEST
        return min(_power_of_two_from(max(first, FEWEST, self.least)), _power_of_two_from(self.samples))


def _power_of_two_from(count):
    return 1 << max(count - 1, 0).bit_length()


def tiles(size, first, count):
    """Samples of all pixels, as shots whose times tell where samples cost how much.

    Parameters
    ----------
    size : (int, int)
        Width and height of the picture.
    first, count : int
        As of `Shot`.

    Returns
    -------
    list of Shot
    """
    side = _power_of_two_from(int(np.sqrt(size[0] * size[1] / 16)))
    squares = Squares(size, side)
    cells = np.ndindex(squares.areas.shape)
    return [Shot(squares.rectangles(_only(squares.areas.shape, cell))[0], first, count) for cell in cells]


def _only(shape, cell):
    flags = np.zeros(shape, bool)
    flags[cell] = True
    return flags


def rounds(goal, seen, costs, elapsed):
    """Go on from the samples that all pixels have until the goal is reached.

    Parameters
    ----------
    goal : Goal
    seen : object
        The picture so far: `mean` and `half` as of `rates`, renewed when shots have been rendered.
    costs : Costs
        Renewed likewise.
    elapsed : callable
        Seconds since the picture was begun.

    Yields
    ------
    list of Shot
        One round; the picture is complete after each.
    """
    if goal.threshold is not None:
        yield from _until_below(goal, seen, costs, elapsed)
    else:
        yield from _in_time(goal, seen, costs, elapsed)


def _in_time(goal, seen, costs, elapsed):
    base, size = goal.base, seen.size
    doublings = int(np.log2(goal.most // base))
    if goal.is_mean:
        end = elapsed() + costs.sample * (goal.samples - base)
        even = goal.samples
    else:
        end = goal.seconds
        even = base + (end - elapsed()) / costs.sample
    variance = rates.variance_of_mean(seen.mean, seen.half) * base
    best = _best_squares(variance, costs, base, doublings, end - elapsed(), size)
    if best is None or best[0] > _WORTH * variance.sum(dtype=float) / even:
        if int(even) > base:
            yield [Shot((0, 0, *size), base, min(int(even), goal.most) - base)]
        return
    _, squares, wish = best
    levels = np.zeros(squares.areas.shape, int)
    for level in range(doublings):
        # What samples cost is known better after each round, so the rest is planned anew; noise is not judged again.
        prices = squares.sums(costs.pixels)
        most = np.where(levels == level, doublings, levels)
        wanted = _planned(squares, wish, prices, levels, base, most, end - elapsed(), costs.call)
        found = squares.rectangles(wanted > level)
        if not found:
            return
        yield [Shot(rectangle, base << level, base << level) for rectangle in found]
        levels = np.where(wanted > level, level + 1, levels)


def _sides(size):
    """Squares of several sides, small ones first."""
    side = max(_SIDE, _power_of_two_from(max(size) // _ACROSS))
    return [Squares(size, side << power) for power in range(3)]


def _best_squares(variance, costs, base, doublings, seconds, size):
    """Expected error, squares and wishes of the side that promises most; None if no time is left for any."""
    best = None
    for squares in _sides(size):
        prices = squares.sums(costs.pixels)
        wish = rates.wishes(variance, prices, squares)
        levels = np.zeros(squares.areas.shape, int)
        wanted = _planned(squares, wish, prices, levels, base, doublings, seconds, costs.call)
        if wanted.any():
            error = rates.square_error(squares.sums(variance), wanted, base)
            if best is None or error < best[0]:
                best = error, squares, wish
    return best


def _planned(squares, wish, prices, levels, base, most, seconds, call):
    """Levels whose samples and calls fit in the time."""
    wanted = rates.levels_in_time(wish, prices, levels, base, most, seconds)
    rounds_left = range(levels.min(), wanted.max())
    calls = sum(len(squares.rectangles((wanted > level) & (levels <= level))) for level in rounds_left)
    return rates.levels_in_time(wish, prices, levels, base, most, seconds - calls * call)


def _until_below(goal, seen, costs, elapsed):
    base, squares = goal.base, None
    for level in range(int(np.log2(goal.most // base))):
        if goal.seconds is not None and elapsed() > goal.seconds:
            return
        count = base << level
        error = np.square(rates.cycles_error(seen.mean, seen.half))
        for squares in [squares] if squares else _sides(seen.size):
            noisy = rates.around(squares.sums(error), squares.areas) > goal.threshold**2
            if level:
                noisy &= levels == level
            found = squares.rectangles(noisy)
            if len(found) * costs.call <= _CALLS * count * squares.sums(costs.pixels)[noisy].sum():
                break
        if not found:
            return
        yield [Shot(rectangle, count, min(count, goal.samples - count)) for rectangle in found]
        levels = noisy * (level + 1) if level == 0 else np.where(noisy, level + 1, levels)
