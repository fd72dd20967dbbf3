# SPDX-License-Identifier: GPL-3.0-or-later
"""Whom the paper's experiments compare: sample values by their names, as render settings."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from bench.cache import CACHE
from bench.jobs import AUTOMATIC, TABULATED, TILES, Settings
from generator import Tile, make_tile, save_tile
from generator.joint_scanning import scan_jointly

#: The side of the paper's tile, "a 32 x 32 pattern of samples" (section 7).
SIZE = 32

#: Of the spectral tiles that the extension ships, the one that is made for what a scene uses.
SHIPPED = "SPECTRAL"


@dataclass(frozen=True)
class Sampler:
    """Where a render's sample values come from.

    Attributes
    ----------
    name : str
        What tables and captions call it.
    engine, tile : str
        As in `bench.jobs.Settings`.
    """

    name: str
    engine: str
    tile: str = Settings.tile

    def settings(self, base: Settings) -> Settings:
        """Return how to render with it."""
        return replace(base, engine=self.engine, tile=self.tile)


#: Tabulated Sobol scrambles every pixel by its own hash, so that one sample a pixel is as random as samples get.
RANDOM = Sampler("random values", TABULATED)
CYCLES = Sampler("Cycles' blue noise", AUTOMATIC)
SHIPPED_TILE = Sampler("shipped tile", TILES, SHIPPED)
OURS = Sampler("Spectral Tiles", TILES)


def scanning(dims: Sequence[str]) -> Sampler:
    """Return the paper's scanning tile for some dimensions, group by group (sections 6 and 7)."""
    if tuple(dims) == ("t",):
        return Sampler("scanning tile", TILES, "MITCHELL_SCANNING_32")
    return _made("scanning", "scanning tile", dims)


def white(dims: Sequence[str]) -> Sampler:
    """Return random values that take the way of a tile, which should make no difference."""
    return _made("white", "white tile", dims)


def joint(dims: Sequence[str]) -> Sampler:
    """Return a scanning tile with a good joint distribution alone (section 8)."""
    everything = tuple(range(len(dims)))

    def make() -> Tile:
        sieves = [(0, everything), (1, everything)]
        values = scan_jointly(SIZE, tuple(dims), 1, np.random.default_rng(1), sieves)
        return Tile(tuple(dims), values.astype(np.float32), {"method": "joint scanning only", "seed": 1})

    return Sampler("joint only", TILES, _tile_file("joint", dims, make))


def joint_and_marginal(dims: Sequence[str]) -> Sampler:
    """Return the scanning tile of section 8, good jointly and in each group."""
    return _made("joint-scanning", "joint and marginal", dims)


def _made(method: str, name: str, dims: Sequence[str]) -> Sampler:
    return Sampler(name, TILES, _tile_file(method, dims, lambda: make_tile(method, SIZE, tuple(dims), seed=1)))


def _tile_file(method: str, dims: Sequence[str], make) -> str:
    """Return the path of a tile in the cache, made if it is missing."""
    path: Path = CACHE / "tiles" / f"{method}-{SIZE}-{'-'.join(dims)}.npz"
    if not path.is_file():
        path.parent.mkdir(parents=True, exist_ok=True)
        save_tile(make(), path)
    return str(path)
