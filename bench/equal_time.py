# SPDX-License-Identifier: GPL-3.0-or-later
"""The setting with which one of Cycles and ours takes as much of the processor's time as a render of the other."""

from collections.abc import Callable, Sequence

import numpy as np

from bench.real_renders import EVEN

#: Times that differ by less count as the same.
SAME = 0.05

#: Thresholds between which one is looked for.
_THRESHOLDS = (0.003, 1.0)

#: By which power of its time Cycles' threshold falls, if that is not known yet; and what is believed of two renders.
_SLOPE, _SLOPES = -1.3, (-6.0, -0.5)

#: What samples are believed to take of a render's time, at least: two times that are close say little.
_LEAST_OF_TIME = 0.4

#: Values of a setting, and the processor seconds of their renders.
Known = Sequence[tuple[float, float]]


def value_in_time(rule: str, known: Known, time: float, seconds: Callable[[float], float], tries: int) -> float:
    """Return the value with which renders come nearest to a processor time.

    Parameters
    ----------
    rule : str
        `EVEN` for samples a pixel, `THRESHOLD` for noise thresholds.
    known : sequence of (float, float)
        At least one value and its seconds.
    time : float
        Seconds.
    seconds : callable
        Renders with a value and returns its seconds.
    tries : int
        Most renders.
    """
    known = list(known)
    for _ in range(tries):
        value = samples_in(known, time) if rule == EVEN else threshold_in(known, time)
        if is_near(_nearest(known, time)[0][1], time) or value in dict(known):
            break
        known.append((value, seconds(value)))
    return _nearest(known, time)[0][0]


def is_near(seconds: float, time: float, within: float = SAME) -> bool:
    """Tell whether a time differs from another by no more than a part of it."""
    return abs(seconds / time - 1.0) <= within


def samples_in(known: Known, time: float) -> int:
    """Return how many samples fit into about a processor time, of which they take some part."""
    (count, first), *others = _nearest(known, time)
    most = first / count
    slope = (first - others[0][1]) / (count - others[0][0]) if others else most
    return max(1, round(count + (time - first) / np.clip(slope, _LEAST_OF_TIME * most, most)))


def threshold_in(known: Known, time: float) -> float:
    """Return the threshold with which Cycles takes about a processor time.

    The straight line through the two nearest of those known, in the logarithms of both, is followed.
    """
    nearest = _nearest(known, time)
    thresholds, times = np.log(np.array(nearest)).T
    slope = _SLOPE
    if len(nearest) > 1 and times[0] != times[1]:
        slope = np.clip((thresholds[0] - thresholds[1]) / (times[0] - times[1]), *_SLOPES)
    wanted = np.exp(thresholds[0] + slope * (np.log(time) - times[0]))
    return float(f"{np.clip(wanted, *_THRESHOLDS):.3g}")


def _nearest(known: Known, time: float) -> list[tuple[float, float]]:
    """Return the two that are nearest to a time, the nearest first."""
    return sorted(known, key=lambda each: abs(np.log(each[1] / time)))[:2]
