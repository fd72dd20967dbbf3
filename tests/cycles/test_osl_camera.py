# SPDX-License-Identifier: GPL-3.0-or-later
"""Our camera sends rays where Cycles' own cameras send them.

In a scene without anything random one sample a pixel has one possible result, so the plan may move pixels as it likes
and every pass must still equal native Cycles'.
"""

import bpy
import numpy as np
import pytest

from tests import rendering

# Positions in the probe scene are a few units; a ray may hit the next triangle's edge by rounding.
TOLERANCE = 2e-4
ALLOWED_OUTLIERS = 0.004


def build_scene(width=61, height=43, **camera):
    """A bumpy emissive landscape whose colour is its position; nothing in it is random."""
    scene = rendering.empty_scene(width, height)
    scene.spectral_tiles.method = "GATHER"
    rendering.add_camera((1, -6, 4), (np.radians(58), 0, np.radians(8)), **camera)
    material = rendering.emission()
    tree = material.node_tree
    position = tree.nodes.new("ShaderNodeNewGeometry").outputs["Position"]
    shifted = tree.nodes.new("ShaderNodeVectorMath")
    shifted.inputs[1].default_value = (40, 40, 40)
    tree.links.new(position, shifted.inputs[0])
    tree.links.new(shifted.outputs[0], next(n for n in tree.nodes if n.type == "EMISSION").inputs["Color"])
    rendering.add_plane(30, material)
    for x, y in ((-1.5, 0), (0.5, 1.5), (2, -1)):
        bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=2, radius=0.8, location=(x, y, 0.5))
        bpy.context.object.data.materials.append(material)
    return scene


def assert_same(folder, names=("Combined",), allowed=ALLOWED_OUTLIERS):
    ours = rendering.render(folder, "SPECTRAL_TILES")
    native = rendering.render(folder, "CYCLES")
    for name in names:
        a, b = ours[f"ViewLayer.{name}"], native[f"ViewLayer.{name}"]
        assert a.shape == b.shape
        wrong = np.abs(a - b).max(axis=-1) > TOLERANCE * (1 + np.abs(b).max(axis=-1))
        assert wrong.mean() <= allowed, f"{name}: {wrong.mean():.1%} of the pixels differ"


@pytest.mark.parametrize(
    "camera",
    [
        {"lens": 24.0},
        {"sensor_fit": "VERTICAL", "sensor_height": 30.0},
        {"sensor_fit": "HORIZONTAL", "sensor_width": 20.0},
        {"shift_x": 0.3, "shift_y": -0.2},
        {"clip_start": 6.0, "clip_end": 1000.0},
        {"type": "ORTHO", "ortho_scale": 7.0},
        {"type": "ORTHO", "ortho_scale": 5.0, "shift_x": -0.25, "clip_start": 5.5},
    ],
    ids=lambda camera: ",".join(f"{name}={value}" for name, value in camera.items()),
)
def test_projection(tmp_path, camera):
    build_scene(**camera)
    assert_same(tmp_path)


@pytest.mark.parametrize(
    ("width", "height", "percentage"), [(61, 43, 100), (40, 90, 100), (1, 1, 100), (101, 67, 50), (7, 300, 33)]
)
def test_size(tmp_path, width, height, percentage):
    scene = build_scene(width, height)
    scene.render.resolution_percentage = percentage
    assert_same(tmp_path)


def no_view(scene):
    scene.render.use_multiview = True
    for view in scene.render.views:
        view.use = False


def shut_all_the_time(scene):
    scene.render.use_motion_blur = True
    mapping = scene.render.motion_blur_shutter_curve
    for point in mapping.curves[0].points:
        point.location[1] = 0.0
    mapping.update()


def far_frame(scene):
    scene.cycles.seed, scene.cycles.use_animated_seed = 2**31 - 1, True
    scene.frame_set(1048574)


def sheared(scene):
    parent = rendering.add(None, (0, 0, 0), (0, 0, 0.5))
    parent.scale = (1, 2, 1)
    scene.camera.parent = parent


@pytest.mark.parametrize(
    "change",
    [
        lambda scene: setattr(scene.cycles, "tile_size", 8),
        lambda scene: setattr(scene.camera, "scale", (-2, 1, 0.5)),
        lambda scene: setattr(scene.camera, "scale", (0, 0, 0)),
        lambda scene: setattr(scene.render, "pixel_aspect_x", 200),
        lambda scene: setattr(scene.render, "motion_blur_shutter", 0.0),
        sheared,
        shut_all_the_time,
        far_frame,
    ],
    ids=["tiles", "mirrored", "flattened", "aspect", "shutter", "sheared", "shut", "far_frame"],
)
def test_the_unusual(tmp_path, change):
    scene = build_scene()
    scene.render.use_motion_blur = True
    change(scene)
    ours = rendering.beauty(rendering.render(tmp_path, "SPECTRAL_TILES", seed=scene.cycles.seed))
    native = rendering.beauty(rendering.render(tmp_path, "CYCLES", seed=scene.cycles.seed))
    wrong = np.abs(ours - native).max(axis=-1) > 2 * TOLERANCE * (1 + np.abs(native).max(axis=-1))
    assert wrong.mean() <= ALLOWED_OUTLIERS


def test_stereo_without_a_view(tmp_path):
    no_view(build_scene())
    assert_same(tmp_path)


def test_as_many_samples_as_there_may_be(tmp_path):
    """The plan is as good as it is at fewer, and as soon made."""
    build_scene(8, 6)
    assert np.allclose(*(rendering.beauty(rendering.render(tmp_path, e, 4096)) for e in rendering.ENGINES), rtol=1e-2)


def test_pixel_aspect(tmp_path):
    scene = build_scene()
    scene.render.pixel_aspect_x, scene.render.pixel_aspect_y = 1.0, 1.7
    assert_same(tmp_path)


@pytest.mark.parametrize("crop", [False, True])
def test_border(tmp_path, crop):
    scene = build_scene()
    scene.render.use_border, scene.render.use_crop_to_border = True, crop
    scene.render.border_min_x, scene.render.border_max_x = 0.21, 0.83
    scene.render.border_min_y, scene.render.border_max_y = 0.36, 0.74
    assert_same(tmp_path)


@pytest.mark.parametrize("kind", ["PERSP", "ORTHO"])
def test_depth_and_data_passes(tmp_path, kind):
    build_scene(type=kind)
    layer = bpy.context.view_layer
    layer.use_pass_z = layer.use_pass_normal = layer.use_pass_position = layer.use_pass_object_index = True
    assert_same(tmp_path, ("Combined", "Depth", "Normal", "Position", "Object Index"))


def test_film_transparent(tmp_path):
    scene = build_scene()
    scene.render.film_transparent = True
    bpy.data.objects.remove(bpy.data.objects["Plane"])
    assert_same(tmp_path)


def test_two_view_layers(tmp_path):
    build_scene()
    scene = bpy.context.scene
    other = scene.view_layers.new("Other")
    other.use_pass_normal = True
    other.material_override = rendering.emission((0.2, 0.5, 0.7))
    ours, native = (rendering.render(tmp_path, engine) for engine in reversed(rendering.ENGINES))
    assert ours.keys() == native.keys()
    for name in ("ViewLayer.Combined", "Other.Combined", "Other.Normal"):
        wrong = np.abs(ours[name] - native[name]).max(axis=-1) > 0.01
        assert wrong.mean() <= ALLOWED_OUTLIERS


def test_camera_motion(tmp_path):
    """A moving camera before a scene at rest: the mean over many seeds is the native one."""
    scene = build_scene(24, 16)
    rendering.slide(scene.camera, (0.5, -6, 4), (1.5, -6, 4.4))
    scene.render.use_motion_blur = True
    seeds = range(40)
    ours, native = (rendering.stack(tmp_path, engine, seeds) for engine in reversed(rendering.ENGINES))
    rendering.assert_same_expectation(ours, native)


@pytest.mark.parametrize("blades", [0, 5])
@pytest.mark.parametrize("kind", ["PERSP", "ORTHO"])
def test_bokeh(tmp_path, blades, kind):
    """One point of light out of focus draws the aperture: its mean over many samples is the native one."""
    rendering.empty_scene(24, 24).spectral_tiles.method = "GATHER"
    camera = rendering.add_camera((0, 0, 10), type=kind, ortho_scale=6.0, lens=50.0)
    camera.data.dof.use_dof = True
    camera.data.dof.focus_distance = 4.0
    camera.data.dof.aperture_fstop = 0.3 if kind == "ORTHO" else 0.02
    camera.data.dof.aperture_blades = blades
    camera.data.dof.aperture_rotation = 0.4
    camera.data.dof.aperture_ratio = 1.6
    rendering.add_plane(0.5, rendering.emission(strength=20.0))
    seeds = range(24)
    ours, native = (rendering.stack(tmp_path, engine, seeds, samples=64) for engine in reversed(rendering.ENGINES))
    assert native[..., 0].max() > 0.1
    rendering.assert_same_expectation(ours, native, block=2)


PANORAMAS = [
    {"panorama_type": "EQUIRECTANGULAR", "longitude_min": -2.0, "longitude_max": 1.0, "latitude_max": 0.9},
    {"panorama_type": "EQUIANGULAR_CUBEMAP_FACE", "shift_x": 0.1},
    {"panorama_type": "MIRRORBALL"},
    {"panorama_type": "FISHEYE_EQUIDISTANT", "fisheye_fov": 2.0},
    {"panorama_type": "FISHEYE_EQUISOLID", "fisheye_fov": 2.4, "fisheye_lens": 14.0, "shift_y": 0.05},
    {"panorama_type": "FISHEYE_LENS_POLYNOMIAL", "sensor_fit": "VERTICAL", "fisheye_polynomial_k2": -1e-4},
    {"panorama_type": "CENTRAL_CYLINDRICAL", "central_cylindrical_range_u_max": 0.6,
     "central_cylindrical_range_v_min": -1.4, "central_cylindrical_radius": 1.3},
]  # fmt: skip


@pytest.mark.parametrize("panorama", PANORAMAS, ids=lambda panorama: panorama["panorama_type"])
def test_panorama(tmp_path, panorama):
    build_scene(type="PANO", clip_start=2.0, clip_end=30.0, **panorama)
    layer = bpy.context.view_layer
    layer.use_pass_z = layer.use_pass_mist = True
    native = rendering.beauty(rendering.render(tmp_path, "CYCLES"))
    assert (native.max(axis=-1) > 1).mean() > 0.2
    assert_same(tmp_path, ("Combined", "Depth", "Mist"), allowed=0.015)


@pytest.mark.parametrize("blades", [0, 5])
@pytest.mark.parametrize("panorama", ["EQUIRECTANGULAR", "MIRRORBALL", "FISHEYE_EQUIDISTANT"])
def test_bokeh_of_panoramas(tmp_path, panorama, blades):
    """Off the axis the lens lies across the ray, so the light's disc is Cycles' only if its frame is."""
    rendering.empty_scene(24, 24).spectral_tiles.method = "GATHER"
    camera = rendering.add_camera((0, 0, 10), type="PANO", panorama_type=panorama, fisheye_fov=1.5, lens=50.0)
    if panorama == "EQUIRECTANGULAR":
        camera.data.longitude_min, camera.data.longitude_max = -0.8, 0.8
        camera.data.latitude_min, camera.data.latitude_max = -0.8, 0.8
    camera.data.dof.use_dof = True
    camera.data.dof.focus_distance = 4.0
    camera.data.dof.aperture_fstop = 0.02
    camera.data.dof.aperture_blades = blades
    camera.data.dof.aperture_rotation = 0.4
    camera.data.dof.aperture_ratio = 1.6
    # The mirror ball's middle looks back along the camera's axis.
    side = 1 if panorama == "MIRRORBALL" else -1
    rendering.add_plane(0.8, rendering.emission(strength=20.0), (1.8, 1.2, 10 + 8 * side))
    seeds = range(24)
    ours, native = (rendering.stack(tmp_path, engine, seeds, samples=64) for engine in reversed(rendering.ENGINES))
    assert native[..., 0].max() > 0.05
    rendering.assert_same_expectation(ours, native, block=2)


STEREO = [
    {"convergence_mode": "OFFAXIS"},
    {"convergence_mode": "OFFAXIS", "pivot": "LEFT"},
    {"convergence_mode": "OFFAXIS", "pivot": "RIGHT"},
    {"convergence_mode": "PARALLEL"},
    {"convergence_mode": "TOE"},
]


def make_stereo(camera, **settings):
    render = bpy.context.scene.render
    render.use_multiview, render.views_format = True, "STEREO_3D"
    render.image_settings.media_type = "MULTI_LAYER_IMAGE"
    render.image_settings.views_format = "MULTIVIEW"
    camera.data.stereo.interocular_distance, camera.data.stereo.convergence_distance = 0.5, 5.0
    for name, value in settings.items():
        setattr(camera.data.stereo, name, value)
    bpy.context.view_layer.use_pass_z = True


BOTH_EYES = ("Combined.left", "Combined.right", "Depth.left", "Depth.right")


@pytest.mark.parametrize("stereo", STEREO, ids=lambda stereo: "-".join(stereo.values()))
def test_stereo(tmp_path, stereo):
    scene = build_scene(shift_x=0.1, sensor_fit="VERTICAL", sensor_height=20)
    make_stereo(scene.camera, **stereo)
    assert_same(tmp_path, BOTH_EYES)


@pytest.mark.parametrize("kind", ["ORTHO", "PANO"])
@pytest.mark.parametrize("convergence", ["OFFAXIS", "TOE"])
def test_stereo_of_other_cameras(tmp_path, kind, convergence):
    scene = build_scene(type=kind, panorama_type="FISHEYE_EQUIDISTANT")
    make_stereo(scene.camera, convergence_mode=convergence)
    assert_same(tmp_path, BOTH_EYES, allowed=0.01)


@pytest.mark.parametrize("panorama", ["EQUIRECTANGULAR", "MIRRORBALL"])
@pytest.mark.parametrize("convergence", ["OFFAXIS", "PARALLEL"])
@pytest.mark.parametrize("pole_merge", [False, True])
def test_spherical_stereo(tmp_path, panorama, convergence, pole_merge):
    scene = build_scene(type="PANO", panorama_type=panorama)
    make_stereo(scene.camera, use_spherical_stereo=True, convergence_mode=convergence, use_pole_merge=pole_merge,
                pole_merge_angle_from=0.3, pole_merge_angle_to=0.9, pivot="LEFT")  # fmt: skip
    assert_same(tmp_path, BOTH_EYES, allowed=0.01)


def test_views_with_cameras_of_their_own(tmp_path):
    scene = build_scene()
    scene.camera.name = "Camera_L"
    other = rendering.add_camera((2, -7, 4), (np.radians(58), 0, np.radians(20)), lens=30.0)
    other.name = "Camera_R"
    scene.camera = bpy.data.objects["Camera_L"]
    make_stereo(scene.camera)
    scene.render.views_format = "MULTIVIEW"
    assert_same(tmp_path, BOTH_EYES)
