"""Each simple design has its defining property."""

import numpy as np

from generator import make_tile
from generator.jittered import jittered_grid
from generator.scanning import neighbour_offsets
from generator.step_test import relative_error


def test_jitter_puts_one_point_in_every_block():
    points = jittered_grid((4, 3, 2), np.random.default_rng(0))
    blocks = {tuple(block) for block in (points * (4, 3, 2)).astype(int)}
    assert len(blocks) == len(points) == 24


def test_stratified_fills_every_stratum_and_every_cell_once():
    tile = make_tile("stratified", 8, ("t", "lens.u", "lens.v"), seed=1, samples=4)
    t, u, v = tile.values.reshape(-1, 3).astype(np.float64).T
    assert np.array_equal(np.sort((t * 256).astype(int)), np.arange(256))
    assert np.array_equal(np.sort((u * 16).astype(int) * 16 + (v * 16).astype(int)), np.arange(256))


def test_figure_7_has_8_primary_and_16_secondary_cells():
    primary, secondary = neighbour_offsets()
    assert len(primary) == 8 and len(secondary) == 16
    assert np.abs(primary).max() == 1 and np.all(np.abs(secondary).max(axis=1) == 2)


def test_scanning_reproduces_the_papers_spectra():
    """Section 7: time errors at most 0.55 of white noise under sigma = 1, lens errors clearly better than white."""
    tile = make_tile("scanning", 32, ("t", "lens.u", "lens.v"), seed=1)
    assert relative_error(tile.columns("t"), (1.0,))[0] < 0.55
    assert relative_error(tile.columns("lens.u", "lens.v"), (1.0,))[0] < 0.65


def test_scanned_tiles_join_seamlessly():
    """Neighbours across the tile's border differ in t as much as neighbours inside it."""
    t = make_tile("scanning", 32, ("t",), seed=2).values[:, :, 0, 0]
    for axis in (0, 1):
        difference = np.abs(t - np.roll(t, 1, axis=axis))
        distance = np.minimum(difference, 1 - difference)
        seam = np.take(distance, 0, axis=axis)
        assert abs(seam.mean() - distance.mean()) < 4 * distance.std() / np.sqrt(32)
