# SPDX-License-Identifier: GPL-3.0-or-later
"""Adaptive sampling: samples go where the noise is, the mean keeps to the budget, and the expectation stays."""

import bpy
import numpy as np
import pytest

from addon import adaptive, automatic, control_variates, cycles_random, several_renders, spots
from addon.analysis import SceneUse
from addon.plan import Plan
from addon.region import Region
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


@pytest.mark.parametrize("region", [Region((90, 70), (0, 0), (90, 70)), Region((99, 80), (3, 5), (31, 27))])
@pytest.mark.parametrize("servants", [2, 4])
@pytest.mark.parametrize("share", [0.1, 0.9])
def test_spots_are_served_once_by_whole_blocks(region, servants, share):
    width, height = region.size
    taken = np.random.default_rng(5).random((height, width)) < share
    renders = spots.make(taken, region, servants, seed=7)
    assert np.array_equal(np.sort(np.concatenate([some.film for some in renders])), np.flatnonzero(taken))
    for some in renders:
        y, x = np.divmod(some.servants, width)
        ranks = cycles_random.pixel_ranks(x + region.corner[0], y + region.corner[1], some.plan.seed)
        assert np.all(np.sort(ranks, axis=0) == servants * some.ranks + np.arange(servants)[:, None])
        assert np.all(some.plan.film[some.servants] == some.film)
        assert np.count_nonzero(some.plan.film >= 0) == some.servants.size
        # In as few rows as they fill, but for what is no part of an aligned square.
        assert y.max() < some.rows <= some.servants.size / (width - 2) + 4


def test_neighbouring_spots_have_neighbouring_blocks():
    """Blocks of four pixels of a square follow each other in the sequence, however many pixels are left out below."""
    taken = np.zeros((64, 64), bool)
    taken[32:48, 16:32] = True
    (found,) = spots.make(taken, Region((64, 64), (0, 0), (64, 64)), 4, seed=7)
    assert np.all(np.ptp(found.ranks.reshape(-1, 4), axis=1) == 3)


def test_cycles_draws_what_spots_count_on(tmp_path, monkeypatch):
    """A pixel of level 2 or 3 is the mean of its block's samples and, half as heavy, of the base."""
    scene = rendering.empty_scene(32, 24)
    rendering.add_camera(type="ORTHO", ortho_scale=1)
    rendering.add_plane(4, rendering.diffuse())
    rendering.add_parametric_light()
    scene.spectral_tiles.adaptive = "BUDGET"
    scene.spectral_tiles.control_variates = False
    levels = np.zeros((24, 32), np.int8)
    levels[10:18, 5:20] = 2
    levels[10:14, 9:30] = 3
    monkeypatch.setattr(adaptive, "levels_in_budget", lambda picture, rates: levels)
    jobs = []
    adapted = several_renders.adapted
    monkeypatch.setattr(several_renders, "adapted", lambda *given: jobs.append(given[-1]) or adapted(*given))
    picture = rendering.beauty(rendering.render(tmp_path, "SPECTRAL_TILES", 2, seed=3))[::-1]
    (job,) = jobs
    for level, samples in ((2, 4), (3, 8)):
        (found,) = spots.make(levels == level, job.region, samples // 2, job.seed ^ adaptive.apart(level))
        first = job.plan.at_film(job.region)[0].ravel()[found.film] * np.uint32(2)
        block = found.ranks * np.uint32(samples) + np.arange(samples, dtype=np.uint32)[:, None]
        base, larger = (cycles_random.sequence_values(index, ["light.u"])[..., 0] for index in (first, block))
        drawn = (picture[..., 0] / picture[..., 2]).ravel()[found.film]
        assert np.abs(drawn - (0.5 * base + larger.sum(axis=0)) / (samples + 0.5)).max() < 2e-3


def test_noise_of_all_levels_is_known():
    """Where a pixel is what its numbers make it, less than half of the variance is left, whatever its rate."""
    region = Region((96, 96), (0, 0), (96, 96))
    rates = adaptive.rates_in_budget(2)
    levels = np.random.default_rng(6).integers(0, 4, (96, 96)).astype(np.int8)
    y, x = np.mgrid[:96, :96]
    ranks = cycles_random.pixel_ranks(x, y, 1)
    use = SceneUse(motion_blur=False, lens=False, lights=2, bounces=False, glow=False)
    clean = control_variates.of_picture(use, automatic.drawn(Plan.in_place(1, region), region, 2))

    def wave(first, count):
        index = np.asarray(first * np.uint32(count)) + np.arange(count, dtype=np.uint32).reshape(-1, *(1,) * first.ndim)
        return np.cos(np.pi * cycles_random.sequence_values(index, ["light.pick"])[..., 0])

    whole = wave(ranks, 2)
    noise = np.where(levels == 1, whole.mean(axis=0), whole[0])
    larger = {}
    for level, samples in enumerate(rates.larger, start=2):
        larger[level] = spots.make(levels == level, region, samples // rates.whole, adaptive.apart(level))
        for some in larger[level]:
            noise.ravel()[some.film] = wave(some.ranks, samples).mean(axis=0)
    left = picture = (1.0 + noise)[None].astype(np.float32)
    left = clean(left, 0, rates.base, levels == 0)
    left = clean(left, 0, rates.whole, levels == 1)
    for level, samples in enumerate(rates.larger, start=2):
        left = clean(left, 0, samples, levels == level, spots.drawn(larger[level], levels.shape))
    for level in range(4):
        assert left[0][levels == level].var() < 0.5 * picture[0][levels == level].var()


@pytest.mark.parametrize("driver", ["GATHER", "SUBRENDER"])
def test_known_noise_is_no_reason_for_more_samples(tmp_path, monkeypatch, driver):
    """A floor under two lamps: which is chosen makes most of the noise, and rates are chosen without that."""
    scene = rendering.empty_scene(64, 64)
    scene.spectral_tiles.driver = driver
    scene.spectral_tiles.adaptive = "BUDGET"
    rendering.add_camera((0, 0, 5))
    rendering.add_plane(20, rendering.diffuse())
    rendering.add_light("AREA", 100, (-2, 0, 3), size=0.5)
    rendering.add_light("AREA", 300, (2, 0, 3), size=0.5)
    scene.cycles.max_bounces = 0
    seen = []
    by_variance = adaptive.levels_by_variance
    monkeypatch.setattr(
        adaptive, "levels_by_variance", lambda variance, *rest: seen.append(variance) or by_variance(variance, *rest)
    )
    noise = {}
    for switched_on in (False, True):
        bpy.context.scene.spectral_tiles.control_variates = switched_on
        seen.clear()
        rendering.render(tmp_path, "SPECTRAL_TILES", 2)
        noise[switched_on] = np.mean(seen)
    assert noise[True] < 0.5 * noise[False]


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
    assert set(np.unique(count)) <= {1.0, 2.0, 5.0, 9.0}
    assert 1.9 <= count.mean() <= 2.0
    noise = native[..., 0].std(axis=0)
    assert count.mean(axis=0)[..., 0][noise > np.quantile(noise, 0.8)].mean() > 2.3


@pytest.mark.parametrize("adapted", ["BUDGET", "THRESHOLD"])
def test_expectation_is_native_where_noise_is_known(tmp_path, adapted):
    """Several lights, of which a pixel knows which it chose, and a wide filter of Cycles' own."""
    scene = scene_with_a_shadow()
    scene.cycles.pixel_filter_type, scene.cycles.filter_width = "BLACKMAN_HARRIS", 1.5
    rendering.add_light("POINT", 150, (2, 1, 2), shadow_soft_size=0.5)
    rendering.add_light("AREA", 100, (-2, -2, 3), size=1)
    native = rendering.stack(tmp_path, "CYCLES", range(24), 4)
    scene.spectral_tiles.adaptive = adapted
    ours = rendering.stack(tmp_path, "SPECTRAL_TILES", range(40), 2)
    rendering.assert_same_expectation(ours, native)


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
