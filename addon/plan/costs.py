# SPDX-License-Identifier: GPL-3.0-or-later
"""What samples and calls of Cycles cost: seconds, as measured while rendering, or samples, weighed by those."""

import numpy as np

# A measurement changes what is known of a rectangle by this factor at most: a machine that does other things for a
# moment is not believed at once.
_SURPRISE = 4.0

# What samples take at least of a call's time, where that is asked but once, and where it is measured after each call.
_LEAST_PART_ONCE, _LEAST_PART = 0.05, 0.01

# What a sample costs where none differs from another, beside others.
_IDLE = 0.1

# What a sample costs of the many that Cycles takes at once for a whole picture, over one of a few for a square: 0.7 to
# 1 on two processors.
_AT_ONCE = 0.93

# How many samples of a pixel a call takes as long as, at least: of two threads, if they are quick ones.  Of more it
# takes the longer, since they all wait for what a call does beside its samples.
_CALL, _THREADS = 1000, 2


class Counted:
    """Costs in samples of a pixel instead of seconds.

    Time is asked but once, before samples are spread (`weigh`): where samples take longer, each counts for more; and on
    many processors or a graphics card, where samples take little time, calls count for more of them.  Parameters and
    attributes are those of `Costs`, and:

    Parameters
    ----------
    threads : int
        That samples are taken by, and whose times are added.

    Attributes
    ----------
    at_once : float
        What a sample costs of those that Cycles takes at once for the whole picture, over what it costs here.
    """

    def __init__(self, size, threads=_THREADS):
        self._waiting = max(threads / _THREADS, 1.0)
        self.call = _CALL * self._waiting
        self.at_once = 1.0
        self.pixels = np.ones(size[::-1])
        self._learned = []

    def learn(self, part, count, seconds):
        """Take in how long a call has taken; parameters as of `Costs.learn`."""
        self._learned.append((part, count, seconds))

    def weigh(self, call, sample, idle):
        """From now on calls and samples of each pixel count for what they have taken, samples 1 in the mean.

        Parameters
        ----------
        call, sample : float
            Seconds of a call beside its samples, and of a sample of a pixel in the mean.
        idle : bool array, shape (height, width)
            Where samples do not differ from each other, as those of a background, which take next to no time.
        """
        self.call = max(_CALL, call / sample) * self._waiting
        for part, count, seconds in self._learned:
            weights = np.where(idle[part], _IDLE, 1.0)
            taken = max(seconds - call, _LEAST_PART_ONCE * seconds) / count
            self.pixels[part] = taken * weights / weights.sum()
        if not idle.all():
            # More than that is what a call takes for any pixel, however many samples it is for.
            self.pixels[idle] = np.minimum(self.pixels[idle], _IDLE * self.pixels[~idle].mean())
        self.pixels /= self.pixels.mean()
        self.at_once = _AT_ONCE

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
        spent = max(seconds - self.call, _LEAST_PART * seconds)
        if np.isnan(known).any() and known.size == self.pixels.size:
            self._sample = spent / count
        elif np.isnan(known).any():
            known[...] = spent / (count * known.size)
        else:
            ratio = spent / max(count * known.sum(), 1e-12)
            known *= np.clip(ratio, 1.0 / _SURPRISE, _SURPRISE)

    @property
    def sample(self):
        """Seconds of one sample of every pixel."""
        return self._sample if np.isnan(self.pixels).any() else float(self.pixels.sum())
