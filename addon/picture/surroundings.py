# SPDX-License-Identifier: GPL-3.0-or-later
"""What the surroundings of each pixel say of its noise: how large it usually is, what colour it has, and how it is now.

A pixel at an edge belongs to one side, and only that side may speak for it.  So each pixel has four windows, with
itself at a corner of each, and the one that varies least is asked: of a straight edge at least one window sees nothing
(Kuwahara et al., "Processing of RI-angiocardiographic images" (1976)).  The pixel itself is left out, so that what is
said knows nothing of its own noise.
"""

import numpy as np

# Pixels a side of a window, and how many are asked.
SIDE = 5
_ASKED = np.float32(SIDE**2 - 1)

# A difference counts as at most this many times the usual one: a very bright sample must not speak for its whole block.
_OUTLIER = 4.0

# Noise below this part of the brightness is none, but what rounding leaves.
_ROUNDING = np.float32(1e-3)

# Brighter than this pixels are not told apart, so that no square overflows.
_BRIGHTEST = np.float32(1e15)

_TINY = np.float32(1e-30)

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
        The difference of red, green and blue together from the mean of the pixel's side, in units of `size`.
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
        self._window = np.zeros(shape, np.int32)
        if min(shape) >= SIDE:
            self._look()
        if judged is not None:
            self.size *= judged
            self.noise *= judged

    def _look(self):
        square = np.square(self._grey)
        sums, squares = _window_sums(self._grey), _window_sums(square)
        height, width = sums.shape
        places = np.arange(sums.size, dtype=np.int32).reshape(sums.shape)
        mean = np.zeros_like(self._grey)
        least = np.full_like(self._grey, np.inf)
        for y in (0, SIDE - 1):
            for x in (0, SIDE - 1):
                # The pixels that are this corner of a window.
                own = slice(y, y + height), slice(x, x + width)
                there = sums - self._grey[own]
                there /= _ASKED
                variance = squares - square[own]
                variance /= _ASKED
                variance -= np.square(there)
                less = variance < least[own]
                np.copyto(least[own], variance, where=less)
                np.copyto(mean[own], there, where=less)
                np.copyto(self._window[own], places, where=less)
        least[least <= np.square(_ROUNDING * mean)] = 0.0
        np.sqrt(least, out=self.size)
        np.divide(self._grey - mean, self.size, out=self.noise, where=self.size > 0.0)
        np.clip(self.noise, -_OUTLIER, _OUTLIER, out=self.noise)

    def coloured(self, noise):
        """Noise in units of `size`, (height, width), as red, green and blue of the colour of each pixel's side."""
        if min(noise.shape) < SIDE:
            return np.zeros_like(self._colour)
        sums = [_window_sums(part).take(self._window) - part for part in self._colour]
        colours = np.maximum(np.stack(sums), np.float32(0))
        amount = noise * self.size
        amount *= np.float32(3)
        amount /= np.maximum(colours[0] + colours[1] + colours[2], _TINY)
        colours *= amount
        return colours


def _window_sums(plane):
    """Sums over all windows that are inside: (height - SIDE + 1, width - SIDE + 1)."""
    count = len(plane) - SIDE + 1
    rows = plane[:count] + plane[1 : 1 + count]
    for shift in range(2, SIDE):
        rows += plane[shift : shift + count]
    count = plane.shape[1] - SIDE + 1
    total = rows[:, :count] + rows[:, 1 : 1 + count]
    for shift in range(2, SIDE):
        total += rows[:, shift : shift + count]
    return total
