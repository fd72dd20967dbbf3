# SPDX-License-Identifier: GPL-3.0-or-later
"""The time that a renderer takes to reach an error, from a few measured pairs of time and error."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

#: How far beyond the longest measured render a curve is followed, as a factor of its time.
FARTHEST = 4.0

#: Exponents of time between which error can fall beyond the longest render: from what denoised pictures do to smooth
#: scenes by a good sequence. A steeper or flatter last segment is chance.
_FLATTEST, _STEEPEST = -0.3, -1.5


@dataclass(frozen=True)
class Estimate:
    """A time or an error.

    Attributes
    ----------
    value : float
        Infinite if it cannot be reached.
    beyond : bool
        Whether it lies beyond what was measured, so that it is only an estimate.
    """

    value: float
    beyond: bool = False

    def over(self, other: "Estimate") -> "Estimate":
        """Return the ratio of this to another."""
        return Estimate(self.value / other.value, self.beyond or other.beyond)


class Curve:
    """Error over time, straight between measured points in the logarithms of both.

    A longer render that is no better is left out: nobody would choose it.

    Parameters
    ----------
    times, errors : sequence of float
        Of each measured render, in any order; those whose error is not above zero (the reference's noise was
        taken off, and nothing remained) are left out.
    """

    def __init__(self, times: Sequence[float], errors: Sequence[float]):
        self.points: list[tuple[float, float]] = []
        for time, error in sorted(zip(times, errors, strict=True)):
            if error > 0.0 and (not self.points or error < self.points[-1][1]):
                self.points.append((time, error))

    def time_to(self, error: float) -> Estimate:
        """Return the time after which the error is reached.

        An error larger than the quickest render's takes as long as that render. Beyond the best render the last
        segment goes on for up to `FARTHEST` times its time; errors below that are not reached.
        """
        if not self.points:
            return Estimate(np.inf, True)
        times, errors = self._logarithms()
        wanted = np.log(error)
        if wanted >= errors[-1]:
            return Estimate(float(np.exp(np.interp(-wanted, -errors, times))))
        time = float(np.exp(times[-1] + (wanted - errors[-1]) / self._last_slope()))
        return Estimate(time if time <= FARTHEST * self.points[-1][0] else np.inf, True)

    def error_at(self, time: float) -> Estimate:
        """Return the error after a time; infinite before the quickest render ends, estimated after the longest."""
        if not self.points or time < self.points[0][0]:
            return Estimate(np.inf)
        times, errors = self._logarithms()
        at = np.log(time)
        if at <= times[-1]:
            return Estimate(float(np.exp(np.interp(at, times, errors))))
        ahead = min(at - times[-1], np.log(FARTHEST))
        return Estimate(float(np.exp(errors[-1] + self._last_slope() * ahead)), True)

    def _logarithms(self) -> tuple[np.ndarray, np.ndarray]:
        times, errors = np.log(np.array(self.points)).T
        return times, errors

    def _last_slope(self) -> float:
        """Return the exponent by which error falls with time at the end, that of random samples if not known."""
        if len(self.points) == 1:
            return -1.0
        times, errors = self._logarithms()
        return float(np.clip((errors[-1] - errors[-2]) / (times[-1] - times[-2]), _STEEPEST, _FLATTEST))


def better(estimates: dict[str, Estimate]) -> tuple[str, Estimate]:
    """Return the smallest of several estimates and its name; of equal ones the first."""
    return min(estimates.items(), key=lambda named: named[1].value)
