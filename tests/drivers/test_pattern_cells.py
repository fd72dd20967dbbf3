# SPDX-License-Identifier: GPL-3.0-or-later
"""A pattern followed to the letter: each cell at its moment, through its lens point, with its light sample."""

import bpy
import numpy as np
import pytest

import generator
from addon.cycles import shared_sequence
from addon.plan import cell_plan
from tests import rendering
from tests.cycles.test_osl_camera import build_scene as build_landscape
from tests.drivers import test_expectation as scenes
from tests.scenes import builders

DIMS = ("t", "lens.u", "lens.v", "light.u", "light.v")
PANORAMAS = [kind.identifier for kind in bpy.types.Camera.bl_rna.properties["panorama_type"].enum_items]
# Some that Cycles can enlarge by itself, and one that takes Open Shading Language.
FEW_PANORAMAS = ("FISHEYE_EQUISOLID", "CENTRAL_CYLINDRICAL", "EQUIRECTANGULAR")


def follow(folder, size=4):
    """Have the scene follow a tile of the user's."""
    # A net in random order: its own mean is close to the true one.
    values = np.random.default_rng(5).permutation(shared_sequence.values(DIMS, 256, seed=8)[: size * size])
    path = folder / "tile.npz"
    generator.save_tile(generator.Tile(DIMS, values.reshape(size, size, 1, 5), {"method": "net", "seed": 8}), path)
    scene = bpy.context.scene
    settings = scene.spectral_tiles
    settings.method, settings.pattern, settings.pattern_path = "SUB_FRAMES", "FILE", str(path)
    return scene


def both(folder, samples=1, seeds=range(8), size=4):
    follow(folder, size)
    ours = rendering.stack(folder, "SPECTRAL_TILES", seeds, samples)
    return ours, rendering.stack(folder, "CYCLES", seeds, samples)


def test_the_plan_is_the_tiles(tmp_path):
    tile = generator.load_tile(follow(tmp_path, 16).spectral_tiles.pattern_path)
    plan = cell_plan.following(tile, DIMS, 1, seed=3)
    assert np.sort(plan.t, axis=None) == pytest.approx(np.sort(tile.values[..., 0], axis=None), abs=1e-6)
    assert len(np.unique(plan.offset)) == 256
    (group,) = plan.groups(range(1))
    assert [shot.opening for shot in group] == sorted(shot.opening for shot in group)
    assert {shot.cell: shot.first for shot in group} == {cell: plan.offset[*cell, 0] for cell in np.ndindex(16, 16)}


@pytest.mark.parametrize(
    "camera",
    [
        {"lens": 24.0, "clip_start": 6.0},
        {"sensor_fit": "VERTICAL", "sensor_height": 30.0, "shift_x": 0.3, "shift_y": -0.2},
        {"type": "ORTHO", "ortho_scale": 7.0, "shift_x": -0.25},
        *({"type": "PANO", "panorama_type": kind, "shift_x": 0.1, "shift_y": -0.07} for kind in FEW_PANORAMAS),
    ],
    ids=lambda camera: camera.get("panorama_type", ",".join(camera)),
)
def test_projection_and_passes(tmp_path, camera):
    """Without anything random in the scene, every pass is native's."""
    assert set(FEW_PANORAMAS) <= set(PANORAMAS)
    scene = build_landscape(37, 29, **camera)
    scene.render.pixel_aspect_y = 1.4
    scene.render.use_border, scene.render.use_crop_to_border = True, True
    scene.render.border_min_x, scene.render.border_max_x = 0.11, 0.93
    layer = bpy.context.view_layer
    layer.use_pass_z = layer.use_pass_normal = layer.use_pass_position = layer.use_pass_object_index = True
    follow(tmp_path)
    ours = rendering.render(tmp_path, "SPECTRAL_TILES")
    native = rendering.render(tmp_path, "CYCLES")
    assert ours.keys() == native.keys()
    for name in ours:
        wrong = np.abs(ours[name] - native[name]).max(axis=-1) > 3e-4 * (1 + np.abs(native[name]).max(axis=-1))
        allowed = 0.05 if "panorama_type" in camera else 0.01  # more of the ground is seen edge-on
        assert wrong.mean() <= allowed, f"{name}: {wrong.mean():.1%} of the pixels differ"


def test_mean_over_seeds_is_native(tmp_path):
    scenes.moving_camera_with_open_lens()
    rendering.assert_same_expectation(*both(tmp_path, seeds=range(6), size=8))


def test_bokeh_of_an_orthographic_camera(tmp_path):
    """A point of light out of focus draws the aperture, by a tilted and squeezed camera that cuts a plane."""
    rendering.empty_scene(24, 24)
    camera = rendering.add_camera((0, -3, 8), (0.3, 0, 0), type="ORTHO", ortho_scale=6.0, clip_start=3.5)
    camera.scale = (1.0, -2.0, 0.5)
    dof = camera.data.dof
    dof.use_dof, dof.focus_distance, dof.aperture_fstop = True, 4.0, 0.5
    dof.aperture_blades, dof.aperture_ratio = 3, 0.8
    rendering.add_plane(0.5, rendering.emission(strength=20.0))
    rendering.add_plane(4, rendering.emission((0.2, 0.5, 0.1)), (0, 0, 4.5))
    ours, native = both(tmp_path, samples=8, seeds=range(4))
    assert native[..., 0].std() > 0.1
    rendering.assert_same_expectation(ours, native, block=2)


def test_stereo_pair(tmp_path):
    """The left eye's picture is native's, and so, but for the slightest blur, is the right eye's."""
    scene = build_landscape(29, 23, shift_x=0.1)
    scene.render.use_multiview = True
    scene.render.image_settings.media_type = "MULTI_LAYER_IMAGE"
    scene.render.image_settings.views_format = "MULTIVIEW"
    stereo = scene.camera.data.stereo
    stereo.convergence_mode, stereo.interocular_distance, stereo.convergence_distance = "OFFAXIS", 0.6, 5.0
    follow(tmp_path)
    ours, native = (rendering.render(tmp_path, engine) for engine in reversed(rendering.ENGINES))
    assert ours.keys() == native.keys()
    for eye, tolerance in (("left", 3e-4), ("right", 2e-3)):
        a, b = (passes[f"ViewLayer.Combined.{eye}"] for passes in (ours, native))
        wrong = np.abs(a - b).max(axis=-1) > tolerance * (1 + np.abs(b).max(axis=-1))
        assert wrong.mean() <= 0.01, f"{eye}: {wrong.mean():.1%} of the pixels differ"


@pytest.mark.parametrize("motion_blur", [False, True])
def test_adaptive_subdivision(tmp_path, motion_blur):
    """Surfaces are diced for the pixels of the picture, not for the larger ones of a sub-frame, at all times."""
    builders.displacement()
    scene = follow(tmp_path)
    scene.render.use_motion_blur, scene.render.motion_blur_shutter = motion_blur, 1e-4
    rendering.slide(scene.camera, (0, -5.1, 5), (0, -4.9, 5))
    ours, native = (rendering.render(tmp_path, engine)["ViewLayer.Normal"] for engine in reversed(rendering.ENGINES))
    assert np.abs(ours - native).max(axis=-1).mean() < 1e-3


def test_filters_of_our_own(tmp_path):
    """With a border that begins anywhere: their expectation, and colours that fit alpha."""
    scene = rendering.empty_scene(24, 20)
    scene.render.film_transparent = True
    scene.render.use_border = scene.render.use_crop_to_border = True
    scene.render.border_min_x, scene.render.border_max_y = 0.13, 0.9
    rendering.add_camera(type="ORTHO", ortho_scale=24)
    rendering.add_plane(7.3, rendering.emission())
    scene.spectral_tiles.filter, scene.spectral_tiles.method = "MITCHELL_NETRAVALI", "GATHER"
    gathered = rendering.stack(tmp_path, "SPECTRAL_TILES", range(8), 4)
    follow(tmp_path)
    ours = rendering.stack(tmp_path, "SPECTRAL_TILES", range(4), 4)
    rendering.assert_same_expectation(ours, gathered, block=1)
    assert np.allclose(ours[..., 0], ours[..., 3], atol=1e-5)


def two_cameras_of_one_kind(scene):
    scene.render.use_multiview, scene.render.views_format = True, "MULTIVIEW"
    scene.camera.name = "Camera_L"
    rendering.add(scene.camera.data, (1, 0, 5)).name = "Camera_R"


def cull_by_camera(scene):
    scene.render.use_simplify = scene.cycles.use_camera_cull = True


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda scene: setattr(scene.camera.data, "type", "CUSTOM"), "custom"),
        (cull_by_camera, "Camera Culling"),
        (two_cameras_of_one_kind, "share the data"),
        (lambda scene: setattr(scene.cycles, "samples", 2**20), "sub-frames"),
    ],
)
def test_what_it_cannot_do_is_named(tmp_path, change, message):
    scenes.moving_camera_with_open_lens()
    scene = follow(tmp_path)
    change(scene)
    with pytest.raises(RuntimeError, match=message):
        rendering.render(tmp_path, "SPECTRAL_TILES", scene.cycles.samples)
