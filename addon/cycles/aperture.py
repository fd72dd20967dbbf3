# SPDX-License-Identifier: GPL-3.0-or-later
"""Lens numbers, as a picture depends on them.

Cycles maps its two lens numbers to a round lens by Shirley and Chiu's concentric map, without a tear.  To a lens with
blades it maps them triangle by triangle (`regular_polygon_sample()` of kernel/sample/mapping.h): numbers that are close
may lie far apart on the lens.  So where blades are, modes are waves in other numbers: those by which the concentric
map, its disk stretched into the polygon, would meet the same point.
"""

import functools
from dataclasses import replace

import numpy as np

# Strips of the concentric map's square in which numbers are spread evenly.
_STRIPS = 32

_BELOW_ONE = np.nextafter(np.float32(1), np.float32(0))


def dims(blades):
    """Names of the two lens numbers that a picture depends on, through a lens with so many blades (below 3: round)."""
    suffix = f"/{blades}" if blades >= 3 else ""
    return f"lens.u{suffix}", f"lens.v{suffix}"


def leading_bytes(names, draw):
    """Leading bytes of the numbers that a picture depends on.

    Parameters
    ----------
    names : iterable of str
        Dimensions of Cycles' numbers (`random_numbers.DIMENSIONS`), or of `dims`.
    draw : callable
        List of dimensions of Cycles' numbers -> dict of dimension to uint8 array: their leading bytes.

    Returns
    -------
    dict of str to uint8 array
    """
    blades = {name: int(name.partition("/")[2]) for name in names if "/" in name}
    own = set(names) - blades.keys()
    drawn = draw(sorted(own | {"lens.u", "lens.v"} if blades else own))
    found = {name: drawn[name] for name in own}
    for name, count in blades.items():
        found[name] = _as_if_round(count)[dims(count).index(name)][drawn["lens.u"], drawn["lens.v"]]
    return found


def fitted(tile, blades):
    """A tile, whose lens numbers are those of the concentric map, for a lens with so many blades.

    Parameters
    ----------
    tile : generator.Tile
    blades : int
        Below 3 for a round lens.

    Returns
    -------
    generator.Tile
        With the numbers by which Cycles meets the same points.
    """
    if blades < 3 or not {"lens.u", "lens.v"} <= set(tile.dims):
        return tile
    columns = [tile.dims.index(name) for name in ("lens.u", "lens.v")]
    a, b = np.moveaxis(2.0 * tile.values[..., columns].astype(float) - 1.0, -1, 0)
    # The concentric map's quarter, where in it, from -1 to 1, and how far out.
    is_wide = a * a > b * b
    outwards, across = np.where(is_wide, (a, b), (b, -a))
    radius = np.abs(outwards)
    quarter = np.where(is_wide, 0, 1) + np.where(outwards < 0.0, 2, 0)
    turns = (quarter + 0.5 * across / np.where(radius > 0.0, outwards, 1.0)) / 4.0
    # The polygon's triangle, where between its two corners, and Cycles' numbers for that.
    corner, along = np.divmod(blades * turns + 0.5, 1.0)
    s = 1.0 - radius * along
    v = radius * (1.0 - along) / np.where(s > 0.0, s, 1.0)
    values = tile.values.copy()
    values[..., columns] = np.minimum(np.stack([(corner % blades + s * s) / blades, v], axis=-1), _BELOW_ONE)
    return replace(tile, values=values)


@functools.lru_cache(maxsize=8)
def _as_if_round(blades):
    """For each pair of Cycles' leading bytes the pair that the concentric map would need: two uint8 (256, 256)."""
    u, v = np.meshgrid(*2 * [(np.arange(256) + 0.5) / 256], indexing="ij")
    # In a triangle: how far out, and where between its two corners, from -1 to 1.
    corner = np.floor(u * blades)
    s = np.sqrt(u * blades - corner)
    radius = 1.0 - s + v * s
    along = (1.0 - s - v * s) / radius
    # On the disk equal areas take equal angles; the concentric map goes by its four quarters.
    quarter, angle = np.divmod(4.0 / blades * (corner + 0.5 * along) + 0.5, 1.0)
    across = radius * (2.0 * angle - 1.0)
    quarter = quarter.astype(int) % 4
    a = np.choose(quarter, (radius, -across, -radius, across)).ravel()
    b = np.choose(quarter, (across, radius, -across, -radius)).ravel()
    # Modes must have mean zero.  So by ranks, since 256 x 256 points lie unevenly: all numbers are taken equally often,
    # in every strip.
    ties = np.random.default_rng(0).random(a.size)
    rank_a, rank_b = np.empty((2, a.size), int)
    rank_a[np.lexsort((ties, a.round(9)))] = np.arange(a.size)
    strip = rank_a * _STRIPS // a.size
    rank_b[np.lexsort((ties, b.round(9), strip))] = np.arange(a.size) * _STRIPS % a.size
    return tuple((rank // 256).astype(np.uint8).reshape(u.shape) for rank in (rank_a, rank_b))
