# SPDX-License-Identifier: GPL-3.0-or-later
"""What samples and calls of Cycles cost: seconds, as measured while rendering, or samples, where time is not asked."""

import numpy as np

# A measurement changes what is known of a rectangle by this factor at most: a machine that does other things for a
# moment is not believed at once.
_SURPRISE = 4.0


# About how many samples of a pixel a call takes as long as.
CALL_SAMPLES = 1000


# What a sample costs where none differs from another, as of a background: next to nothing beside one of a surface.
_IDLE = 0.1


class Counted:
    """Costs that follow from the picture alone, so that the same picture comes out each time.

    Parameters and attributes are those of `Costs`, in samples of a pixel instead of seconds.
    """

    call = CALL_SAMPLES

    def __init__(self, size):
        self.pixels = np.ones(size[::-1])

    def learn(self, part, count, seconds):
        """Time is not asked."""

    def see(self, noise):
        """Take in which pixels have any noise, (height, width)."""
        self.pixels = np.where(noise > 0.0, 1.0, _IDLE)

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

    def see(self, noise):
        """Noise says nothing of seconds."""

    @property
    def sample(self):
        """Seconds of one sample of every pixel."""
        return self._sample if np.isnan(self.pixels).any() else float(self.pixels.sum())
