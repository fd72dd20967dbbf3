# SPDX-License-Identifier: GPL-3.0-or-later
"""Adaptive sampling: samples go where the noise is, the mean keeps to the budget, and the expectation stays."""

import bpy
import numpy as np
import pytest

from addon import adaptive
from tests import rendering

COUNT = "ViewLayer.Debug Sample Count"


def half_noisy(height=40, width=60):
    """A picture that is noisy on its right half only."""
    picture = np.full((height, width, 4), 0.5, np.float32)
    noise = np.random.default_rng(1).normal(size=(height, width // 2, 1))
    picture[:, width // 2 :, :3] += 0.2 * noise.astype(np.float32)
    return picture


@pytest.mark.parametrize("samples", [2, 3, 4, 16])
def test_budget_is_spent_on_noise(samples):
    rates = adaptive.rates_in_budget(samples)
    levels = adaptive.levels_in_budget(half_noisy(), rates)
    counts = rates.counts[levels]
    assert 0.98 * samples <= counts.mean() <= samples
    assert counts[:, 40:].mean() > 1.8 * counts[:, :20].mean()


def test_even_noise_gets_even_rates():
    """As good as without adapting, since hardly any block is broken."""
    picture = np.random.default_rng(2).random((64, 64, 4), np.float32)
    assert np.mean(adaptive.levels_in_budget(picture, adaptive.rates_in_budget(2)) == 1) > 0.95


def test_rates_fade_into_each_other():
    """Where the noise changes slowly there is no line with one rate on this side and another on that."""
    picture = np.ones((200, 120, 4), np.float32)
    noise = np.random.default_rng(4).normal(size=(200, 120, 1)) * np.geomspace(0.05, 0.2, 120)[:, None]
    picture[..., :3] += noise.astype(np.float32)
    levels = adaptive.levels_in_budget(picture, adaptive.rates_in_budget(2))
    assert levels[:, 0].mean() < 0.1
    assert levels[:, -1].mean() > 1.5
    # Share of neighbours with different rates, by seven columns.
    mixed = (np.diff(levels, axis=1) != 0).mean(axis=0).reshape(-1, 7).mean(axis=1)
    assert mixed[:5].max() > 0.25
    assert mixed[6:12].max() < 0.05


@pytest.mark.parametrize("picture", [np.zeros((8, 9, 4), np.float32), np.ones((1, 1, 4), np.float32)])
def test_nothing_to_tell_pixels_apart(picture):
    assert np.all(adaptive.levels_in_budget(picture, adaptive.rates_in_budget(2)) == 1)
    assert np.all(adaptive.levels_over_threshold(picture, 1.0) == 1)


@pytest.mark.parametrize("place", [(20, 45), (0, 59), (39, 31)])
def test_a_pixels_own_value_has_no_say_in_its_rate(place):
    """Weighing one value by what it decided itself would lose light (or make some)."""
    picture = half_noisy()
    changed = picture.copy()
    changed[place] = 30.0
    before, after = (adaptive._variance(image)[place] for image in (picture, changed))
    assert after == pytest.approx(before, rel=1e-3)
    assert adaptive.levels_over_threshold(changed, 1.0)[20, 45] == adaptive.levels_over_threshold(picture, 1.0)[20, 45]


def test_variance_is_that_of_the_noise():
    """Up to the border, and however the picture itself rises."""
    noise = np.random.default_rng(3).normal(0.0, 0.2, (60, 80, 1)).astype(np.float32)
    picture = np.ones((60, 80, 4), np.float32)
    picture[..., :3] = 0.01 * np.arange(80, dtype=np.float32)[:, None] + noise
    variance = adaptive._variance(picture)
    assert variance.mean() == pytest.approx(0.04, rel=0.05)
    assert variance[0].mean() == pytest.approx(0.04, rel=0.2)
    assert variance.std() < 0.01


def scene_with_a_shadow():
    """A plane half of which lies in the soft shadow of something that the camera does not see."""
    scene = rendering.empty_scene(24, 24)
    rendering.add_camera(type="ORTHO", ortho_scale=6)
    rendering.add_plane(40, rendering.diffuse())
    blocker = rendering.add_plane(4, rendering.diffuse(), (-3, 0, 2))
    blocker.visible_camera = False
    rendering.add_light("AREA", 300, (0, 0, 4), size=3)
    scene.cycles.max_bounces = 0
    bpy.context.view_layer.cycles.pass_debug_sample_count = True
    return scene


@pytest.mark.parametrize("chosen", ["AS_CYCLES", "BOX"])
def test_expectation_is_native_and_counts_keep_to_the_budget(tmp_path, chosen):
    scene = scene_with_a_shadow()
    native = rendering.stack(tmp_path, "CYCLES", range(16), 4)
    scene.spectral_tiles.adaptive = "BUDGET"
    scene.spectral_tiles.filter = chosen
    passes = [rendering.render(tmp_path, "SPECTRAL_TILES", 2, seed) for seed in range(24)]
    rendering.assert_same_expectation(np.stack([rendering.beauty(one) for one in passes]), native)
    count = np.stack([one[COUNT] for one in passes])
    assert set(np.unique(count)) <= {1.0, 2.0, 5.0}
    assert 1.9 <= count.mean() <= 2.0
    noise = native[..., 0].std(axis=0)
    assert count.mean(axis=0)[..., 0][noise > np.quantile(noise, 0.8)].mean() > 2.3


def test_threshold_leaves_flat_parts_alone(tmp_path):
    scene = rendering.empty_scene(32, 16)
    rendering.add_camera(type="ORTHO", ortho_scale=8)
    rendering.add_plane(4, rendering.emission())
    scene.spectral_tiles.adaptive = "THRESHOLD"
    bpy.context.view_layer.cycles.pass_debug_sample_count = True
    count = rendering.render(tmp_path, "SPECTRAL_TILES", 2)[COUNT][..., 0]
    assert set(np.unique(count)) == {2.0, 10.0}
    assert np.all(count[:, :6] == 2.0)
    assert np.all(count[4, 12:20] >= 2.0)
    assert count[8, 7:10].max() == 10.0
    scene.spectral_tiles.adaptive_threshold = 10.0
    assert np.all(rendering.render(tmp_path, "SPECTRAL_TILES", 2)[COUNT] == 2.0)


def test_subset_is_refused(tmp_path):
    scene = rendering.empty_scene()
    rendering.add_camera()
    scene.spectral_tiles.adaptive = "BUDGET"
    scene.cycles.use_sample_subset = True
    with pytest.raises(RuntimeError, match="subset"):
        rendering.render(tmp_path, "SPECTRAL_TILES", 2)
    assert not bpy.context.scene.render.use_persistent_data
