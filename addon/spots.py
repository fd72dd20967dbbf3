# SPDX-License-Identifier: GPL-3.0-or-later
"""Few pixels that take many samples each, rendered at the cost of their samples.

Cycles takes the same number of samples at every render pixel, and asks our camera even for those that it is to leave
out, which costs a tenth of a cheap sample.  But two or four render pixels of one aligned square draw a block of its
sequence together.  So as many serve each pixel that wants more, and render pixels take no more samples than before;
nor could they take fewer, since a running Cycles heeds a change of its samples a pixel only if there are more
(`Session::update_scene`).

Squares and the pixels that they serve follow each other along Cycles' own curve, so that neighbours on the film have
blocks that complement each other.  Squares lie in a few rows, and no others are rendered.
"""

from typing import NamedTuple

import numpy as np

from . import automatic, cycles_random
from .plan import Plan


class Spots(NamedTuple):
    """Render pixels that serve some film pixels, several each.

    Attributes
    ----------
    plan : Plan
        Its film is -1 where a render pixel serves none.
    film : integer array, shape (count,)
        The film pixels.
    servants : integer array, shape (servants, count)
        The render pixels that serve each.
    ranks : uint32 array, shape (count,)
        Which block of the sequence each film pixel has, among blocks of all its samples.
    rows : int
        The render pixels lie in so many rows at the bottom of the region.
    """

    plan: Plan
    film: np.ndarray
    servants: np.ndarray
    ranks: np.ndarray
    rows: int


def make(taken, region, servants, seed):
    """Choose who serves which pixel.

    Parameters
    ----------
    taken : bool array, shape (height, width)
        The film pixels that are to be served.
    region : addon.region.Region
    servants : int
        Of each film pixel, 2 or 4.
    seed : int
        Cycles' for the first render; further ones have those that follow.

    Returns
    -------
    list of Spots
        One for each render, as many as it takes.
    """
    width = region.size[0]
    left, bottom = region.corner
    y, x = np.nonzero(taken)
    film = (y * width + x)[np.argsort(cycles_random.z_order(x + left, y + bottom))]
    if not film.size:
        return []
    columns, rows = _corners(region)
    capacity = 4 * columns.size * rows.size // servants
    found = []
    for first in range(0, film.size, capacity):
        own = film[first : first + capacity]
        x, y = _squares(region, own.size * servants)
        own_seed = (seed + len(found)) % 2**31
        ranks = cycles_random.pixel_ranks(x, y, own_seed)
        # Blocks of a square follow each other, and so do those of its halves.
        order = np.argsort(ranks, axis=0)
        pixels = np.take_along_axis((y - bottom) * width + x - left, order, axis=0)
        blocks = np.take_along_axis(ranks, order, axis=0)[::servants].T.ravel() // np.uint32(servants)
        serving = pixels.reshape(-1, servants, x.shape[1]).transpose(1, 2, 0).reshape(servants, -1)[:, : own.size]
        served = np.full(region.pixels, -1, np.int32)
        served[serving] = own
        height = int(y.max()) + 1 - bottom
        found.append(Spots(Plan(own_seed, width, served), own, serving, blocks[: own.size], height))
    return found


def drawn(found, shape):
    """What Cycles draws at pixels that spots serve, as `control_variates.of_picture` takes it.

    Parameters
    ----------
    found : sequence of Spots
    shape : (int, int)
        Height and width of the picture.

    Returns
    -------
    callable
    """
    blocks = np.zeros(shape, np.uint32)
    for some in found:
        blocks.ravel()[some.film] = some.ranks
    return lambda pixels, chosen, samples, first: automatic.numbers(chosen, blocks[pixels], samples, samples, first)


def fit(region):
    """Whether a region is large enough for any."""
    return all(part.size for part in _corners(region))


def _corners(region):
    """Columns and rows in which the aligned squares of four pixels in a region begin."""
    return [
        np.arange(first + first % 2, first + length - 1, 2)
        for first, length in zip(region.corner, region.size, strict=True)
    ]


def _squares(region, pixels):
    """Coordinates x, y of the squares in as few rows as have so many pixels, along Cycles' curve: (4, count) each."""
    columns, rows = _corners(region)
    rows = rows[: -(-pixels // (4 * columns.size))]
    x, y = (part.ravel() for part in np.meshgrid(columns, rows))
    order = np.argsort(cycles_random.z_order(x, y))
    return x[order] + np.array([[0], [1], [0], [1]]), y[order] + np.array([[0], [0], [1], [1]])
