# SPDX-License-Identifier: GPL-3.0-or-later
"""The sample plan: which film pixel each render pixel serves.

Cycles' numbers at a render pixel are known before the render (`cycles.random_numbers`), and our camera can point any
render pixel at any film pixel.  `arranged_plan` and `pattern_plan` make plans; this module holds what they make.
"""

from dataclasses import dataclass, field, replace

import numpy as np

# A region of more pixels than this has samples enough to be moved about for every seed and frame: its plan is made
# once.  A smaller one is soon made, and would show the same few samples again and again.
_LARGE = 256 * 256

# The last few plans, 4 bytes a pixel each or, with a tile's lens, 12, by what they were made from; and how many.
_plans = {}
_REMEMBERED = 4

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


def scattered(pixels, film):
    """Pixels moved to the film positions they serve: `moved[film[p]] = pixels[p]`."""
    pixels = np.ascontiguousarray(pixels)
    moved = np.empty_like(pixels)
    # Each as a whole: channel by channel it takes up to four times as long.
    whole = f"V{pixels[:1].nbytes}"
    moved.view(whole)[film] = pixels.view(whole)
    return moved


def remembered(key, region, seed, make):
    """A plan that is not made again for the next view layer, frame or render of this process.

    Parameters
    ----------
    key : tuple
        What it is made from beside region and seed.
    region : Region
        A large one's plan is made for one seed only, and moved about for others.
    seed : int
        Another seed gives another, equally good plan.
    make : callable
        Seed -> Plan.
    """
    own_seed = 0 if region.pixels > _LARGE else seed
    key = (*key, region, own_seed)
    plan = _plans.pop(key, None) or make(own_seed)
    _plans[key] = plan
    if len(_plans) > _REMEMBERED:
        del _plans[next(iter(_plans))]
    # Where nothing is beyond, samples find other places than in the middle; so any place may be there.
    return plan.moved(*np.random.default_rng(seed).integers(0, region.size))
