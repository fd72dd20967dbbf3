# SPDX-License-Identifier: GPL-3.0-or-later
"""Blocks of pixels, and what those around each say of the noise in it.

A pixel's own block has no say in what is subtracted from it, so that the expectation stays.
"""

import numpy as np

# Pixels a side of the blocks that share their coefficients, and to how many blocks each way a block listens.
SIDE = 8
REACH = 2

# How much it listens to each row and column of them; to itself it does not.
_NEARNESS = np.exp(-(np.arange(-REACH, REACH + 1) ** 2) / 2.88).astype(np.float32)

#: The number of blocks that have one say.
HEARD = float((_NEARNESS.sum() ** 2 - 1.0) ** 2 / (np.square(_NEARNESS).sum() ** 2 - 1.0))

_TINY = np.float32(1e-20)


def in_blocks(planes):
    """(..., height, width) as (rows, columns, ..., pixels); zeros fill the last blocks."""
    *others, height, width = planes.shape
    margin = [(0, 0)] * len(others) + [(0, -height % SIDE), (0, -width % SIDE)]
    if height % SIDE or width % SIDE:
        planes = np.pad(planes, margin)
    blocks = planes.reshape(*others, -(-height // SIDE), SIDE, -1, SIDE)
    blocks = np.moveaxis(blocks, (-4, -2), (0, 1))
    return blocks.reshape(*blocks.shape[:-2], SIDE**2)


def from_blocks(blocks, height, width):
    """The reverse of `in_blocks`: (..., height, width)."""
    rows, columns, *others, _ = blocks.shape
    planes = np.moveaxis(blocks.reshape(rows, columns, *others, SIDE, SIDE), (0, 1), (-4, -2))
    return planes.reshape(*others, rows * SIDE, columns * SIDE)[..., :height, :width]


def places(start, size):
    """Coordinates along one side of the pixels of `in_blocks`, (blocks, SIDE); the last one fills the last block."""
    return np.minimum(np.arange(start, start + size + -size % SIDE), start + size - 1).reshape(-1, SIDE)


def scores(noise, waves):
    """How the noise in the blocks around goes with modes.

    Parameters
    ----------
    noise : float32 array, shape (rows, columns, passes, pixels)
    waves : float32 array, shape (rows, columns, modes, pixels)
        With a mean of zero and a mean square of one, or sums of such.

    Returns
    -------
    score : float32 array, shape (rows, columns, passes, modes)
        Of modes that the noise does not go with, chance makes the mean square that of the wave.
    unit : float32 array, shape (rows, columns, passes)
        The coefficient of a mode of which the score is 1.
    """
    products = _around(noise @ waves.swapaxes(-1, -2), 1)
    squares = np.einsum("...p,...p->...", noise, noise)
    by_chance = np.sqrt(np.maximum(_around(squares, 2), 0.0))
    pixels = _around(np.full(noise.shape[:2], SIDE**2, np.float32), 1)
    # A picture of a single block has nobody to listen to, only what rounding leaves of itself.
    heard = by_chance > _TINY
    score = np.divide(products, by_chance[..., None], out=np.zeros_like(products), where=heard[..., None])
    pixels = np.where(pixels > 0.1, pixels, np.float32(np.inf))
    return score, by_chance / pixels[..., None]


def _around(sums, power):
    """Sums over the blocks around, without the own one, with a power of the weights: (rows, columns, ...)."""
    weights = _NEARNESS**power
    total = sums
    for axis in (0, 1):
        # Beyond the sides nobody says anything.
        along = total.swapaxes(0, axis)
        total = weights[REACH] * along
        for away in range(1, REACH + 1):
            total[away:] += weights[REACH + away] * along[:-away]
            total[:-away] += weights[REACH - away] * along[away:]
        total = total.swapaxes(0, axis)
    return total - sums
