# SPDX-License-Identifier: GPL-3.0-or-later
"""``python -m bench cycles-tile``: Cycles' own blue noise as a tile, for the generator's tables to judge."""

import numpy as np

from addon.cycles.random_numbers import pixel_ranks, sequence_values
from generator import Tile, save_tile


def cycles_tile(size, dims, samples, seed):
    """Return what Cycles draws in the lower left corner of a frame.

    Parameters
    ----------
    size : int
        Side of the tile in pixels. Unlike a tile of ours, Cycles' pattern does not wrap around.
    dims : sequence of str
        Dimensions that a tile and `addon.cycles.random_numbers` know.
    samples : int
        Samples a pixel.
    seed : int
        The scene's Cycles seed.

    Raises
    ------
    ValueError
        If a dimension is unknown.
    """
    y, x = np.mgrid[0:size, 0:size]
    index = pixel_ranks(x, y, seed)[:, :, None] * np.uint32(samples) + np.arange(samples, dtype=np.uint32)
    parameters = {"size": size, "samples": samples}
    metadata = {"method": "Cycles 5.2 blue noise", "parameters": parameters, "seed": seed}
    return Tile(dims, sequence_values(index, dims), metadata)


def write(path, size, dims, samples, seed):
    """Write `cycles_tile` to a file and return a line that says so.

    Raises
    ------
    ValueError
        If a dimension is unknown, or the file's name does not end in ``.npz`` or ``.exr``.
    """
    save_tile(cycles_tile(size, dims, samples, seed), path)
    return f"{path}: {size} x {size} pixels of Cycles' blue noise, {samples} sample(s) a pixel"
