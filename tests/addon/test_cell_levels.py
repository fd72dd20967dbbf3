# SPDX-License-Identifier: GPL-3.0-or-later
"""Adaptive sampling by sub-renders: Cycles takes what the budget says, all of it is used, and the expectation stays."""

import bpy
import numpy as np
import pytest

from addon import adaptive, cell_levels, cell_plan, cell_renders, forecast, shared_sequence, subrender
from addon.cell_levels import Parts, rectangles
from addon.region import Region
from tests import rendering
from tests.addon.test_adaptive import COUNT, half_noisy, scene_with_a_shadow
from tests.addon.test_manners import snapshot

PICTURE = Region((320, 240), (0, 0), (320, 240))


@pytest.fixture(autouse=True)
def _few_sub_renders(monkeypatch):
    """Sixteen cells make a picture."""
    monkeypatch.setattr(cell_plan, "_DIFFERENT", 16)


@pytest.mark.parametrize("samples", [2, 3, 4, 16])
@pytest.mark.parametrize("region", [PICTURE, Region((99, 80), (3, 5), (60, 47))])
def test_budget_is_spent_on_noise(samples, region):
    rates = adaptive.rates_in_budget(samples)
    picture = half_noisy(*region.size[::-1])
    counts = rates.counts[Parts(region, 8).levels_in_budget(picture, rates)]
    middle = region.size[0] // 2
    assert 0.95 * samples <= counts.mean() <= samples
    assert counts[:, middle:].mean() > 1.8 * counts[:, :middle].mean()


def test_even_noise_gets_even_rates():
    picture = np.random.default_rng(2).random((240, 320, 4), np.float32)
    assert np.mean(Parts(PICTURE, 8).levels_in_budget(picture, adaptive.rates_in_budget(2)) == 1) > 0.95


@pytest.mark.parametrize("size", [(1, 1), (9, 1), (1, 9), (7, 5)])
def test_nothing_to_tell_parts_apart(size):
    parts = Parts(Region(size, (0, 0), size), 4)
    picture = np.ones((*size[::-1], 4), np.float32)
    assert np.all(parts.levels_in_budget(picture, adaptive.rates_in_budget(2)) == 1)
    assert np.all(parts.levels_over_threshold(picture, 1.0) == 1)


@pytest.mark.parametrize("half", [0, 1])
@pytest.mark.parametrize("side", [4, 5])
def test_what_cells_saw_has_no_say_in_their_rates(half, side):
    """Weighing values by what they decided themselves would lose light (or make some)."""
    parts, rates = Parts(PICTURE, side), adaptive.rates_in_budget(2)
    picture, other = half_noisy(240, 320), half_noisy(240, 320)[:, ::-1]
    own = np.arange(240) % side % 2 == half
    changed = np.where(own[:, None, None], other, picture)
    for choose in (
        lambda image: parts.levels_in_budget(image, rates),
        lambda image: parts.levels_over_threshold(image, 1.0),
    ):
        before, after = choose(picture), choose(changed)
        assert np.array_equal(before[own], after[own])
        assert not np.array_equal(before[~own], after[~own])


def test_rates_fade_into_each_other():
    """Where the noise begins, no line has one rate on this side and another on that: cells end theirs elsewhere."""
    levels = Parts(PICTURE, 8).levels_in_budget(half_noisy(240, 320), adaptive.rates_in_budget(2))
    raised = (levels > 0).mean(axis=0)
    mixed = np.flatnonzero((raised > 0.02) & (raised < 0.98))
    around = mixed[(mixed > 140) & (mixed < 180)]
    assert around.size >= 12
    # Over a period of the cells, that is, as seen from afar.
    seen = np.convolve(raised, np.full(8, 1 / 8), mode="valid")[100:200]
    assert seen[0] < 0.1 and seen[-1] > 0.9
    assert np.abs(np.diff(seen)).max() < 0.15


@pytest.mark.parametrize("share", [0.0, 0.2, 0.8, 1.0])
def test_rectangles_hold_what_is_wanted_once(share):
    wanted = np.random.default_rng(1).random((13, 17)) < share
    covered = np.zeros(wanted.shape, int)
    for rectangle in rectangles(wanted):
        covered[rectangle] += 1
    assert np.array_equal(covered, wanted)
    assert len(rectangles(wanted)) == 1 or share not in {1.0}


def use_sub_renders(adapted):
    settings = bpy.context.scene.spectral_tiles
    settings.driver, settings.adaptive = "SUBRENDER", adapted
    return settings


@pytest.mark.parametrize("adapted", ["BUDGET", "THRESHOLD"])
def test_cycles_takes_the_samples_that_are_counted(tmp_path, monkeypatch, adapted):
    """Nothing that is rendered is thrown away, in a border that begins anywhere, and in every view layer."""
    scene = scene_with_a_shadow()
    scene.view_layers.new("Other").cycles.pass_debug_sample_count = True
    scene.render.use_border = scene.render.use_crop_to_border = True
    scene.render.border_min_x, scene.render.border_max_y = 0.13, 0.9
    use_sub_renders(adapted)
    taken, render = [], cell_renders.Renders._render

    def counted(self, cells, sample, shot):
        region, side = self._job.region, cells.plan.side
        inside = (
            np.minimum(size, -(-(length - first) // side))
            for size, length, first in zip(shot.size, region.size, shot.first, strict=True)
        )
        taken.append(np.prod(list(inside)))
        return render(self, cells, sample, shot)

    monkeypatch.setattr(cell_renders.Renders, "_render", counted)
    passes = rendering.render(tmp_path, "SPECTRAL_TILES", 2, seed=1)
    counts = [passes[f"{layer}.Debug Sample Count"] for layer in ("ViewLayer", "Other")]
    assert np.array_equal(*counts)
    assert sum(taken) == sum(count.sum() for count in counts)
    assert set(np.unique(counts)) <= ({1.0, 2.0, 5.0} if adapted == "BUDGET" else {2.0, 10.0})
    if adapted == "BUDGET":
        assert 1.9 <= np.mean(counts) <= 2.0
    assert np.array_equal(passes["ViewLayer.Combined"], passes["Other.Combined"])


@pytest.mark.parametrize("chosen", ["AS_CYCLES", "GAUSSIAN"])
def test_expectation_stays_and_more_samples_go_to_the_noise(tmp_path, chosen):
    """Native Cycles' expectation, or that of the other driver, which has our filters."""
    scene = scene_with_a_shadow()
    scene.spectral_tiles.filter = chosen
    others = rendering.stack(tmp_path, "CYCLES" if chosen == "AS_CYCLES" else "SPECTRAL_TILES", range(8), 4)
    use_sub_renders("BUDGET")
    passes = [rendering.render(tmp_path, "SPECTRAL_TILES", 2, seed) for seed in range(8)]
    rendering.assert_same_expectation(np.stack([rendering.beauty(one) for one in passes]), others)
    count = np.mean([one[COUNT][..., 0] for one in passes], axis=0)
    noise = others[..., 0].std(axis=0)
    assert count[noise > np.quantile(noise, 0.8)].mean() > 2.3


def test_expectation_is_native_while_things_move(tmp_path):
    """A wheel that turns, by contrast: some places take five times the samples of others, at moments of their own."""
    scene = rendering.empty_scene(32, 32)
    rendering.add_camera(type="ORTHO", ortho_scale=6)
    rendering.add_plane(40, rendering.diffuse())
    rendering.spin(rendering.add_plane(2, rendering.emission(), (0.5, 0.5, 1)), 40)
    rendering.add_light("AREA", 300, (0, 0, 4), size=3)
    scene.render.use_motion_blur, scene.cycles.max_bounces = True, 0
    native = rendering.stack(tmp_path, "CYCLES", range(16), 4)
    use_sub_renders("THRESHOLD")
    rendering.assert_same_expectation(rendering.stack(tmp_path, "SPECTRAL_TILES", range(8)), native)


def choose_by_halves(monkeypatch):
    """Level 2 in the right half, 1 in a strip, 0 elsewhere."""
    levels = np.zeros((24, 32), np.int8)
    levels[:, 8:16], levels[:, 16:] = 1, 2
    monkeypatch.setattr(Parts, "levels_in_budget", lambda self, picture, rates: levels)
    return levels


def test_pixels_are_what_their_samples_are(tmp_path, monkeypatch):
    """At level 2 the mean of its own plan's samples and, half as heavy, of the base; in a plan of another period."""
    monkeypatch.setattr(cell_plan, "_DIFFERENT", 256)
    rendering.empty_scene(32, 24)
    rendering.add_camera(type="ORTHO", ortho_scale=1)
    rendering.add_plane(4, rendering.diffuse(), (1, 0, 0))
    rendering.add_parametric_light()
    use_sub_renders("BUDGET").control_variates = False
    levels, jobs, render = choose_by_halves(monkeypatch), [], subrender.render
    monkeypatch.setattr(subrender, "render", lambda *given: jobs.append(given[-1]) or render(*given))
    picture = rendering.beauty(rendering.render(tmp_path, "SPECTRAL_TILES", 2, seed=3))[::-1]
    y, x = np.mgrid[:24, :32]

    def drawn(cells):
        plan = cells.plan
        points = shared_sequence.values(("light.u",), plan.count, plan.seed)[:, 0]
        return points[plan.offset[y % plan.side, x % plan.side]]

    (job,) = jobs
    assert job.cells.plan.side == 16 and job.larger[0].plan.side == 8
    whole, larger = drawn(job.cells), drawn(job.larger[0])
    wanted = np.choose(levels, [whole[..., 0], whole.mean(axis=2), (0.5 * whole[..., 0] + larger.sum(axis=2)) / 4.5])
    assert np.abs(picture[..., 0] / picture[..., 2] - wanted).max() < 4e-3


def test_known_noise_of_the_base_goes(tmp_path, monkeypatch):
    """Where pixels stay at the base rate, a floor's noise is that of which lamp was chosen, and is taken out."""
    monkeypatch.setattr(cell_plan, "_DIFFERENT", 256)
    scene = rendering.empty_scene(64, 64)
    rendering.add_camera((0, 0, 5))
    rendering.add_plane(20, rendering.diffuse())
    rendering.add_light("AREA", 100, (-2, 0, 3), size=0.5)
    rendering.add_light("AREA", 300, (2, 0, 3), size=0.5)
    scene.cycles.max_bounces = 0
    truth = rendering.beauty(rendering.render(tmp_path, "CYCLES", samples=256))
    levels = np.zeros((64, 64), np.int8)
    levels[:, 32:] = 2
    monkeypatch.setattr(Parts, "levels_in_budget", lambda self, picture, rates: levels)
    errors = {}
    for switched_on in (False, True):
        use_sub_renders("BUDGET").control_variates = switched_on
        errors[switched_on] = (rendering.beauty(rendering.render(tmp_path, "SPECTRAL_TILES", 2)) - truth) ** 2
    assert errors[True][:, :32].mean() < 0.5 * errors[False][:, :32].mean()
    assert errors[True][:, 32:].mean() <= 1.02 * errors[False][:, 32:].mean()


def test_a_picture_without_noise_has_no_seams(tmp_path, monkeypatch):
    """All passes, of the data too, are those of even rates."""
    rendering.empty_scene(32, 24)
    rendering.add_camera()
    rendering.add_plane(40, rendering.diffuse(), location=(0, 0, -1))
    rendering.add_light("SUN", 3, (0, 0, 3), angle=0.0)
    layer = bpy.context.view_layer
    layer.use_pass_normal = layer.use_pass_object_index = layer.use_pass_diffuse_direct = True
    layer.use_pass_z = layer.use_pass_diffuse_color = True
    use_sub_renders("OFF")
    even = rendering.render(tmp_path, "SPECTRAL_TILES", 2)
    choose_by_halves(monkeypatch)
    use_sub_renders("BUDGET")
    ours = rendering.render(tmp_path, "SPECTRAL_TILES", 2)
    assert ours.keys() == even.keys() and len(ours) >= 6
    for name, pixels in ours.items():
        assert pixels.any() or "Index" in name
        np.testing.assert_allclose(pixels, even[name], rtol=1e-4, atol=1e-6, err_msg=name)


@pytest.mark.parametrize("patience", [10, 60, 150])
def test_a_cancelled_picture_is_whole_and_changes_nothing(tmp_path, monkeypatch, patience):
    """... once the base is there; what was begun and not finished is left out."""
    scene = scene_with_a_shadow()
    scene.frame_set(1, subframe=0.25)
    scene.render.engine = "SPECTRAL_TILES"
    use_sub_renders("BUDGET")
    whole = rendering.beauty(rendering.render(tmp_path, "SPECTRAL_TILES", 2))
    before, render = snapshot(), subrender.render
    monkeypatch.setattr(
        subrender, "render", lambda engine, *job: render(rendering.CancelledSoon(engine, patience), *job)
    )
    part = rendering.beauty(rendering.render(tmp_path, "SPECTRAL_TILES", 2))
    assert snapshot() == before
    assert (part[..., 3] > 0).mean() == (10 / 16 if patience == 10 else 1.0)
    if patience > 16:
        assert not np.array_equal(part, whole)
        assert part.mean() == pytest.approx(whole.mean(), rel=0.05)


def test_forecast_tells_that_more_sub_renders_follow():
    scene = scene_with_a_shadow()
    settings = use_sub_renders("BUDGET")
    settings.samples = 4
    assert forecast.refusals(scene, bpy.context.view_layer) == []
    assert "Sub-renders: 32 small Cycles renders" in forecast.render_calls(scene, bpy.context.view_layer)
    assert "several times as many" in forecast.render_calls(scene, bpy.context.view_layer)
    assert "at least" in forecast.overhead(scene, bpy.context.view_layer)
    settings.samples = 1
    calls = forecast.render_calls(scene, bpy.context.view_layer)
    assert "16 small" in calls and "several times" not in calls


def test_animation(tmp_path):
    """Frames differ where their seeds do, and each is the same alone."""
    scene = scene_with_a_shadow()
    scene.render.engine = "SPECTRAL_TILES"
    scene.spectral_tiles.animated_seed = True
    use_sub_renders("BUDGET").samples = 2
    scene.render.image_settings.file_format, scene.render.image_settings.color_depth = "OPEN_EXR", "32"
    scene.render.filepath = f"{tmp_path}/frame_"
    scene.frame_start, scene.frame_end = 5, 6
    bpy.ops.render.render(animation=True)
    first, second = (rendering.read_exr(tmp_path / f"frame_000{frame}.exr") for frame in (5, 6))
    assert not np.array_equal(*(next(iter(passes.values())) for passes in (first, second)))
    scene.frame_set(6)
    scene.render.filepath = f"{tmp_path}/alone.exr"
    bpy.ops.render.render(write_still=True)
    alone = rendering.read_exr(tmp_path / "alone.exr")
    assert np.array_equal(*(next(iter(passes.values())) for passes in (alone, second)))


def test_windows_of_cells_of_two_periods_agree():
    """The smallest period divides the others, so a cell of any has one move of its windows."""
    for samples in (2, 3, 4, 7, 16):
        rates = adaptive.rates_in_budget(samples)
        sides = [cell_plan.side(count) for count in (rates.whole, *rates.larger)]
        assert all(side % sides[-1] == 0 for side in sides)
    levels = Parts(PICTURE, 4).levels_in_budget(half_noisy(240, 320), adaptive.rates_in_budget(2))
    found = [len(rectangles(levels[y::8, x::8] == 2)) for y in range(8) for x in range(8)]
    assert max(found) <= 4 * cell_levels._WINDOWS
