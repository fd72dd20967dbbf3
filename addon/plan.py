# SPDX-License-Identifier: GPL-3.0-or-later
"""The sample plan: which film pixel each render pixel serves.

Cycles' numbers at a render pixel are known before the render (`addon.cycles_random`).  A plan sends each of them to
the film pixel whose cell of the tile wants numbers like these; the lens, which our camera can set to anything, then
gets exactly the tile's value.
"""

import collections
import concurrent.futures
import itertools
import threading
from dataclasses import dataclass

import numpy as np

from . import cycles_random, openimageio
from .matching import match

# Matching works in windows of about this many pixels a side: larger ones match better, smaller ones keep rays that
# Cycles traces together close together on the film.
WINDOW = 256

# Plans kept for the next frames and renders of this process: 4 to 12 bytes a pixel each.
_CACHED_PLANS = 4
_cache = collections.OrderedDict()
_cache_lock = threading.Lock()


@dataclass(frozen=True)
class Plan:
    """Film pixel, and lens shift, of every render pixel of a region.

    Attributes
    ----------
    width : int
        Of the region, in pixels.
    film : int32 array, shape (pixels,)
        `film[p]` is the film pixel that render pixel p serves, both counted row by row from the region's lower left.
    lens_shift : float32 array, shape (pixels, 2), or None
        What to add, modulo 1, to Cycles' lens numbers at each render pixel.
    errors : dict of str to float
        Mean distance, per dimension, between what the tile wants and what Cycles will draw.
    """

    width: int
    film: np.ndarray
    lens_shift: np.ndarray | None
    errors: dict

    def write(self, path):
        """Write the image that `camera.osl` reads: film column and row as 16-bit integers, then the lens shift."""
        image = np.zeros((self.film.size // self.width, self.width, 4), np.uint16)
        image[..., 0] = (self.film % self.width).reshape(image.shape[:2])
        image[..., 1] = (self.film // self.width).reshape(image.shape[:2])
        if self.lens_shift is not None:
            # A shift by 1 may come out as 65535 / 65535; modulo 1 that is the same as none.
            image[..., 2:] = np.rint(65535.0 * self.lens_shift).reshape(*image.shape[:2], 2)
        oiio = openimageio.load()
        spec = oiio.ImageSpec(self.width, image.shape[0], 4, "uint16")
        spec.attribute("compression", "none")
        output = oiio.ImageOutput.create(path)
        if not (output and output.open(path, spec) and output.write_image(image) and output.close()):
            raise OSError(f"Cannot write the sample plan to {path}: {output.geterror() if output else oiio.geterror()}")


def for_tile(tile, dims, region, samples, seed):
    """Plan that follows a tile in some of its dimensions; remembered, so asking again costs nothing.

    Parameters
    ----------
    tile : generator.Tile
    dims : tuple of str
        The tile's dimensions that the scene uses.
    region : addon.region.Region
    samples : int
        Samples a pixel, one Cycles render.
    seed : int
        Cycles' seed; also moves the tile.

    Returns
    -------
    Plan
    """
    key = (tile.digest, dims, region, samples, seed)
    with _cache_lock:
        if key in _cache:
            _cache.move_to_end(key)
            return _cache[key]
    plan = _match_tile(tile, dims, region, samples, seed)
    with _cache_lock:
        _cache[key] = plan
        while len(_cache) > _CACHED_PLANS:
            _cache.popitem(last=False)
    return plan


def forget_all():
    """Drop all remembered plans."""
    with _cache_lock:
        _cache.clear()


def _windows(region):
    """The region cut into windows of nearly equal size: pairs of slices (rows, columns)."""

    def cuts(length):
        edges = np.linspace(0, length, max(1, round(length / WINDOW)) + 1).astype(int).tolist()
        return [slice(start, end) for start, end in itertools.pairwise(edges)]

    return itertools.product(cuts(region.size[1]), cuts(region.size[0]))


def _match_tile(tile, dims, region, samples, seed):
    lens = [name for name in dims if name.startswith("lens.")]
    matched = [name for name in dims if name not in lens and name in cycles_random.DIMENSIONS]
    width, height = region.size
    film = np.empty((height, width), np.int32)
    lens_shift = np.empty((height, width, 2), np.float32) if lens else None
    errors = np.zeros(len(matched))
    origin = np.random.default_rng(seed).integers(0, tile.size, 2)

    def fill(window):
        rows, columns = window
        y, x = np.mgrid[rows, columns]
        targets = tile.values[(y + origin[0]) % tile.size, (x + origin[1]) % tile.size, 0]
        ranks = cycles_random.pixel_ranks(x + region.corner[0], y + region.corner[1], seed)
        first = ranks * np.uint32(samples)
        values = _pixel_means(first, samples, matched)
        wanted = targets[..., [tile.dims.index(name) for name in matched]].reshape(-1, len(matched))
        served = match(values, wanted) if matched else np.arange(y.size)
        film[window] = (y * width + x).ravel()[served].reshape(y.shape)
        if lens:
            drawn = cycles_random.sequence_values(first.ravel(), lens)
            aim = targets[..., [tile.dims.index(name) for name in lens]].reshape(-1, 2)[served]
            lens_shift[window] = np.mod(aim - drawn, 1.0).reshape(*y.shape, 2)
        return np.abs(values - wanted[served]).sum(axis=0)

    with concurrent.futures.ThreadPoolExecutor() as threads:
        for error in threads.map(fill, _windows(region)):
            errors += error
    means = errors / (width * height)
    return Plan(
        width,
        film.ravel(),
        None if lens_shift is None else lens_shift.reshape(-1, 2),
        dict(zip(matched, means.tolist(), strict=True)),
    )


def _pixel_means(first, samples, dims):
    """What a pixel's samples have in common, spread evenly over [0, 1): (pixels, len(dims)).

    For one sample these are the values themselves.  Several are stratified among themselves, so they differ from the
    other pixels' by their mean, which lies in a narrow range; its rank is what the tile's value is compared with.
    """
    index = first.ravel()
    if samples == 1:
        return cycles_random.sequence_values(index, dims)
    total = sum(cycles_random.sequence_values(index + np.uint32(k), dims) for k in range(samples))
    ranks = np.empty_like(total)
    np.put_along_axis(ranks, np.argsort(total, axis=0), (np.arange(len(total))[:, None] + 0.5) / len(total), axis=0)
    return ranks
