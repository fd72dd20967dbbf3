# SPDX-License-Identifier: GPL-3.0-or-later
"""Lens numbers as a picture depends on them: the same areas as Cycles', without its tears."""

from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip("bpy")

import generator
from addon.cycles import aperture, exposure

BLADES = (3, 4, 5, 6, 8, 11)
MIDDLES = np.stack(np.meshgrid(*2 * [(np.arange(256) + 0.5) / 256], indexing="ij"), axis=-1)


def as_if_round(blades):
    """The numbers of all pairs of leading bytes, (256, 256, 2)."""
    names = aperture.dims(blades)
    u, v = np.indices((256, 256)).astype(np.uint8)
    found = aperture.leading_bytes(names, lambda dims: {"lens.u": u, "lens.v": v})
    return np.stack([found[name] for name in names], axis=-1)


def points(numbers, blades):
    return exposure.lens_points(
        numbers, SimpleNamespace(aperture_blades=blades, aperture_rotation=0.0, aperture_ratio=1.0)
    )


def test_round_lens_has_cycles_own_numbers():
    assert aperture.dims(0) == ("lens.u", "lens.v")
    drawn = {"t": np.uint8(3), "lens.u": np.uint8(7)}
    assert aperture.leading_bytes(["lens.u", "t"], lambda dims: drawn) == drawn
    tile = generator.Tile(("lens.u", "lens.v"), MIDDLES[:, :, None], {"method": "white"})
    assert aperture.fitted(tile, 2) is tile


@pytest.mark.parametrize("blades", BLADES)
def test_numbers_are_spread_evenly(blades):
    numbers = as_if_round(blades)
    for axis in range(2):
        assert set(np.bincount(numbers[..., axis].ravel(), minlength=256)) == {256}
    # Means of products of waves: control variates would shift the picture by them.
    angles = np.pi * (numbers + 0.5) / 256
    products = [np.cos(i * angles[..., 0]) * np.cos(j * angles[..., 1]) for i in range(1, 7) for j in range(1, 7)]
    assert np.abs(np.mean(products, axis=(1, 2))).max() < 0.004


@pytest.mark.parametrize("blades", BLADES)
def test_close_numbers_are_close_on_the_lens(blades):
    """Unlike Cycles' own, of which those beside the last triangle's belong to the first."""
    on_lens = points(MIDDLES, blades)
    near = as_if_round(blades) // 16

    def spread(groups):
        groups = groups[..., 0] * 16 + groups[..., 1]
        return max(np.ptp(on_lens[groups == group], axis=0).max() for group in np.unique(groups))

    assert spread(near.astype(int)) < 0.4
    assert spread((MIDDLES * 16).astype(int)) > 0.5


@pytest.mark.parametrize("blades", BLADES)
def test_fitted_tile_meets_the_points_that_its_numbers_stand_for(blades):
    values = np.random.default_rng(3).random((64, 64, 1, 3), dtype=np.float32)
    tile = generator.Tile(("t", "lens.u", "lens.v"), values, {"method": "white"})
    fitted = aperture.fitted(tile, blades).values
    np.testing.assert_array_equal(fitted[..., 0], values[..., 0])
    u, v = np.moveaxis((256.0 * fitted[..., 1:]).astype(int), -1, 0)
    error = np.abs(as_if_round(blades)[u, v] / 256.0 - values[..., 1:])
    assert error.mean() < 0.02
    # With many blades the two are one lens.
    if blades == 11:
        moved = points(fitted[..., 1:], blades) - points(values[..., 1:], 0)
        assert np.abs(moved).max() < 0.05
