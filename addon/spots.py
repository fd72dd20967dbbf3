# SPDX-License-Identifier: GPL-3.0-or-later
"""Few pixels that take many samples each, rendered at the cost of their samples.

Cycles takes the same number of samples at every render pixel, and asks our camera even for those that it is to leave
out, which costs a tenth of a cheap sample.  Four render pixels that make an aligned square draw a block of its sequence
together.  So if the pixels are few each is served by such a square, and Cycles takes a quarter of the samples a pixel.

Squares and the pixels that they serve follow each other along Cycles' own curve, so that neighbours on the film have
blocks that complement each other.
"""

from typing import NamedTuple

import numpy as np

from . import cycles_random
from .plan import Plan


class Spots(NamedTuple):
    """Render pixels that serve some film pixels, several each.

    Attributes
    ----------
    plan : Plan
        Its film is -1 where a render pixel serves none.
    samples : int
        Of each render pixel.
    film : integer array, shape (count,)
        The film pixels.
    servants : integer array, shape (servants, count)
        The render pixels that serve each.
    ranks : uint32 array, shape (count,)
        Which block of the sequence each film pixel has, among blocks of all its samples.
    """

    plan: Plan
    samples: int
    film: np.ndarray
    servants: np.ndarray
    ranks: np.ndarray


def make(taken, region, samples, seed, squares=True):
    """Choose who serves which pixel.

    Parameters
    ----------
    taken : bool array, shape (height, width)
        The film pixels that are to be served.
    region : addon.region.Region
    samples : int
        Samples of each, a multiple of 4.
    seed : int
        Cycles'.
    squares : bool
        Whether squares may serve, if there are enough of them; else it is single render pixels.

    Returns
    -------
    Spots
    """
    width = region.size[0]
    left, bottom = region.corner
    rows, columns = np.nonzero(taken)
    order = np.argsort(cycles_random.z_order(columns + left, rows + bottom), kind="stable")
    film = (rows * width + columns)[order]
    for side in (2, 1) if squares else (1,):
        x, y = _squares(side, region)
        if x.size >= film.size:
            break
    x, y = x[: film.size], y[: film.size]
    servants = np.stack([(y - bottom + up) * width + x - left + right for up in range(side) for right in range(side)])
    served = np.full(region.pixels, -1, np.int32)
    served[servants] = film
    ranks = cycles_random.pixel_ranks(x, y, seed) // np.uint32(side * side)
    return Spots(Plan(seed, width, served), samples // (side * side), film, servants, ranks)


def _squares(side, region):
    """Lower left corners of the aligned squares in a region, along Cycles' curve."""
    x, y = (
        np.arange(-(-first // side) * side, first + length - side + 1, side)
        for first, length in zip(region.corner, region.size, strict=True)
    )
    x, y = (part.ravel() for part in np.meshgrid(x, y))
    order = np.argsort(cycles_random.z_order(x, y), kind="stable")
    return x[order], y[order]
