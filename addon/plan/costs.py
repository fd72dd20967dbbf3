# SPDX-License-Identifier: GPL-3.0-or-later
"""What samples and calls of Cycles cost: seconds, as measured while rendering, or samples, where time is not asked."""

import numpy as np

# A measurement changes what is known of a rectangle by this factor at most: a machine that does other things for a
# moment is not believed at once.
_SURPRISE = 4.0

# Seconds that calls have taken, from which on these tell more than chance.
_TELLING = 0.5

# How many samples of a pixel a call takes as long as, at least: on two processors, if they are quick ones.
_CALL = 1000


class Counted:
    """Costs in samples of a pixel instead of seconds.

    Time is asked in two places only: where samples take longer, each counts for more; and on many processors or a
    graphics card, where samples take little time, calls count for more of them.  Parameters and attributes are those of
    `Costs`.
    """

    def __init__(self, size):
        self.call = _CALL
        self.pixels = np.ones(size[::-1])
        self._seconds = np.ones(size[::-1])
        self._learned = 0.0

    def learn(self, part, count, seconds):
        """Take in how long a call has taken; parameters as of `Costs.learn`."""
        known = self._seconds[part]
        known[...] = seconds / (count * known.size)
        # A call for the whole picture tells nothing of its parts, and the first one waits for the scene.
        self._learned = self._learned + seconds if known.size < self.pixels.size else 0.0

    def weigh_call(self, samples):
        """Take in how many samples of a pixel a call takes as long as."""
        self.call = _CALL * 4 ** max(round(np.log(max(samples, 1.0) / _CALL) / np.log(4.0)), 0)

    def settle(self):
        """From now on samples of each pixel cost what was learned, 1 in the mean."""
        if self._learned >= _TELLING:
            self.pixels = self._seconds / max(self._seconds.mean(), 1e-30)

    @property
    def sample(self):
        """What one sample of every pixel costs."""
        return float(self.pixels.sum())


class Costs:
    """Seconds of calls and samples.

    Parameters
    ----------
    size : (int, int)
        Width and height of the picture in pixels.

    Attributes
    ----------
    call : float
        Of a call beside its samples; to be set before anything is learned.
    pixels : float array, shape (height, width)
        Of a sample of each pixel; not a number until parts of the picture have been measured.
    """

    def __init__(self, size):
        self.call = np.inf
        self.pixels = np.full(size[::-1], np.nan)
        self._sample = np.nan

    def learn(self, part, count, seconds):
        """Take in how long a call has taken.

        Parameters
        ----------
        part : (slice, slice)
            Rows and columns of its rectangle.
        count : int
            Samples of each of its pixels.
        seconds : float
        """
        known = self.pixels[part]
        spent = max(seconds - self.call, 0.01 * seconds)
        if np.isnan(known).any() and known.size == self.pixels.size:
            self._sample = spent / count
        elif np.isnan(known).any():
            known[...] = spent / (count * known.size)
        else:
            ratio = spent / max(count * known.sum(), 1e-12)
            known *= np.clip(ratio, 1.0 / _SURPRISE, _SURPRISE)

    def settle(self):
        """What is learned holds at once."""

    @property
    def sample(self):
        """Seconds of one sample of every pixel."""
        return self._sample if np.isnan(self.pixels).any() else float(self.pixels.sum())
