# SPDX-License-Identifier: GPL-3.0-or-later
"""Adaptive sampling by rounds: which rectangles of a picture go on with their pixels' own samples, and how far.

All pixels take the same few samples first, whose halves tell how noisy they are (`rates`).  Then squares double their
samples, round by round: until as many samples are taken as by the same number everywhere, or a given time is spent, or
the error that Cycles' noise threshold bounds is below it everywhere.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from . import rates
from .costs import CALL_SAMPLES
from .rates import Squares

# Part of the mean samples that all pixels take first.
_FIRST_PART = 4

#: The fewest samples that have two halves of two.
FEWEST = 4

# Samples that a threshold is first asked at.
_FIRST_TEST = 16

# How many times the mean a pixel takes at most.
_MOST_TIMES = 16

# Squares are so many pixels wide, or a hundred-and-sixtieth of a larger picture, and twice and four times that.
_SIDE = 8
_ACROSS = 160

# Share of the time that may go into calls which tell where samples cost how much, and how many these are at most.
_SURVEY = 0.03
_MOST_TILES = 256

# Rates must leave less than this share of the error of the same samples everywhere, or all pixels go on together: their
# samples are then stratified together, too.
_WORTH = 0.9

# What a square's own noise may say of the rates, in times of what the squares around foretell: were a firefly to decide
# about the whole picture, and so about its own samples, the picture would lose light.
_MOST_SAY = 2.0

# The threshold grows with this power of the samples a pixel has taken, and is the user's for pixels of so many.  Cycles
# asks each pixel's two halves again and again, which agree by chance the sooner or later, so its own errors grow with
# the first power; the least mean square error wants one half.  In between pictures have about the error of Cycles'.
_RELIEF, _EXACT_AT = 0.75, 64

# Part of the time left that the next samples of all pixels may take.
_CAUTION = 0.75

# Share of a round's samples that the calls for them may be worth.
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
    def length(self):
        """Length of the sequence of a pixel's first samples: `samples` or the next power of two; then Cycles' own."""
        return _power_of_two_from(self.samples)

    @property
    def most(self):
        """Samples of a pixel at most, a power of two; those beyond `length` are of a sequence of this length."""
        return self.length * (_MOST_TIMES if self.is_mean else 1)

    @property
    def first(self):
        """Samples that all pixels take in the first call; if time is limited one, which tells how long more take."""
        return 1 if self.seconds is not None else max(self._usual_base // 2, 1)

    def base(self, sample_seconds):
        """Samples that all pixels take before their noise is judged, a power of two.

        Parameters
        ----------
        sample_seconds : float
            Seconds of one sample of all pixels.
        """
        if self.seconds is None:
            return self._usual_base
        affordable = int(self.seconds / _FIRST_PART / max(sample_seconds, 1e-9))
        return min(self._usual_base, _power_of_two_to(affordable))

    @property
    def _usual_base(self):
        wanted = self.samples // _FIRST_PART if self.is_mean else _FIRST_TEST
        return min(_power_of_two_from(max(wanted, FEWEST, self.least)), _power_of_two_to(self.samples))


def _power_of_two_from(count):
    return 1 << max(count - 1, 0).bit_length()


def _power_of_two_to(count):
    return 1 << max(count.bit_length() - 1, 0)


def opening(goal, base, size, costs):
    """The samples of all pixels from the first call's up to the base, whose halves tell noise.

    If time is limited the second half is rendered in tiles, whose times tell where samples cost how much.

    Parameters
    ----------
    goal : Goal
    base : int
        Of `Goal.base`.
    size : (int, int)
        Width and height of the picture.
    costs : Costs
        What the first call has told.

    Yields
    ------
    list of Shot
    """
    half = max(base // 2, goal.first)
    if half > goal.first:
        yield [Shot((0, 0, *size), goal.first, half - goal.first)]
    if base <= half:
        return
    if goal.seconds is None:
        yield [Shot((0, 0, *size), half, base - half)]
        return
    number = np.clip(_SURVEY * goal.seconds / costs.call, 1, _MOST_TILES)
    squares = Squares(size, _power_of_two_from(int(np.sqrt(size[0] * size[1] / number))))
    cells = np.ndindex(squares.areas.shape)
    rectangles = (squares.rectangles(_only(squares.areas.shape, cell))[0] for cell in cells)
    yield [Shot(rectangle, half, base - half) for rectangle in rectangles]


def _only(shape, cell):
    flags = np.zeros(shape, bool)
    flags[cell] = True
    return flags


def rounds(goal, base, seen, costs, elapsed):
    """Go on from the samples that all pixels have until the goal is reached.

    Parameters
    ----------
    goal : Goal
    base : int
        Samples that all pixels have, of `Goal.base`.
    seen : object
        The picture so far: `size`, and `mean` and `half` as of `rates`, renewed when shots have been rendered.
    costs : Costs
        Renewed likewise.
    elapsed : callable
        What the picture has cost so far, in the unit of `costs`: seconds if time is limited, else samples.

    Yields
    ------
    list of Shot
        One round; the picture is complete after each.
    """
    if goal.threshold is not None and base >= FEWEST:
        yield from _until_below(goal, base, seen, elapsed)
    else:
        yield from _in_time(goal, base, seen, costs, elapsed)


def _in_time(goal, base, seen, costs, elapsed):
    if base >= FEWEST:
        costs.see(rates.variance_of_mean(seen.mean, seen.half))
    end = goal.seconds if goal.seconds is not None else elapsed() + costs.sample * (goal.samples - base)
    doublings = int(np.log2(goal.most // base))
    chosen = _chosen_squares(goal, base, seen, costs, doublings, end - elapsed()) if base >= FEWEST else None
    if chosen is None:
        yield from evenly(goal, base, seen.size, costs, elapsed)
        return
    squares, wish = chosen
    levels = np.zeros(squares.areas.shape, int)
    for level in range(doublings):
        # What samples cost is known better after each round, so the rest is planned anew; noise is not judged again.
        prices = squares.sums(costs.pixels)
        most = np.where(levels == level, doublings, levels)
        going = _planned(squares, wish, prices, levels, base, most, end - elapsed(), costs.call) > level
        if not going.any():
            return
        yield [Shot(rectangle, base << level, base << level) for rectangle in squares.rectangles(going)]
        levels[going] += 1


def evenly(goal, count, size, costs, elapsed):
    """Complete the samples of all pixels from some count on; parameters and shots as of `rounds`."""
    most = goal.samples
    while count < most:
        # Little by little if time is limited, for what samples cost is known better each time.
        affordable = most if goal.seconds is None else int(_CAUTION * (goal.seconds - elapsed()) / costs.sample)
        further = min(most - count, affordable)
        if further < 1:
            return
        yield [Shot((0, 0, *size), count, further)]
        count += further


def _chosen_squares(goal, base, seen, costs, doublings, seconds):
    """Squares and wishes of the side that promises most; None if the same samples everywhere promise as much."""
    variance = rates.variance_of_mean(seen.mean, seen.half) * base
    even = min(base + seconds / costs.sample, goal.most)
    least, chosen = _WORTH, None
    for squares in _sides(seen.size):
        prices = squares.sums(costs.pixels)
        wish = rates.wishes(variance, prices, squares)
        levels = np.zeros(squares.areas.shape, int)
        wanted = _planned(squares, wish, prices, levels, base, doublings, seconds, costs.call)
        sums = squares.sums(variance)
        judging = np.minimum(sums, _MOST_SAY * squares.areas * rates.guessed(sums, squares.areas))
        ratio = rates.square_error(judging, wanted, base) * even / max(judging.sum(), 1e-30)
        if ratio < least:
            least, chosen = ratio, (squares, wish)
    return chosen


def _sides(size):
    """Squares of several sides, small ones first."""
    side = max(_SIDE, _power_of_two_from(max(size) // _ACROSS))
    return [Squares(size, side << power) for power in range(3)]


def _planned(squares, wish, prices, levels, base, most, seconds, call):
    """Levels whose samples and calls fit in the time."""
    wanted = rates.levels_in_time(wish, prices, levels, base, most, seconds)
    rounds_left = range(levels.min(), wanted.max())
    calls = sum(len(squares.rectangles((wanted > level) & (levels <= level))) for level in rounds_left)
    return rates.levels_in_time(wish, prices, levels, base, most, seconds - calls * call)


def _until_below(goal, base, seen, elapsed):
    squares = levels = None
    for level in range(int(np.log2(goal.most // base))):
        if goal.seconds is not None and elapsed() > goal.seconds:
            return
        count = base << level
        bound = goal.threshold * (count / _EXACT_AT) ** _RELIEF
        if squares is None:
            squares = _squares_for(seen, bound, base)
            levels = np.zeros(squares.areas.shape, int)
        noisy = (levels == level) & (_error(seen, squares) > bound)
        found = squares.rectangles(noisy)
        if not found:
            return
        yield [Shot(rectangle, count, min(count, goal.samples - count)) for rectangle in found]
        levels[noisy] += 1


def _error(seen, squares):
    """Root mean square of the error that Cycles' threshold bounds, around each square."""
    sums = squares.sums(np.square(rates.cycles_error(seen.mean, seen.half)))
    return np.sqrt(rates.around(sums, squares.areas))


def _squares_for(seen, bound, count):
    """The smallest squares of which further samples are worth much more than the calls for them."""
    for squares in _sides(seen.size):
        noisy = _error(seen, squares) > bound
        calls = len(squares.rectangles(noisy))
        if calls * CALL_SAMPLES <= _CALLS * count * squares.areas[noisy].sum():
            break
    return squares
