# SPDX-License-Identifier: GPL-3.0-or-later
"""The sample plan: which film pixel each render pixel serves.

Cycles' numbers at a render pixel are known before the render (`cycles.random_numbers`), and our camera can point any
render pixel at any film pixel.  `arranged_plan` and `pattern_plan` make plans; this module holds what they make.
"""

import collections
import threading
import time
from dataclasses import dataclass, field, replace

import numpy as np

from ..blender.region import bands
from ..cycles import random_numbers

# Plans kept for the next frames and renders of this process, 4 bytes a pixel each or, with a tile's lens, 12: those of
# two groups of frames (`arranged_plan.GROUP`).
_REMEMBERED = 8

# Seconds a pixel to make a plan, until this process has made one (`python -m bench times`, two cores).
_PACE = 0.6e-6

# A region of more pixels than this has samples enough to be moved about for every seed and frame: its plan is made
# once.  A smaller one is soon made, and would show the same few samples again and again.
LARGE = 256 * 256

# Samples of a pixel that a plan looks at: what more of them leave is hardly seen, and would take minutes to weigh.
MOST_PLANNED = 64


@dataclass(frozen=True)
class Plan:
    """Film pixel, and lens shift, of every render pixel of a region.

    Attributes
    ----------
    seed : int
        The Cycles seed that the plan was made for, in [0, 2**32).
    width : int
        Of the region, in pixels.
    film : int32 array, shape (pixels,)
        `film[p]` is the film pixel that render pixel p serves, both counted row by row from the region's lower left.
    lens_shift : float32 array, shape (pixels, 2), or None
        What to add, modulo 1, to Cycles' lens numbers at each render pixel.
    errors : dict of str to float
        Mean distance, per dimension, between what a tile wants and what Cycles will draw.
    """

    seed: int
    width: int
    film: np.ndarray
    lens_shift: np.ndarray | None = None
    errors: dict = field(default_factory=dict)

    @classmethod
    def in_place(cls, seed, region):
        """The plan in which each render pixel of a region (Region) serves the film pixel where it is."""
        return cls(seed, region.size[0], np.arange(region.pixels, dtype=np.int32))

    @property
    def miss(self):
        """The errors in words, such as "t 0.012, light.u 0.031"; empty if there are none."""
        return ", ".join(f"{name} {error:.3f}" for name, error in self.errors.items())

    def moved(self, right, up):
        """The same plan on a film that is shifted by whole pixels, around the region's edges."""
        row, column = np.divmod(self.film, np.int32(self.width))
        row += np.int32(up)
        row %= np.int32(self.film.size // self.width)
        column += np.int32(right)
        column %= np.int32(self.width)
        row *= np.int32(self.width)
        row += column
        return replace(self, film=row)

    def at_film(self, region):
        """What Cycles draws at each film pixel.

        Parameters
        ----------
        region : addon.region.Region

        Returns
        -------
        ranks : uint32 array, shape (height, width)
            Of `random_numbers.pixel_ranks`.
        lens_shift : dict of str to uint8 array, shape (height, width)
            What our camera adds to the lens numbers, in 256ths; empty if nothing.
        """
        x, y = (np.arange(size) + corner for size, corner in zip(region.size, region.corner, strict=True))
        shape = len(y), len(x)
        ranks = np.empty(self.film.size, np.uint32)
        for band in bands(len(y)):
            served = self.film[band.start * self.width : band.stop * self.width]
            ranks[served] = random_numbers.pixel_ranks(x[None, :], y[band, None], self.seed).ravel()
        shifts = {} if self.lens_shift is None else dict(zip(("lens.u", "lens.v"), self.lens_shift.T, strict=True))
        moved = {name: scattered((256.0 * shift).astype(np.uint8), self.film) for name, shift in shifts.items()}
        return ranks.reshape(shape), {name: shift.reshape(shape) for name, shift in moved.items()}


def scattered(pixels, film):
    """Pixels moved to the film positions they serve: `moved[film[p]] = pixels[p]`."""
    pixels = np.ascontiguousarray(pixels)
    moved = np.empty_like(pixels)
    # Each as a whole: channel by channel it takes up to four times as long.
    whole = f"V{pixels[:1].nbytes}"
    moved.view(whole)[film] = pixels.view(whole)
    return moved


class Memory:
    """The last few plans, by what they were made from.  Several threads may ask.

    Attributes
    ----------
    pace : float
        Seconds that the last plan of a large region took, a pixel.
    """

    def __init__(self):
        self.pace = _PACE
        self._plans = collections.OrderedDict()
        self._lock = threading.Lock()

    def get(self, key, make):
        """The plan remembered under `key`, or else `make()`, which is then remembered."""
        with self._lock:
            if key in self._plans:
                self._plans.move_to_end(key)
                return self._plans[key]
        start = time.perf_counter()
        plan = make()
        pixels = plan.film.size
        with self._lock:
            if pixels > LARGE:
                self.pace = (time.perf_counter() - start) / pixels
            self._plans[key] = plan
            if len(self._plans) > _REMEMBERED:
                self._plans.popitem(last=False)
        return plan

    def latest(self):
        """The plan that was asked for last, or None."""
        with self._lock:
            return next(reversed(self._plans.values()), None)

    def clear(self):
        with self._lock:
            self._plans.clear()


memory = Memory()
