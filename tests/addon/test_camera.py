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


def assert_same(folder, names=("Combined",)):
    ours = rendering.render(folder, "SPECTRAL_TILES")
    native = rendering.render(folder, "CYCLES")
    for name in names:
        a, b = ours[f"ViewLayer.{name}"], native[f"ViewLayer.{name}"]
        assert a.shape == b.shape
        wrong = np.abs(a - b).max(axis=-1) > TOLERANCE * (1 + np.abs(b).max(axis=-1))
        assert wrong.mean() <= ALLOWED_OUTLIERS, f"{name}: {wrong.mean():.1%} of the pixels differ"


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
    rendering.empty_scene(24, 24)
    camera = rendering.add_camera((0, 0, 10), type=kind, ortho_scale=6.0, lens=50.0)
    camera.data.dof.use_dof = True
    camera.data.dof.focus_distance = 4.0
    camera.data.dof.aperture_fstop = 0.3 if kind == "ORTHO" else 0.02
    camera.data.dof.aperture_blades = blades
    camera.data.dof.aperture_rotation = 0.4
    camera.data.dof.aperture_ratio = 1.6
    rendering.add_plane(0.5, rendering.emission(strength=20.0))
    seeds = range(8)
    ours, native = (rendering.stack(tmp_path, engine, seeds, samples=64) for engine in reversed(rendering.ENGINES))
    assert native[..., 0].max() > 0.1
    rendering.assert_same_expectation(ours, native, block=2)
