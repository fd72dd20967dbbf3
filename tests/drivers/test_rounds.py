# SPDX-License-Identifier: GPL-3.0-or-later
"""The method Rounds, as scenes ask for it by Cycles' settings."""

import os
import time

import bpy
import numpy as np
import pytest

from addon.drivers import rounds, steps
from addon.plan import costs
from addon.plan import rounds as plan_rounds
from tests import rendering


def sample_counts(folder):
    """Samples of each pixel, and the picture."""
    scene = bpy.context.scene
    scene.view_layers[0].cycles.pass_debug_sample_count = True
    scene.render.filepath = str(folder / "picture.exr")
    image = scene.render.image_settings
    image.media_type, image.file_format, image.color_depth = "MULTI_LAYER_IMAGE", "OPEN_EXR_MULTILAYER", "32"
    bpy.ops.render.render(write_still=True)
    found = rendering.read_exr(folder / "picture.exr")
    return next(np.asarray(pixels) for name, pixels in found.items() if "Sample Count" in str(name))


@pytest.mark.parametrize("threshold", [0.1, None])
def test_denoiser_has_no_say_in_samples(extension, tmp_path, threshold):
    """With it on Cycles keeps the noisy picture in another pass."""
    scene = rendering.empty_scene(60, 40)
    rendering.add_plane(20, rendering.diffuse())
    rendering.add_light("AREA", 500, (2, 2, 5), size=4.0)
    rendering.add_camera()
    scene.spectral_tiles.enabled = True
    scene.cycles.samples, scene.cycles.adaptive_min_samples = 128, 0
    scene.cycles.use_adaptive_sampling = threshold is not None
    if threshold is not None:
        scene.cycles.adaptive_threshold = threshold
    counts = []
    for scene.cycles.use_denoising in (False, True):
        counts.append(sample_counts(tmp_path))
    if threshold is not None:
        np.testing.assert_array_equal(*counts)
        assert counts[1].max() == 1.0
    else:
        np.testing.assert_array_equal(*counts)


def noisy_scene(width=48, height=32):
    """A floor that is half in the penumbra of a large lamp, seen with 64 samples a pixel."""
    scene = rendering.empty_scene(width, height)
    rendering.add_plane(20, rendering.diffuse())
    rendering.add_plane(3, rendering.diffuse(), (1, 0, 2))
    rendering.add_light("AREA", 500, (2, 2, 5), size=4.0)
    rendering.add_camera()
    scene.cycles.pixel_filter_type = "BLACKMAN_HARRIS"
    return scene


def by_threshold(threshold, samples=64):
    scene = bpy.context.scene
    scene.cycles.use_adaptive_sampling, scene.cycles.adaptive_threshold = True, threshold
    scene.cycles.samples = samples
    return samples


def nan_material():
    material = rendering.emission()
    tree = material.node_tree
    node = tree.nodes.new("ShaderNodeVectorMath")
    node.operation = "DIVIDE"
    node.inputs[0].default_value = (1e38, 1e38, 1e38)
    node.inputs[1].default_value = (1e-38, 1e-38, 1e-38)
    tree.links.new(node.outputs[0], next(n for n in tree.nodes if n.type == "EMISSION").inputs["Color"])
    return material


UNUSUAL = {
    "threshold 0": lambda scene: by_threshold(0.0),
    "threshold 1": lambda scene: by_threshold(1.0),
    "at most one": lambda scene: by_threshold(0.1, 1),
    "at least more than at most": lambda scene: (
        setattr(scene.cycles, "adaptive_min_samples", 128) or by_threshold(0.1, 16)
    ),
    "a tenth of a second": lambda scene: setattr(scene.cycles, "time_limit", 0.1) or 64,
    "one pixel": lambda scene: (
        setattr(scene.render, "resolution_x", 1) or setattr(scene.render, "resolution_y", 1) or by_threshold(0.1)
    ),
    "one row": lambda scene: setattr(scene.render, "resolution_y", 1) or 32,
    "black": lambda scene: bpy.data.objects.remove(bpy.data.objects["Area"]) or 32,
    "no number of power two": lambda scene: 37,
    "border": lambda scene: (
        setattr(scene.render, "use_border", True)
        or setattr(scene.render, "border_min_x", 0.3)
        or setattr(scene.render, "border_max_y", 0.6)
        or by_threshold(0.05)
    ),
}


@pytest.mark.parametrize("change", UNUSUAL)
def test_the_unusual_gives_cycles_picture(extension, tmp_path, change):
    scene = noisy_scene()
    samples = UNUSUAL[change](scene)
    ours = rendering.beauty(rendering.render(tmp_path, "SPECTRAL_TILES", samples, seed=1))
    scene.cycles.use_adaptive_sampling, scene.cycles.time_limit = False, 0.0
    native = rendering.beauty(rendering.render(tmp_path, "CYCLES", 256, seed=2))
    assert ours.shape == native.shape and np.isfinite(ours).all()
    assert abs(ours.mean() - native.mean()) <= 0.08 * native.mean() + 1e-6


def test_pixels_that_are_no_numbers_do_no_harm(extension, tmp_path):
    scene = noisy_scene()
    rendering.add_plane(1, nan_material(), (-2, -1, 1))
    by_threshold(0.05)
    ours, native = (rendering.beauty(rendering.render(tmp_path, engine, 64)) for engine in rendering.ENGINES[::-1])
    assert (np.isfinite(ours) == np.isfinite(native)).mean() > 0.95
    sound = np.isfinite(ours) & np.isfinite(native)
    assert scene.cycles.samples == 64 and ours[sound].mean() == pytest.approx(native[sound].mean(), rel=0.1)


def test_threshold_gives_the_same_picture_each_time(extension, tmp_path):
    noisy_scene()
    by_threshold(0.02, 256)
    first, again = (rendering.beauty(rendering.render(tmp_path, "SPECTRAL_TILES", 256)) for _ in range(2))
    assert np.array_equal(first, again)


def test_even_picture_is_cycles_own(extension, tmp_path, monkeypatch):
    """Where rates promise nothing, a power of two of samples are those that Cycles takes natively."""
    monkeypatch.setattr(plan_rounds, "_chosen_squares", lambda *_: None)
    noisy_scene()
    ours, native = (rendering.beauty(rendering.render(tmp_path, engine, 64, 3)) for engine in rendering.ENGINES[::-1])
    np.testing.assert_allclose(ours, native, rtol=1e-4, atol=1e-5)


@pytest.mark.parametrize(("samples", "is_native"), [(16, True), (64, False)])
def test_few_samples_of_a_volume_are_cycles_own(extension, tmp_path, samples, is_native):
    noisy_scene()
    rendering.set_world((0.1, 0.1, 0.1))
    tree = bpy.context.scene.world.node_tree
    output = next(node for node in tree.nodes if node.bl_idname == "ShaderNodeOutputWorld")
    scatter = tree.nodes.new("ShaderNodeVolumeScatter")
    scatter.inputs["Density"].default_value = 0.05
    tree.links.new(scatter.outputs[0], output.inputs["Volume"])
    ours, native = (rendering.beauty(rendering.render(tmp_path, engine, samples)) for engine in rendering.ENGINES[::-1])
    assert np.array_equal(ours, native) is is_native
    assert ours.mean() == pytest.approx(native.mean(), rel=0.1)


def test_a_pixel_of_more_samples_is_what_cycles_makes_of_so_many(extension, tmp_path, monkeypatch):
    monkeypatch.setattr(costs, "_CALL", 10)
    rendering.empty_scene(96, 64)
    rendering.add_plane(20, rendering.diffuse())
    rendering.add_light("SUN", 2.0, (0, 0, 5), angle=0.0)
    rendering.add_light("AREA", 20.0, (2, 1, 0.8), size=1.0)
    rendering.add_camera()
    grown, seen = rounds.grown, []

    def watched(*given):
        growing = grown(*given)
        seen.append(growing.sums.counts[::-1, :, 0])
        return growing

    monkeypatch.setattr(rounds, "grown", watched)
    ours = rendering.beauty(rendering.render(tmp_path, "SPECTRAL_TILES", 64, 3))
    counts = seen[0]
    anew = [count for count in np.unique(counts) if count > 64]
    assert anew and counts.min() < 64
    for count in [64, *anew]:
        native = rendering.beauty(rendering.render(tmp_path, "CYCLES", int(count), 3))
        np.testing.assert_allclose(ours[counts == count], native[counts == count], rtol=1e-3, atol=1e-4)


@pytest.mark.parametrize("patience", [0, 1, 2, 5, 20])
def test_cancelled_in_any_round_it_leaves_a_picture(extension, tmp_path, monkeypatch, patience):
    """Complete as far as it goes: no pixel is darker than its samples."""
    scene = noisy_scene()
    by_threshold(0.02, 256)
    whole = rendering.beauty(rendering.render(tmp_path, "SPECTRAL_TILES", 256))
    shoot = rounds.Growing.shoot
    asked = []

    def shoot_some(growing, shots):
        asked.append(shots)
        return len(asked) <= patience and shoot(growing, shots)

    monkeypatch.setattr(rounds.Growing, "shoot", shoot_some)
    part = rendering.beauty(rendering.render(tmp_path, "SPECTRAL_TILES", 256))
    assert scene.render.use_border is False
    assert part.mean() == pytest.approx(whole.mean(), rel=0.08)


@pytest.mark.parametrize(("samples", "times"), [(6, 0), (8, 1), (64, 1)])
def test_what_the_denoiser_took_comes_back_by_enough_samples(extension, tmp_path, monkeypatch, samples, times):
    """Parts of fewer do not err independently."""
    noisy_scene().cycles.use_denoising = True
    reduced, called = steps.denoiser_bias.reduced, []
    monkeypatch.setattr(steps.denoiser_bias, "reduced", lambda *given: called.append(1) or reduced(*given))
    rendering.render(tmp_path, "SPECTRAL_TILES", samples)
    assert len(called) == times


@pytest.mark.parametrize("size", [(160, 120), (800, 600)])
def test_seconds_are_kept(extension, tmp_path, size):
    """About a second more than the limit, denoiser and all, which takes several seconds for the larger one."""
    scene = noisy_scene(*size)
    scene.cycles.use_denoising = True
    scene.cycles.time_limit, scene.cycles.samples = 8.0, 100000
    # In a run of all tests others have half of the processor, or more when the denoiser's turn comes.
    most = 10.0 if os.getloadavg()[0] < 1.5 else 14.0
    begun = time.perf_counter()
    rendering.render(tmp_path, "SPECTRAL_TILES", 100000)
    assert time.perf_counter() - begun < most
