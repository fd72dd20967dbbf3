# SPDX-License-Identifier: GPL-3.0-or-later
"""Adaptive sampling by rounds: which rectangles of a picture take how many samples.

All pixels take the same few samples first, whose halves tell how noisy they are (`rates`).  Then squares go on to
powers of two times these, as far as the samples or the time of the picture reach.  A noise threshold tells how many
samples the picture needs.

Samples up to `Goal.length` go on with the pixel's first ones.  A pixel of more starts anew, with the sequence that
Cycles gives a frame of just so many: Cycles spreads the errors of neighbouring pixels only over whole sequences, and
the first part of a longer one errs up to half as much again when blurred by a pixel (`python -m bench limits`).  What
the first samples cost is little beside.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..blender.region import Rectangle
from ..cycles.shot import Shot
from . import rates
from .rates import Rates, Squares

# Part of the mean samples that all pixels take first.
_FIRST_PART = 4

#: The fewest samples that have two halves of two.
FEWEST = 4

# Samples that a threshold is first asked at, and the sequence's length that they begin.
_FIRST_TEST, _FIRST_LENGTH = 16, 64

# How many times the mean a pixel takes at most.
_MOST_TIMES = 16

# Squares are so many pixels wide, or a hundred-and-sixtieth of a larger picture, and twice and four times that.
_SIDE = 8
_ACROSS = 160

# Share of the whole that may go into calls which tell where samples cost how much, and how many these are at most.
_SURVEY = 0.01
_MOST_CALLS = 256

# What a square's own noise may say of the rates, in times of what the squares around foretell: were a firefly to decide
# about the whole picture, and so about its own samples, the picture would lose light.
_MOST_SAY = 2.0

# The threshold is the user's where it asks for so many samples; it grows with these powers of the samples where it asks
# for more, and for fewer.  Cycles asks each pixel's two halves again and again, which agree by chance the sooner or
# later, and takes at least 32 to 64 samples: so its own errors change more slowly than its threshold.
_EXACT_AT, _RELIEF = 64, (0.25, 2.0)

# The error falls like this power of the samples.
_FALL = 0.6

# Part of the time left that the next samples of all pixels may take.
_CAUTION = 0.75

# How often a plan is made until its calls and samples together fill the time: fewer samples want fewer calls.
_PLANS = 3


class Worth(NamedTuple):
    """What noise matters in a picture, and when rates are worth it.

    Attributes
    ----------
    power : float
        Of the variance that a square's samples grow with (`rates.wishes`).
    rise : float
        Power of the variance of its mean that a square's error grows with.
    flattery : float
        By how much rates have to promise less error than the same samples everywhere, times the samples that tell:
        halves of a few flatter them, as where there are edges, which soon err less than these tell
        (docs/developer_guide.md tells what was tried).
    """

    power: float
    rise: float
    flattery: float


#: Of a picture as it is; and of one to be denoised, where little noise is taken away wholly, and much leaves more than
#: its part.
NOISY, DENOISED = Worth(0.4, 1.0, 0.4), Worth(0.32, 1.5, 0.8)


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
    worth : Worth
        `NOISY` or `DENOISED`.
    """

    samples: int
    threshold: float | None = None
    least: int = 0
    seconds: float | None = None
    worth: Worth = NOISY

    @property
    def is_mean(self):
        """Whether `samples` is the mean."""
        return self.threshold is None and self.seconds is None

    @property
    def length(self):
        """Samples of a pixel up to which it goes on with its first ones."""
        if self.threshold is None or self.seconds is not None:
            return self.samples
        return min(self.samples, max(_FIRST_LENGTH, self._usual_base))

    @property
    def most(self):
        """Samples of a pixel at most."""
        return self.samples * (_MOST_TIMES if self.is_mean else 1)

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

    The second half is rendered in squares, whose times tell where samples cost how much.

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
        yield [Shot(Rectangle(0, 0, *size), goal.length, goal.first, half - goal.first)]
    if base <= half:
        return
    whole = goal.length * costs.sample if goal.seconds is None else goal.seconds
    number = np.clip(_SURVEY * whole / costs.call, 1, _MOST_CALLS)
    squares = Squares(size, _power_of_two_from(int(np.sqrt(size[0] * size[1] / number))))
    yield [Shot(rectangle, goal.length, half, base - half) for rectangle in squares.each()]


def rounds(goal, base, seen, costs, elapsed):
    """Go on from the samples that all pixels have until the goal is reached.

    Parameters
    ----------
    goal : Goal
    base : int
        Samples that all pixels have, of `Goal.base`.
    seen : object
        The picture so far: `size`, and `mean` and `half` as of `rates`.
    costs : Costs or Counted
        Renewed when shots have been rendered.
    elapsed : callable
        What the picture has cost so far, in the unit of `costs`: seconds if time is limited, else samples.

    Yields
    ------
    list of Shot
        One round; the picture is complete after each shot.  A shot whose first sample is 0 takes the place of the
        samples that there were.
    """
    if base < max(FEWEST, min(goal.least, goal.samples)):
        yield from evenly(goal, base, goal.samples, seen.size, costs, elapsed)
        return
    variance = base * rates.visible_variance(seen.mean, seen.half)
    needed = goal.samples if goal.threshold is None else _needed(goal, base, seen, costs)
    # A mean is to take as long as Cycles' own samples would.
    mean = needed * costs.at_once if goal.is_mean else needed
    end = elapsed() + costs.sample * (mean - base)
    if goal.seconds is not None:
        end = goal.seconds if goal.threshold is None else min(goal.seconds, end)
    steps = Rates(base, goal.length, goal.most)
    chosen = _chosen_squares(steps, variance, seen.size, costs, end - elapsed(), goal.worth)
    if chosen is None:
        yield from evenly(goal, base, round(needed), seen.size, costs, elapsed)
        return
    squares, wish, wanted = chosen
    levels = np.zeros(squares.areas.shape, int)
    if goal.seconds is None:
        if wanted.any():
            yield _shots(steps, squares, levels, wanted)
        return
    for level in range(steps.top):
        # What samples cost is known better after each round, so the rest is planned anew; noise is not judged again.
        prices = squares.sums(costs.pixels)
        most = np.where(levels == level, steps.top, levels)
        going = _planned(squares, wish, prices, levels, steps, most, end - elapsed(), costs) > level
        if not going.any():
            return
        yield _shots(steps, squares, levels, levels + going)
        levels[going] += 1


def _shots(steps, squares, levels, wanted):
    """Shots that bring squares from some levels to others.

    Those of longer sequences come later, for Cycles heeds a change of the length only upwards.
    """
    kept, samples = steps.kept(levels, wanted), steps.samples(wanted)
    going = wanted > levels
    shots = []
    for last, first in sorted(set(zip(samples[going].tolist(), kept[going].tolist(), strict=True))):
        rectangles = squares.rectangles(going & (kept == first) & (samples == last))
        shots += [Shot(rectangle, max(last, steps.length), first, last - first) for rectangle in rectangles]
    return shots


def evenly(goal, count, mean, size, costs, elapsed):
    """Bring the samples of all pixels from `count` to `mean`; other parameters and shots as of `rounds`."""
    if mean > goal.length:
        count = 0
    while count < mean:
        # Little by little if time is limited, for what samples cost is known better each time.
        affordable = mean if goal.seconds is None else int(_CAUTION * (goal.seconds - elapsed()) / costs.sample)
        further = min(mean - count, affordable)
        if further < 1:
            return
        yield [Shot(Rectangle(0, 0, *size), max(goal.length, mean), count, further)]
        count += further


def _chosen_squares(steps, variance, size, costs, seconds, worth):
    """Squares, wishes and levels of the side that promises most; None if the same samples everywhere do as well."""
    even = min(steps.base + seconds / costs.sample, steps.most)
    least, chosen = 1.0 - worth.flattery / steps.base, None
    for squares in _sides(size):
        prices = squares.sums(costs.pixels)
        wish = rates.wishes(variance, squares, worth.power)
        levels = np.zeros(squares.areas.shape, int)
        wanted = _planned(squares, wish, prices, levels, steps, steps.top, seconds, costs)
        sums = squares.sums(variance)
        judging = np.minimum(sums / squares.areas, _MOST_SAY * rates.guessed(sums, squares.areas))
        errors = [
            (squares.areas * (judging / samples) ** worth.rise).sum() for samples in (steps.samples(wanted), even)
        ]
        ratio = errors[0] / max(errors[1], 1e-30)
        if ratio < least:
            least, chosen = ratio, (squares, wish, wanted)
    return chosen


def _sides(size):
    """Squares of several sides, small ones first."""
    side = max(_SIDE, _power_of_two_from(max(size) // _ACROSS))
    return [Squares(size, side << power) for power in range(3)]


def _planned(squares, wish, prices, levels, steps, most, seconds, costs):
    """Levels whose samples and calls fit in the time."""
    spent = 0.0
    for _ in range(_PLANS):
        wanted = rates.levels_in_time(wish, prices, levels, steps, most, seconds - spent)
        spent = 0.5 * (spent + len(_shots(steps, squares, levels, wanted)) * costs.call)
    return rates.levels_in_time(wish, prices, levels, steps, most, seconds - spent)


def _needed(goal, base, seen, costs):
    """Mean samples of a pixel that the threshold asks for."""
    squares = _sides(seen.size)[0]
    sums = squares.sums(np.square(rates.cycles_error(seen.mean, seen.half)))
    # As it will be at `_EXACT_AT` samples.
    times = np.sqrt(rates.around(sums, squares.areas)) * (base / _EXACT_AT) ** _FALL / max(goal.threshold, 1e-9)
    needed = _EXACT_AT * times ** (1.0 / (_FALL + np.where(times > 1.0, *_RELIEF)))
    prices = squares.sums(costs.pixels)
    return float((prices * np.clip(needed, base, goal.samples)).sum() / prices.sum())
