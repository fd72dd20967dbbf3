# SPDX-License-Identifier: GPL-3.0-or-later
"""What the cells of a periodic pattern sample: the plan of the sub-render driver.

All film pixels of one cell share their random numbers: one point of Cycles' sequence (`addon.shared_sequence`) for
each sample.  The plan says which point each cell gets, and what time, lens point and film position go with it.
"""

import itertools
from dataclasses import dataclass

import numpy as np

from ..cycles import aperture, random_numbers, shared_sequence
from . import arranged_plan, modes
from .arrangement import ALIGNMENT, arrange
from .matching import match
from .pattern_plan import evenly_spread

# So many different samples at least, one sub-render each, make a picture: with 16 x 16 cells at one sample a pixel, or
# 4 x 4 at sixteen, time and lens are cut finely enough that no single one is seen.
_DIFFERENT = 256
_SIDES = (4, 8, 16)

# Samples of a cell that are looked at; what more of them leave is not seen, and takes seconds to weigh.
_WEIGHED = 256

# Modes of the error that are weighed.
_MODES = 24


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

    def drawn(self, region):
        """What Cycles draws at the pixels of a region (Region), as `control_variates.of_picture` takes it."""
        x, y = ((np.arange(size) + corner) % self.side for size, corner in zip(region.size, region.corner, strict=True))

        def found(pixels, chosen, samples, first):
            rows, columns = pixels
            points = self.offset[..., first : first + samples]
            cells = _leading_bytes(
                {name for mode in chosen for name, _ in mode},
                lambda dims: shared_sequence.values(dims, self.count, self.seed)[points],
            )
            return {name: np.moveaxis(values[y[rows], x[columns]], -1, 0) for name, values in cells.items()}

        return found


def side(samples):
    """Period of the pattern that `arranged` makes for that many samples a pixel, in pixels."""
    return next((side for side in _SIDES if side * side * samples >= _DIFFERENT), _SIDES[-1])


def arranged(use, samples, seed, frame=None):
    """Plan in which neighbouring cells complement each other in what the frame uses.

    Parameters
    ----------
    use : analysis.SceneUse
    samples : int
        Samples a pixel.
    seed : int
        Another seed gives another, equally good plan.
    frame : int, optional
        Of an animation whose pattern changes from frame to frame.

    Returns
    -------
    CellPlan
    """
    cells = side(samples) ** 2
    count = shared_sequence.length(cells * samples)
    shares = arranged_plan.shares(use)
    dims = {name for groups, _ in shares for name in itertools.chain(*groups)}
    group, first_seed, place = arranged_plan.place_in_group(seed, frame)
    order, error_modes, before = _curve(side(samples)), None, None
    for cycles_seed in range(first_seed, first_seed + place + 1):
        if shares:
            numbers = _leading_bytes(dims, lambda names, seed=cycles_seed: shared_sequence.values(names, count, seed))
            numbers = {
                name: values[: cells * samples].reshape(cells, samples)[:, :_WEIGHED].T
                for name, values in numbers.items()
            }
            error_modes = error_modes or modes.strongest(modes.variances(shares), numbers, _MODES)
            features = np.stack(list(modes.features(error_modes, numbers)), axis=-1)
            order = _placed(features, side(samples), before)
            before = (0.0 if before is None else before) + np.float32(arranged_plan.WEIGHT) * features[order]
    # Whatever the arrangement prefers somewhere, any cell may be there.
    moved = np.random.default_rng((seed, group % 2**32)).integers(0, side(samples), 2)
    return _plan(np.roll(order.reshape(side(samples), -1), moved, axis=(0, 1)), samples, cycles_seed, count)


def following(tile, dims, samples, seed):
    """Plan that follows a tile in some of its dimensions, time and lens exactly.

    Parameters
    ----------
    tile : generator.Tile
    dims : tuple of str
        The tile's dimensions that the scene uses.
    samples : int
        Samples a pixel.
    seed : int
        Cycles' seed; also moves the tile.

    Returns
    -------
    CellPlan
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
    plan = _plan(order.reshape(tile.size, tile.size), samples, seed, count)
    # All samples of a pixel move alike, so that the first one gets the tile's numbers.
    for name in exact:
        numbers = plan.t if name == "t" else plan.lens[..., ("lens.u", "lens.v").index(name)]
        aim = wanted[:, tile.dims.index(name)].reshape(tile.size, tile.size, 1)
        numbers[...] = np.mod(numbers + (aim - numbers[..., :1]), 1.0)
    return plan


def _plan(order, samples, seed, count):
    """The plan whose cells get those blocks of `samples` points of the sequence."""
    offset = order[..., None] * samples + np.arange(samples)
    numbers = shared_sequence.values(("t", "lens.u", "lens.v", "film.x", "film.y"), count, seed)[offset]
    return CellPlan(seed, count, offset, numbers[..., 0].copy(), numbers[..., 1:3].copy(), numbers[..., 3:].copy())


def _leading_bytes(names, draw):
    """Leading bytes by name; `draw` gives the numbers of a list of dimensions, (..., dimensions)."""

    def drawn(dims):
        values = (256.0 * draw(dims)).astype(np.uint8)
        return dict(zip(dims, np.moveaxis(values, -1, 0), strict=True))

    return aperture.leading_bytes(names, drawn)


def _curve(side):
    """Cycles' own order of the cells, rows and columns exchanged: a Z-curve, int array of shape (side * side,)."""
    y, x = np.divmod(np.arange(side * side), side)
    return random_numbers.z_order(y, x).astype(int)


def _placed(error_features, side, before):
    """Which block of points each cell gets: Cycles' own order, rearranged as `addon.arrangement` does it.

    Parameters
    ----------
    error_features : float32 array, shape (side * side, modes)
        Of the blocks, in the order of the sequence.
    side : int
    before : float32 array, shape (side * side, modes), or None
        Features of the cells in earlier pictures; the error is that of them all.

    Returns
    -------
    int array, shape (side * side,)
    """

    def repeated(cells):
        return np.tile(cells.reshape(side, side), (ALIGNMENT // side,) * 2)

    ranks = repeated(_curve(side)).astype(np.uint32)
    features = (repeated(feature) for feature in error_features[_curve(side)].T)
    seen = None if before is None else [repeated(feature) for feature in before.T]
    order = arrange(features, error_features.shape[1], ranks, np.ones(ranks.shape, bool), seen)
    # A period in the middle: those at the edge see nothing beyond it.
    middle = slice(ALIGNMENT // 2, ALIGNMENT // 2 + side)
    return ranks.ravel()[order[middle, middle]].astype(int).ravel()
