# SPDX-License-Identifier: GPL-3.0-or-later
"""The sub-render driver: native Cycles' expectation, the moments that it blurs, and a scene left as it was."""

import bpy
import numpy as np
import pytest
from tests.addon.test_camera import build_scene as build_landscape

import generator
from addon.blender.failure import Refused
from addon.cycles import shared_sequence
from addon.drivers import sub_frames
from addon.picture import mixing
from addon.plan import cell_plan
from tests import rendering
from tests.addon import test_expectation as scenes
from tests.addon.test_manners import snapshot
from tests.addon.test_panel import zoom
from tests.scenes import builders

SEEDS = range(20)
PANORAMAS = [kind.identifier for kind in bpy.types.Camera.bl_rna.properties["panorama_type"].enum_items]


@pytest.fixture(autouse=True)
def _few_sub_renders(monkeypatch):
    """Sixteen sub-renders make a picture: enough to test with, and quick."""
    monkeypatch.setattr(cell_plan, "_DIFFERENT", 16)


def use_sub_renders():
    scene = bpy.context.scene
    scene.spectral_tiles.driver = "SUBRENDER"
    return scene


def both(folder, samples=1, seeds=SEEDS):
    """Stacks of our renders and of native ones."""
    use_sub_renders()
    ours = rendering.stack(folder, "SPECTRAL_TILES", seeds, samples)
    return ours, rendering.stack(folder, "CYCLES", seeds, samples)


@pytest.mark.parametrize(
    "camera",
    [
        {"lens": 24.0, "clip_start": 6.0},
        {"sensor_fit": "VERTICAL", "sensor_height": 30.0, "shift_x": 0.3, "shift_y": -0.2},
        {"type": "ORTHO", "ortho_scale": 7.0, "shift_x": -0.25},
        *({"type": "PANO", "panorama_type": kind, "shift_x": 0.1, "shift_y": -0.07} for kind in PANORAMAS),
    ],
    ids=lambda camera: camera.get("panorama_type", ",".join(camera)),
)
def test_projection_and_passes(tmp_path, camera):
    """Without anything random in the scene, every pass is native's."""
    scene = build_landscape(37, 29, **camera)
    scene.render.pixel_aspect_y = 1.4
    scene.render.use_border, scene.render.use_crop_to_border = True, True
    scene.render.border_min_x, scene.render.border_max_x = 0.11, 0.93
    layer = bpy.context.view_layer
    layer.use_pass_z = layer.use_pass_normal = layer.use_pass_position = layer.use_pass_object_index = True
    use_sub_renders()
    ours = rendering.render(tmp_path, "SPECTRAL_TILES")
    native = rendering.render(tmp_path, "CYCLES")
    assert ours.keys() == native.keys()
    for name in ours:
        wrong = np.abs(ours[name] - native[name]).max(axis=-1) > 3e-4 * (1 + np.abs(native[name]).max(axis=-1))
        allowed = 0.05 if "panorama_type" in camera else 0.01  # more of the ground is seen edge-on
        assert wrong.mean() <= allowed, f"{name}: {wrong.mean():.1%} of the pixels differ"


def zooming_camera():
    scenes.static_scene()
    bpy.context.scene.render.use_motion_blur = True
    zoom(bpy.context.scene.camera.data)


@pytest.mark.parametrize(
    ("build", "samples"),
    [
        (scenes.glossy_two_lights_and_world, 1),
        (scenes.moving_camera_with_open_lens, 3),
        (scenes.non_uniform_shutter, 1),
        (scenes.wheels, 1),
        (zooming_camera, 1),
    ],
    ids=lambda value: getattr(value, "__name__", None),
)
def test_mean_over_seeds_is_native(tmp_path, build, samples):
    build()
    rendering.assert_same_expectation(*both(tmp_path, samples))


@pytest.mark.parametrize("fit", ["AUTO", "VERTICAL"])
def test_equidistant_fisheye(tmp_path, monkeypatch, extension, fit):
    """In square frames it needs no Open Shading Language, as others never do."""
    camera = {"panorama_type": "FISHEYE_EQUIDISTANT", "fisheye_fov": 2.8, "sensor_height": 20.0, "sensor_fit": fit}
    scene = build_landscape(37, 37, type="PANO", shift_y=0.1, **camera)
    use_sub_renders()
    native = rendering.beauty(rendering.render(tmp_path, "CYCLES"))
    monkeypatch.setattr(extension.engine.cycles, "with_osl", lambda: False)
    ours = rendering.beauty(rendering.render(tmp_path, "SPECTRAL_TILES"))
    wrong = np.abs(ours - native).max(axis=-1) > 3e-4 * (1 + native.max(axis=-1))
    assert wrong.mean() <= 0.02
    assert (native[..., 0] == 0).any() and (native[..., 0] > 0).mean() > 0.2
    scene.render.engine, scene.render.pixel_aspect_x = "SPECTRAL_TILES", 1.5
    with pytest.raises(RuntimeError, match=r"Equidistant.*Open Shading Language"):
        bpy.ops.render.render()


def open_lens(**camera):
    """A camera before an edge out of focus and another that is in focus, its aperture a triangle."""
    scene = rendering.empty_scene(24, 24)
    made = rendering.add_camera((0, 0, 10), **camera)
    made.data.dof.use_dof = True
    made.data.dof.focus_distance, made.data.dof.aperture_fstop = 8.0, 0.02
    made.data.dof.aperture_blades, made.data.dof.aperture_rotation, made.data.dof.aperture_ratio = 3, 0.4, 1.6
    rendering.add_plane(9, rendering.emission((1, 0.5, 0.2)), (4, 5, 4))
    rendering.add_plane(9, rendering.emission((0.2, 0.5, 1)), (-5, -4, 2))
    return scene


@pytest.mark.parametrize("kind", PANORAMAS)
def test_bokeh_of_a_panoramic_camera(tmp_path, kind):
    """The lens lies across each direction, so that no pinhole could stand for one of its points."""
    open_lens(type="PANO", panorama_type=kind, fisheye_fov=2.0)
    ours, native = both(tmp_path, samples=16, seeds=range(8))
    assert native[..., :3].std() > 0.1
    rendering.assert_same_expectation(ours, native, block=2)


def test_bokeh_of_a_lens_in_focus(tmp_path):
    """All that it sees is beside it."""
    open_lens().camera.data.dof.focus_distance = 0.0
    rendering.add_plane(9, rendering.emission(), (6, 0, 10), (0, np.radians(-90), 0))
    ours, native = both(tmp_path, samples=16, seeds=range(8))
    assert native[..., :3].std() > 0.02
    rendering.assert_same_expectation(ours, native, block=4)


def test_bokeh_of_eyes_that_toe_in(tmp_path):
    scene = open_lens(lens=30.0)
    scene.render.use_multiview = True
    scene.render.image_settings.media_type = "MULTI_LAYER_IMAGE"
    scene.render.image_settings.views_format = "MULTIVIEW"
    stereo = scene.camera.data.stereo
    stereo.convergence_mode, stereo.interocular_distance, stereo.convergence_distance = "TOE", 1.5, 8.0
    use_sub_renders()

    def eyes(passes):
        return np.concatenate([passes[f"ViewLayer.Combined.{eye}"] for eye in ("left", "right")]).astype(np.float64)

    native, ours = (rendering.stack(tmp_path, engine, range(8), 16, eyes) for engine in rendering.ENGINES)
    assert native[..., :3].std() > 0.1
    rendering.assert_same_expectation(ours, native, block=2)


@pytest.mark.parametrize("kind", PANORAMAS)
def test_spherical_stereo(tmp_path, kind):
    """The left eye's picture is native's, and so, but for the slightest blur, is the right eye's."""
    scene = build_landscape(29, 23, type="PANO", panorama_type=kind, shift_x=0.1)
    scene.render.use_multiview = True
    scene.render.image_settings.media_type = "MULTI_LAYER_IMAGE"
    scene.render.image_settings.views_format = "MULTIVIEW"
    stereo = scene.camera.data.stereo
    stereo.use_spherical_stereo, stereo.use_pole_merge = True, True
    stereo.convergence_mode, stereo.interocular_distance, stereo.convergence_distance = "OFFAXIS", 0.6, 5.0
    use_sub_renders()
    ours, native = (rendering.render(tmp_path, engine) for engine in reversed(rendering.ENGINES))
    for eye, tolerance in (("left", 3e-4), ("right", 2e-3)):
        a, b = (passes[f"ViewLayer.Combined.{eye}"] for passes in (ours, native))
        wrong = np.abs(a - b).max(axis=-1) > tolerance * (1 + np.abs(b).max(axis=-1))
        assert wrong.mean() <= 0.05, f"{eye}: {wrong.mean():.1%} of the pixels differ"


def test_bokeh(tmp_path):
    """One point of light out of focus, at the distance of an object, draws the aperture."""
    rendering.empty_scene(24, 24)
    camera = rendering.add_camera((0, 0, 10), lens=50.0)
    camera.data.dof.use_dof = True
    camera.data.dof.focus_object = rendering.add(None, (1, 2, 6))
    camera.data.dof.aperture_fstop = 0.02
    camera.data.dof.aperture_blades = 5
    camera.data.dof.aperture_rotation = 0.4
    camera.data.dof.aperture_ratio = 1.6
    rendering.add_plane(0.5, rendering.emission(strength=20.0))
    ours, native = both(tmp_path, samples=16, seeds=range(8))
    assert native[..., 0].max() > 0.1
    rendering.assert_same_expectation(ours, native, block=2)


@pytest.mark.parametrize("clip_start", [0.1, 3.5])
def test_bokeh_of_an_orthographic_camera(tmp_path, clip_start):
    """The same, before planes that are cut by the near clip, or not, out of a tilted and squeezed camera."""
    rendering.empty_scene(24, 24)
    camera = rendering.add_camera((0, -3, 8), (0.3, 0, 0), type="ORTHO", ortho_scale=6.0, clip_start=clip_start)
    camera.scale = (1.0, -2.0, 0.5)
    camera.data.dof.use_dof = True
    camera.data.dof.focus_distance = 4.0
    camera.data.dof.aperture_fstop = 0.5
    camera.data.dof.aperture_blades = 3
    camera.data.dof.aperture_ratio = 0.8
    rendering.add_plane(0.5, rendering.emission(strength=20.0))
    rendering.add_plane(4, rendering.emission((0.2, 0.5, 0.1)), (0, 0, 4.5))
    ours, native = both(tmp_path, samples=16, seeds=range(8))
    assert native[..., 0].std() > 0.1
    rendering.assert_same_expectation(ours, native, block=2)


@pytest.mark.parametrize("mode", ["OFFAXIS", "PARALLEL", "TOE"])
@pytest.mark.parametrize("fit", ["HORIZONTAL", "VERTICAL"])
def test_stereo_pair(tmp_path, mode, fit):
    """The left eye's picture is native's, and so, but for the slightest blur, is the right eye's."""
    scene = build_landscape(29, 23, sensor_fit=fit, shift_x=0.1)
    scene.render.use_multiview = True
    scene.render.image_settings.media_type = "MULTI_LAYER_IMAGE"
    scene.render.image_settings.views_format = "MULTIVIEW"
    stereo = scene.camera.data.stereo
    stereo.convergence_mode, stereo.interocular_distance, stereo.convergence_distance = mode, 0.6, 5.0
    use_sub_renders()
    ours, native = (rendering.render(tmp_path, engine) for engine in reversed(rendering.ENGINES))
    assert ours.keys() == native.keys()
    for eye, tolerance in (("left", 3e-4), ("right", 2e-3)):
        a, b = (passes[f"ViewLayer.Combined.{eye}"] for passes in (ours, native))
        wrong = np.abs(a - b).max(axis=-1) > tolerance * (1 + np.abs(b).max(axis=-1))
        assert wrong.mean() <= 0.01, f"{eye}: {wrong.mean():.1%} of the pixels differ"


@pytest.mark.parametrize("motion_blur", [False, True])
def test_adaptive_subdivision(tmp_path, motion_blur):
    """Surfaces are diced for the pixels of the picture, not for the larger ones of a sub-render, at all times."""
    builders.displacement()
    scene = use_sub_renders()
    scene.render.use_motion_blur, scene.render.motion_blur_shutter = motion_blur, 1e-4
    rendering.slide(scene.camera, (0, -5.1, 5), (0, -4.9, 5))
    ours, native = (rendering.render(tmp_path, engine)["ViewLayer.Normal"] for engine in reversed(rendering.ENGINES))
    assert np.abs(ours - native).max(axis=-1).mean() < 1e-3


def test_blackman_harris_filter(tmp_path):
    """A filter wider than a pixel spreads an edge as native Cycles does."""
    scene = rendering.empty_scene(16, 16)
    scene.cycles.pixel_filter_type, scene.cycles.filter_width = "BLACKMAN_HARRIS", 1.8
    rendering.add_camera(type="ORTHO", ortho_scale=16)
    rendering.add_plane(7.3, rendering.emission())
    rendering.assert_same_expectation(*both(tmp_path, samples=16, seeds=range(8)), block=1)


def test_filters_of_our_own(tmp_path):
    """Those of the other driver, with a border that begins anywhere: its expectation, and colours that fit alpha."""
    scene = rendering.empty_scene(24, 20)
    scene.render.film_transparent = True
    scene.render.use_border = scene.render.use_crop_to_border = True
    scene.render.border_min_x, scene.render.border_max_y = 0.13, 0.9
    rendering.add_camera(type="ORTHO", ortho_scale=24)
    rendering.add_plane(7.3, rendering.emission())
    scene.spectral_tiles.filter = "MITCHELL_NETRAVALI"
    gathered = rendering.stack(tmp_path, "SPECTRAL_TILES", range(12), 4)
    use_sub_renders()
    ours = rendering.stack(tmp_path, "SPECTRAL_TILES", range(8), 4)
    rendering.assert_same_expectation(ours, gathered, block=1)
    assert np.allclose(ours[..., 0], ours[..., 3], atol=1e-5)


def test_a_tile_of_the_users(tmp_path):
    dims = ("t", "lens.u", "lens.v", "light.u", "light.v")
    # A net in random order: its own mean is close to the true one.
    values = np.random.default_rng(5).permutation(shared_sequence.values(dims, 256, seed=8)).reshape(16, 16, 1, 5)
    path = tmp_path / "tile.npz"
    generator.save_tile(generator.Tile(dims, values, {"method": "net", "seed": 8}), path)
    scenes.moving_camera_with_open_lens()
    settings = bpy.context.scene.spectral_tiles
    settings.tile, settings.tile_path = "FILE", str(path)
    plan = cell_plan.following(generator.load_tile(path), dims, 1, seed=3)
    assert np.sort(plan.t, axis=None) == pytest.approx(np.sort(values[..., 0], axis=None), abs=1e-6)
    assert len(np.unique(plan.offset)) == 256
    rendering.assert_same_expectation(*both(tmp_path, seeds=range(6)))


def test_animated_light_is_blurred(tmp_path):
    """A lamp that flashes while the shutter is open lights by its mean; Cycles takes one moment's value."""
    scene = rendering.empty_scene(8, 8)
    rendering.add_camera(type="ORTHO", ortho_scale=1)
    rendering.add_plane(10, rendering.diffuse())
    lamp = rendering.add_light("SUN", 0, (0, 0, 3))
    for frame, strength in ((1, 0.0), (1.5, 8.0), (2, 0.0)):
        lamp.data.energy = strength
        lamp.data.keyframe_insert("energy", frame=frame)
    rendering.make_linear(lamp.data)
    scene.frame_set(1)
    scene.render.use_motion_blur = True
    scene.render.motion_blur_shutter, scene.render.motion_blur_position = 1.0, "START"
    ours, native = both(tmp_path, seeds=range(4))
    lit = 0.8 / np.pi  # by a sun of strength 1
    assert ours[..., 0].mean() == pytest.approx(4.0 * lit, rel=0.04)  # sixteen jittered times a seed: 0.9 %
    assert ours[..., 0].max() > 7.0 * lit
    assert native[..., 0].mean() == pytest.approx(8.0 * lit, rel=0.01)


def glow(plane):
    """Brightens with the time."""
    tree = plane.data.materials[0].node_tree
    strength = next(node for node in tree.nodes if node.type == "EMISSION").inputs["Strength"]
    for frame, value in ((1, 0.0), (2, 2.0)):
        strength.default_value = value
        strength.keyframe_insert("default_value", frame=frame)
    rendering.make_linear(tree)


def vanish(plane):
    """Is there for the first half of the time."""
    for frame, hidden in ((1, False), (1.5, True)):
        plane.hide_render = hidden
        plane.keyframe_insert("hide_render", frame=frame)


def fall_apart(plane):
    """Loses its faces after half of the time."""
    mask = plane.modifiers.new("Mask", "MASK")
    mask.vertex_group = plane.vertex_groups.new(name="None").name
    for frame, shown in ((1, False), (1.5, True)):
        mask.show_render = shown
        mask.keyframe_insert("show_render", frame=frame)


@pytest.mark.parametrize("change", [glow, vanish, fall_apart])
def test_whatever_changes_is_blurred(tmp_path, change):
    """Materials, visibility and topology, of which Cycles takes one moment's state."""
    scene = rendering.empty_scene(8, 8)
    rendering.add_camera(type="ORTHO", ortho_scale=1)
    change(rendering.add_plane(4, rendering.emission()))
    scene.frame_set(1)
    scene.render.use_motion_blur = True
    scene.render.motion_blur_shutter, scene.render.motion_blur_position = 1.0, "START"
    use_sub_renders()
    ours, native = (rendering.beauty(rendering.render(tmp_path, engine)) for engine in reversed(rendering.ENGINES))
    seen = np.unique(ours[..., 0].round(2))
    assert len(seen) == (16 if change is glow else 2)
    assert ours[..., 0].mean() == pytest.approx({glow: 1.0, vanish: 0.5, fall_apart: 0.5}[change], abs=0.07)
    assert np.ptp(native[..., 0]) < 1e-3


def moving_scene():
    scenes.moving_camera_with_open_lens()
    scene = use_sub_renders()
    scene.render.engine = "SPECTRAL_TILES"
    scene.frame_set(1, subframe=0.25)
    return scene


def test_a_render_changes_nothing():
    moving_scene()
    before = snapshot()
    bpy.ops.render.render()
    assert snapshot() == before


def test_a_cancelled_render_changes_nothing(tmp_path, monkeypatch):
    """... and shows what was done until then."""
    scene = moving_scene()
    whole = rendering.beauty(rendering.render(tmp_path, "SPECTRAL_TILES"))
    before, render = snapshot(), sub_frames.render
    monkeypatch.setattr(subrender, "render", lambda engine, *job: render(rendering.CancelledSoon(engine, 4), *job))
    part = rendering.beauty(rendering.render(tmp_path, "SPECTRAL_TILES"))
    assert snapshot() == before
    assert scene.frame_subframe == 0.25
    done = part[..., 3] > 0
    assert done.mean() == 4 / 16
    assert np.array_equal(part[done], whole[done])


def test_a_failing_render_changes_nothing(monkeypatch):
    moving_scene()
    before, read = snapshot(), []

    def fail(engine, layer_name):
        read.append(layer_name)
        if len(read) == 3:
            raise Refused("the camera is gone")
        return mixing.read_passes(engine, layer_name)

    monkeypatch.setattr(sub_frames.film, "read_passes", fail)
    with pytest.raises(RuntimeError, match="the camera is gone"):
        bpy.ops.render.render()
    assert snapshot() == before


def test_changed_settings_are_honoured(tmp_path):
    """Persistent data must not keep the numbers or the camera of an earlier render."""
    scenes.static_scene()
    scene = use_sub_renders()
    scene.render.use_persistent_data = True
    first, again, other = (rendering.beauty(rendering.render(tmp_path, "SPECTRAL_TILES", 1, s)) for s in (0, 0, 1))
    assert np.array_equal(first, again)
    assert not np.array_equal(first, other)
    scene.camera.data.lens = 30.0
    zoomed = rendering.beauty(rendering.render(tmp_path, "SPECTRAL_TILES", 1, 0))
    assert np.abs(zoomed - first).mean() > 0.01


def two_cameras_of_one_kind(scene):
    scene.render.use_multiview, scene.render.views_format = True, "MULTIVIEW"
    scene.camera.name = "Camera_L"
    rendering.add(scene.camera.data, (1, 0, 5)).name = "Camera_R"


def cull_by_camera(scene):
    scene.render.use_simplify = scene.cycles.use_camera_cull = True


def cryptomatte_at_two_samples(scene):
    scene.spectral_tiles.samples = 2
    bpy.context.view_layer.use_pass_cryptomatte_object = True


def adapted_subset(scene):
    scene.spectral_tiles.adaptive, scene.cycles.use_sample_subset = "BUDGET", True


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (adapted_subset, "sample subset"),
        (lambda scene: setattr(scene.cycles, "rolling_shutter_type", "TOP"), "rolling shutter"),
        (lambda scene: setattr(scene.camera.data, "type", "CUSTOM"), "custom"),
        (cull_by_camera, "Camera Culling"),
        (two_cameras_of_one_kind, "share the data"),
        (lambda scene: setattr(bpy.context.view_layer, "use_pass_vector", True), "Vector pass"),
        (cryptomatte_at_two_samples, "Cryptomatte"),
    ],
)
def test_what_it_cannot_do_is_named(change, message):
    change(moving_scene())
    before = snapshot()
    with pytest.raises(RuntimeError, match=message):
        bpy.ops.render.render()
    assert snapshot() == before


def test_chosen_where_gather_cannot_run(tmp_path, extension, monkeypatch):
    """Without Open Shading Language and OpenImageIO the automatic driver is this one."""
    scenes.static_scene()
    wanted = rendering.beauty(rendering.render(tmp_path, "SPECTRAL_TILES"))
    use_sub_renders()
    ours = rendering.beauty(rendering.render(tmp_path, "SPECTRAL_TILES"))
    assert not np.array_equal(ours, wanted)
    bpy.context.scene.spectral_tiles.driver = "AUTO"
    monkeypatch.setattr(extension.engine.cycles, "with_osl", lambda: False)
    assert np.array_equal(rendering.beauty(rendering.render(tmp_path, "SPECTRAL_TILES")), ours)
