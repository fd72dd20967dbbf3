# SPDX-License-Identifier: GPL-3.0-or-later
"""Plans that follow a tile.

Each of Cycles' samples goes to the film pixel whose cell of the tile wants numbers like its own; the lens, which our
camera can set to anything, then gets exactly the tile's value.
"""

import concurrent.futures

import numpy as np

from ..blender.refusal import Cancelled
from ..cycles import random_numbers
from .matching import match
from .sample_plan import MOST_PLANNED, Plan, remembered

# Larger windows match better, smaller ones keep rays that Cycles traces together close together on the film.
_WINDOW = 256


def make(tile, dims, region, samples, seed, is_cancelled=lambda: False):
    """Plan that follows a tile in some of its dimensions; remembered as of `sample_plan.remembered`.

    Parameters
    ----------
    tile : generator.Tile
    dims : tuple of str
        The tile's dimensions that the scene uses.
    region : Region
    samples : int
        Samples a pixel to match.
    seed : int
        Another seed gives another plan of the same quality.
    is_cancelled : callable, optional
        As of `arranged_plan.make`.

    Returns
    -------
    Plan

    Raises
    ------
    Cancelled
    """
    key = tile.values.tobytes(), tile.dims, dims, samples
    return remembered(key, region, seed, lambda own_seed: _match(tile, dims, region, samples, own_seed, is_cancelled))


def _match(tile, dims, region, samples, seed, is_cancelled):
    lens = [name for name in dims if name.startswith("lens.")]
    matched = [name for name in dims if name in random_numbers.DIMENSIONS and name not in lens]
    width, height = region.size
    film = np.empty((height, width), np.int32)
    lens_shift = np.empty((height, width, 2), np.float32) if len(lens) == 2 else None
    origin = np.random.default_rng(seed).integers(0, tile.size, 2)

    def fill(window):
        if is_cancelled():
            raise Cancelled
        y, x = np.mgrid[window]
        cells = tile.values[(y + origin[0]) % tile.size, (x + origin[1]) % tile.size, 0].reshape(y.size, -1)
        wanted = cells[:, [tile.dims.index(name) for name in matched]]
        ranks = random_numbers.pixel_ranks(x + region.corner[0], y + region.corner[1], seed).ravel()
        drawn = _pixel_means(ranks * np.uint32(samples), min(samples, MOST_PLANNED), matched)
        served = match(drawn, wanted) if matched else np.arange(y.size)
        film[window] = (y * width + x).ravel()[served].reshape(y.shape)
        if lens_shift is not None:
            # Cycles moves all samples of a pixel alike, so the first one's number is made the tile's.
            aim = cells[:, [tile.dims.index(name) for name in lens]][served]
            drawn_lens = random_numbers.sequence_values(ranks * np.uint32(samples), lens)
            lens_shift[window] = np.mod(aim - drawn_lens, 1.0).reshape(*y.shape, 2)
        return np.abs(drawn - wanted[served]).sum(axis=0)

    with concurrent.futures.ThreadPoolExecutor() as threads:
        errors = sum(threads.map(fill, region.windows(_WINDOW))) / region.pixels
    return Plan(
        seed,
        width,
        film.ravel(),
        None if lens_shift is None else lens_shift.reshape(-1, 2),
        dict(zip(matched, errors.tolist(), strict=True)),
    )


def _pixel_means(first, samples, dims):
    """What a pixel's samples have in common, spread evenly over [0, 1): (pixels, len(dims)).

    For one sample these are the values themselves.  Several are stratified among themselves, so pixels differ by their
    mean, which lies in a narrow range; its rank is what the tile's value is compared with.
    """
    if samples == 1:
        return random_numbers.sequence_values(first, dims)
    return evenly_spread(sum(random_numbers.sequence_values(first + np.uint32(k), dims) for k in range(samples)))


def evenly_spread(sums):
    """Ranks of sums, each column by itself, as numbers in [0, 1): (pixels, dims)."""
    even = (np.arange(len(sums), dtype=np.float32) + 0.5) / len(sums)
    ranks = np.empty_like(sums)
    np.put_along_axis(ranks, np.argsort(sums, axis=0), even[:, None], axis=0)
    return ranks
