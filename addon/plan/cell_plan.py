# SPDX-License-Identifier: GPL-3.0-or-later
"""What the cells of a pattern sample that is followed to the letter.

All film pixels of one cell share their random numbers: one point of Cycles' sequence (`cycles.shared_sequence`) for
each sample.  The plan says which point each cell gets, and what time, lens point and film position go with it.
"""

from dataclasses import dataclass

import numpy as np

from ..cycles import shared_sequence
from .matching import match
from .pattern_plan import evenly_spread
from .sub_frame_plan import CellShot, by_time


@dataclass(frozen=True)
class CellPlan:
    """Samples of every cell.

    Attributes
    ----------
    seed, count : int
        What Cycles' seed and samples a pixel must be set to.
    offset : int array, shape (side, side, samples)
        Cycles' sample offset, by row (upwards) and column of the cell.
    t : float32 array, shape (side, side, samples)
    lens, film : float32 arrays, shape (side, side, samples, 2)
        Numbers in [0, 1).
    """

    seed: int
    count: int
    offset: np.ndarray
    t: np.ndarray
    lens: np.ndarray
    film: np.ndarray

    @property
    def side(self):
        """Period of the pattern, in pixels."""
        return len(self.offset)

    def groups(self, samples):
        """The shots of some samples (numbers) of every pixel: for each a list of `CellShot`, in the order of time."""
        found = []
        for sample in samples:
            times, points = self.t[:, :, sample], self.offset[:, :, sample]
            cells = by_time(times)
            found.append([CellShot(cell, int(points[cell]), 1, 2 * (float(times[cell]),), sample) for cell in cells])
        return found


def following(tile, dims, samples, seed):
    """The `CellPlan` that follows a tile in some of its dimensions, time and lens exactly.

    Parameters
    ----------
    tile : generator.Tile
    dims : tuple of str
        The tile's dimensions that the scene uses.
    samples : int
        Samples a pixel.
    seed : int
        Cycles' seed; also moves the tile.
    """
    origin = np.random.default_rng(seed).integers(0, tile.size, 2)
    wanted = np.roll(tile.values[:, :, 0], origin, axis=(0, 1)).reshape(tile.size**2, -1)
    exact = [name for name in ("t", "lens.u", "lens.v") if name in dims]
    matched = [name for name in dims if name in shared_sequence.DIMENSIONS and name not in exact]
    count = shared_sequence.length(tile.size**2 * samples)
    order = np.arange(tile.size**2)
    if matched:
        drawn = shared_sequence.values(matched, count, seed)[: tile.size**2 * samples]
        drawn = evenly_spread(drawn.reshape(tile.size**2, samples, len(matched)).sum(axis=1))
        order[match(drawn, wanted[:, [tile.dims.index(name) for name in matched]])] = np.arange(tile.size**2)
    # A block of points that follow each other in the sequence for each cell.
    offset = order.reshape(tile.size, tile.size, 1) * samples + np.arange(samples)
    numbers = shared_sequence.values(("t", "lens.u", "lens.v", "film.x", "film.y"), count, seed)[offset]
    # All samples of a pixel move alike, so that the first one gets the tile's numbers.
    for name in exact:
        column = numbers[..., ("t", "lens.u", "lens.v").index(name)]
        aim = wanted[:, tile.dims.index(name)].reshape(tile.size, tile.size, 1)
        column[...] = np.mod(column + (aim - column[..., :1]), 1.0)
    return CellPlan(seed, count, offset, numbers[..., 0], numbers[..., 1:3], np.ascontiguousarray(numbers[..., 3:]))
