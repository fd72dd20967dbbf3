# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures of a tile for the panel: its values, and the spectrum of the error that it leaves."""

import bpy.utils.previews
import numpy as np

from ..plan.patterns import generator

# Side of a picture in pixels; smaller tiles are repeated.
_SIDE = 128

_previews = None
_drawn = None


def icons(tile):
    """Draw a tile (generator.Tile); the last one drawn is remembered.

    Returns
    -------
    list of int
        Icons of the first dimension's values, and of the spectrum's mean over all dimensions: dark in the middle is
        an error without low frequencies.
    """
    global _drawn
    if _drawn is not tile:
        _previews.clear()
        for name, picture in (("values", values(tile)), ("spectrum", spectrum(tile))):
            preview = _previews.new(name)
            preview.image_size = (_SIDE, _SIDE)
            rgba = np.ones((_SIDE, _SIDE, 4), np.float32)
            rgba[..., :3] = picture[..., None]
            preview.image_pixels_float.foreach_set(rgba.ravel())
        _drawn = tile
    return [_previews[name].icon_id for name in ("values", "spectrum")]


def values(tile):
    """The first dimension as brightness, float32 (side, side), rows from the bottom."""
    pixel = np.arange(_SIDE) % tile.size
    return tile.values[np.ix_(pixel, pixel)][..., 0, 0]


def spectrum(tile):
    """Power of the error image of a half-period along each dimension, averaged; white noise is a half of white."""
    periodogram = generator.periodogram.mode_periodogram
    powers = [periodogram(tile.values[:, :, :1, [d]], (1,)).power for d in range(len(tile.dims))]
    mean = np.mean(powers, axis=0)
    # The picture's pixel stands for the nearest frequency of the tile.
    nearest = (np.arange(_SIDE) * tile.size) // _SIDE
    return np.clip(0.5 * mean[np.ix_(nearest, nearest)], 0.0, 1.0).astype(np.float32)


def register():
    global _previews
    _previews = bpy.utils.previews.new()


def unregister():
    global _previews, _drawn
    bpy.utils.previews.remove(_previews)
    _previews = _drawn = None
