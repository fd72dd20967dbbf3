# SPDX-License-Identifier: GPL-3.0-or-later
"""What the surroundings of each pixel say of its noise: how large it usually is, what colour it has, and how it is now.

A pixel at an edge belongs to one side, and only that side may speak for it.  So each pixel has four windows, with
itself at a corner of each, and the one that varies least is asked: of a straight edge at least one window sees nothing
(Kuwahara et al., "Processing of RI-angiocardiographic images" (1976)).  A plane is fitted to each window, since light
that falls off is no noise.  The pixel itself is left out, so that what is said knows nothing of its own noise: what is
left over without it follows from what is with it and its leverage (Belsley, Kuh and Welsch, "Regression Diagnostics"
(1980), section 2.1).
"""

import itertools

import numpy as np

# Pixels a side of a window, and how many these are.
SIDE = 5
_PIXELS = np.float32(SIDE**2)

# Sum over a window of the squared distances from its middle along a side.
_MOMENT = np.float32(SIDE * sum(away**2 for away in range(-(SIDE // 2), SIDE // 2 + 1)))

# How free a pixel at a corner is of the plane that is fitted to its window: one less its leverage.
_FREE = np.float32(1.0 - 1.0 / _PIXELS - 2.0 * (SIDE // 2) ** 2 / _MOMENT)

# A difference counts as at most this many times the usual one: a very bright sample must not speak for its whole block.
_OUTLIER = 4.0

# Noise below this part of the brightness is none, but what rounding leaves.
_ROUNDING = np.float32(1e-3)

# Brighter than this pixels are not told apart, so that no square overflows.
_BRIGHTEST = np.float32(1e15)

_TINY, _HUGE = np.float32(1e-30), np.float32(1e30)

# Opacity of a film that is not seen through.
_OPAQUE = 0.9999


def opaque(opacity):
    """Where the film (height, width) is not seen through, neither at a pixel nor at those next to it."""
    flags = np.pad(opacity >= _OPAQUE, 1, mode="edge")
    rows = flags[:-2] & flags[1:-1] & flags[2:]
    return rows[:, :-2] & rows[:, 1:-1] & rows[:, 2:]


class Surroundings:
    """What the surroundings say in a pass.

    Parameters
    ----------
    light : float32 array, shape (3, height, width)
        Red, green, blue.
    judged : bool array, shape (height, width), optional
        Where noise is looked for; everywhere by default.

    Attributes
    ----------
    noise : float32 array, shape (height, width)
        The difference of red, green and blue together from what the pixel's side tells, in units of `size`.
    size : float32 array, shape (height, width)
        The standard deviation on that side; 0 where there is no noise, or nothing can be done about it.
    """

    def __init__(self, light, judged=None):
        self._colour = light
        if not np.isfinite(self._colour.sum()):
            self._colour = np.nan_to_num(self._colour)
        self._colour = np.clip(self._colour, -_BRIGHTEST, _BRIGHTEST)
        self._grey = self._colour[0] + self._colour[1]
        self._grey += self._colour[2]
        self._grey /= np.float32(3)
        shape = self._grey.shape
        self.noise = np.zeros(shape, np.float32)
        self.size = np.zeros(shape, np.float32)
        if min(shape) >= SIDE:
            self._look()
        if judged is not None:
            self.size *= judged
            self.noise *= judged

    def _look(self):
        # Of each window the plane that fits best: its middle, and its slopes by steps of a pixel.
        rows, slopes = sums(self._grey, 0), _weighted_sums(self._grey, 0)
        middle, right, up = sums(rows, 1) / _PIXELS, _weighted_sums(rows, 1) / _MOMENT, sums(slopes, 1) / _MOMENT
        square = np.square(self._grey)
        left_over = sums(sums(square, 0), 1)
        for part, weight in ((middle, _PIXELS), (right, _MOMENT), (up, _MOMENT)):
            left_over -= weight * np.square(part)
        height, width = middle.shape
        # The bits of positive numbers are in the order of the numbers; the last two tell which window it is.
        least = np.full(self._grey.shape, np.inf, np.float32).view(np.int32)
        starts = []
        for corner, (y, x) in enumerate(itertools.product((0, SIDE - 1), repeat=2)):
            starts.append(y * width + x)
            # The pixels that are this corner of a window, and what they differ by from its plane.
            own = slice(y, y + height), slice(x, x + width)
            beside = self._grey[own] - middle
            beside -= np.float32(x - SIDE // 2) * right
            beside -= np.float32(y - SIDE // 2) * up
            # What is left over without the pixel.
            np.square(beside, out=beside)
            beside /= _FREE
            variance = left_over - beside
            variance /= np.float32(SIDE**2 - 4)
            bits = np.maximum(variance, np.float32(0), out=variance).view(np.int32)
            bits &= ~3
            bits |= corner
            np.minimum(least[own], bits, out=least[own])
        rows, columns = (np.arange(size, dtype=np.int32) for size in least.shape)
        corner = least & 3
        self._window = rows[:, None] * width + columns
        self._window -= np.array(starts, np.int32).take(corner)
        least &= ~3
        variance = least.view(np.float32)
        mean = middle.take(self._window)
        variance *= variance > np.square(_ROUNDING * mean)
        np.sqrt(variance, out=self.size)
        away = np.float32(SIDE // 2)
        mean += np.array([-away, away, -away, away]).take(corner) * right.take(self._window)
        mean += np.array([-away, -away, away, away]).take(corner) * up.take(self._window)
        np.divide((self._grey - mean) / _FREE, self.size + _HUGE * (variance == 0.0), out=self.noise)
        np.clip(self.noise, -_OUTLIER, _OUTLIER, out=self.noise)

    def coloured(self, noise):
        """Noise in units of `size`, (height, width), as red, green and blue of the colour of each pixel's side."""
        if min(noise.shape) < SIDE:
            return np.zeros_like(self._colour)
        colours = np.stack([sums(sums(part, 0), 1).take(self._window) - part for part in self._colour])
        np.maximum(colours, np.float32(0), out=colours)
        amount = noise * self.size
        amount *= np.float32(3)
        amount /= np.maximum(colours[0] + colours[1] + colours[2], _TINY)
        colours *= amount
        return colours


def sums(plane, axis):
    """Sums over `SIDE` pixels that follow each other along an axis, where all of them are there."""
    along = plane.swapaxes(0, axis)
    count = len(along) - SIDE + 1
    total = along[:count] + along[1 : 1 + count]
    for shift in range(2, SIDE):
        total += along[shift : shift + count]
    return total.swapaxes(0, axis)


def _weighted_sums(plane, axis):
    """The same, of each pixel times its distance from the middle."""
    along = plane.swapaxes(0, axis)
    count = len(along) - SIDE + 1
    total = np.zeros_like(along[:count])
    for away in range(1, SIDE // 2 + 1):
        after, before = SIDE // 2 + away, SIDE // 2 - away
        total += np.float32(away) * (along[after : after + count] - along[before : before + count])
    return total.swapaxes(0, axis)
