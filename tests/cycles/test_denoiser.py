# SPDX-License-Identifier: GPL-3.0-or-later
"""The scene's denoising settings are followed, on pixels that are in order."""

import time

import bpy
import numpy as np
import pytest

from addon.blender.region import Region
from addon.cycles import denoiser
from tests import rendering


def build_scene(width=64, height=48):
    """Boxes under a soft light: noisy at one sample, and smooth in truth."""
    scene = rendering.empty_scene(width, height)
    rendering.add_camera((0, -5, 5), (np.radians(45), 0, 0))
    rendering.add_plane(8, rendering.diffuse())
    for x in (-1.5, 0, 1.5):
        rendering.add_plane(1, rendering.diffuse((0.7, 0.3 + 0.1 * x, 0.2)), (x, 0, 0.8), (0.4, 0.2, x))
    rendering.add_light("AREA", 300, (1, -1, 4), size=3)
    rendering.set_world((0.1, 0.1, 0.1))
    scene.cycles.use_denoising = True
    bpy.context.view_layer.cycles.denoising_store_passes = True
    return scene


def from_bottom(image):
    """A pass of `rendering.render` in the form that the add-on works on."""
    return np.ascontiguousarray(image[::-1]).reshape(-1, image.shape[-1])


@pytest.mark.parametrize(
    "settings",
    [
        {},
        {"denoising_prefilter": "NONE"},
        {"denoising_prefilter": "FAST", "denoising_quality": "FAST"},
        {"denoising_input_passes": "RGB"},
        {"denoising_input_passes": "RGB_ALBEDO"},
    ],
    ids=lambda settings: ",".join(settings.values()) or "default",
)
def test_is_cycles_own_denoising(tmp_path, settings):
    """The pixels that native Cycles denoised come out the same, whatever the settings."""
    scene = build_scene()
    for name, value in settings.items():
        setattr(scene.cycles, name, value)
    native = rendering.render(tmp_path, "CYCLES", samples=2)
    height, width = native["ViewLayer.Combined"].shape[:2]
    passes = {
        (name, ""): from_bottom(native[f"ViewLayer.{name}"])
        for name in ("Noisy Image", "Denoising Albedo", "Denoising Normal")
    }
    ours = denoiser.denoise(scene, bpy.context.view_layer, Region((width, height), (0, 0), (width, height)), passes)
    assert np.allclose(ours["Combined", ""], from_bottom(native["ViewLayer.Combined"]), rtol=1e-4, atol=1e-5)
    assert np.abs(ours["Combined", ""] - passes["Noisy Image", ""]).max() > 0.05


def test_error_is_no_more_than_native_denoised(tmp_path):
    scene, samples = build_scene(), 16
    scene.cycles.use_denoising = False
    reference = rendering.beauty(rendering.render(tmp_path, "CYCLES", samples=1024))
    scene.cycles.use_denoising = True
    errors = {engine: [] for engine in rendering.ENGINES}
    for engine in rendering.ENGINES:
        for seed in range(12):
            passes = rendering.render(tmp_path, engine, samples, seed=seed)
            noisy = passes["ViewLayer.Noisy Image"] - reference
            clean = rendering.beauty(passes) - reference
            assert np.mean(clean**2) < np.mean(noisy**2)
            errors[engine].append(np.mean(clean**2))
    ratio = np.mean(errors["SPECTRAL_TILES"]) / np.mean(errors["CYCLES"])
    spread = ratio * np.sqrt(sum(np.var(error, ddof=1) / len(error) / np.mean(error) ** 2 for error in errors.values()))
    assert ratio <= 1.05 + 2.0 * spread < 1.2


@pytest.mark.parametrize(
    ("users", "guides", "light", "needed"),
    [
        ("ACCURATE", 1e-5, 1e-5, "NONE"),
        ("ACCURATE", 1e-3, 1e-3, "ACCURATE"),
        ("ACCURATE", 1e-3, 1e-1, "NONE"),
        ("FAST", 1e-5, 1e-5, "FAST"),
    ],
)
def test_prefilter_is_for_noisy_guides(users, guides, light, needed):
    scene = build_scene()
    scene.cycles.denoising_prefilter = users
    assert denoiser.prefilter(scene, guides, light) == needed


@pytest.mark.parametrize(("aperture", "is_clean"), [(None, True), (0.05, False)], ids=["sharp", "blurred"])
def test_guides_are_prefiltered_where_they_are_noisy(tmp_path, aperture, is_clean):
    """The picture is that of the user's own prefilter, or of none."""
    scene = build_scene()
    if aperture:
        lens = scene.camera.data.dof
        lens.use_dof, lens.aperture_fstop, lens.focus_distance = True, aperture, 2.0
    pictures = {}
    for prefilter in ("ACCURATE", "NONE"):
        scene.cycles.denoising_prefilter = prefilter
        pictures[prefilter] = rendering.beauty(rendering.render(tmp_path, "SPECTRAL_TILES", 16))
        assert scene.cycles.denoising_prefilter == prefilter
    assert np.array_equal(*pictures.values()) == is_clean


def test_switches(tmp_path):
    """Neither the scene's switch off nor the layer's leaves anything denoised."""
    scene = build_scene(16, 16)
    scene.spectral_tiles.method = "IN_PLACE"
    scene.cycles.use_denoising = False
    noisy = rendering.render(tmp_path, "SPECTRAL_TILES")
    assert "ViewLayer.Noisy Image" not in noisy
    scene.cycles.use_denoising = True
    clean = rendering.render(tmp_path, "SPECTRAL_TILES")
    assert np.array_equal(clean["ViewLayer.Noisy Image"], noisy["ViewLayer.Combined"])
    assert not np.array_equal(clean["ViewLayer.Combined"], noisy["ViewLayer.Combined"])
    bpy.context.view_layer.cycles.use_denoising = False
    assert np.array_equal(
        rendering.render(tmp_path, "SPECTRAL_TILES")["ViewLayer.Combined"], noisy["ViewLayer.Combined"]
    )


def test_all_that_is_denoised_is_reckoned_with(monkeypatch):
    scene = build_scene()
    layer = bpy.context.view_layer
    monkeypatch.setattr(denoiser, "_denoise", lambda scene, layer, size, *_: time.sleep(2e-6 * size[0] * size[1]))
    assert denoiser.seconds(scene, layer, 100_000) == pytest.approx(0.2, rel=0.3)
    scene.render.use_multiview = True
    assert denoiser.seconds(scene, layer, 100_000) == pytest.approx(0.4, rel=0.3)


@pytest.mark.parametrize("error", denoiser.FAILURES)
@pytest.mark.parametrize("time_limit", [0.0, 1.0])
def test_a_failure_leaves_the_noisy_picture(tmp_path, monkeypatch, capfd, error, time_limit):
    """... which is written, and says what is the matter."""
    scene = build_scene(16, 16)
    scene.cycles.time_limit = time_limit

    def fail(*_):
        raise error("out of memory")

    monkeypatch.setattr(denoiser, "_denoise", fail)
    passes = rendering.render(tmp_path, "SPECTRAL_TILES", samples=16)
    noisy = passes["ViewLayer.Noisy Image"]
    assert noisy.mean() > 0.1 and np.array_equal(passes["ViewLayer.Combined"], noisy)
    told = capfd.readouterr()
    assert (told.out + told.err).count("Cannot denoise") == 1 and "out of memory" in told.out + told.err


@pytest.mark.parametrize("has_pass", [False, True])
@pytest.mark.parametrize("transparent", [False, True])
def test_shadow_catchers_are_cycles_own(tmp_path, has_pass, transparent):
    """Alpha, which has the shadow, and all else; a method that was chosen by hand says that it cannot."""
    scene = build_scene(32, 24)
    next(made for made in scene.objects if made.type == "MESH").is_shadow_catcher = True
    scene.render.film_transparent = transparent
    bpy.context.view_layer.cycles.use_pass_shadow_catcher = has_pass
    native, ours = (rendering.render(tmp_path, engine, 16) for engine in rendering.ENGINES)
    for name, pixels in native.items():
        assert np.array_equal(ours[name], pixels), name
    scene.cycles.use_denoising = False
    found = rendering.render(tmp_path, "SPECTRAL_TILES", 16)["ViewLayer.Combined"]
    assert np.allclose(found[..., 3].mean(), native["ViewLayer.Combined"][..., 3].mean(), rtol=0.02)
    scene.cycles.use_denoising, scene.spectral_tiles.method = True, "GATHER"
    with pytest.raises(RuntimeError, match="shadow catcher"):
        bpy.ops.render.render()
