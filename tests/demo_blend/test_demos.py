# SPDX-License-Identifier: GPL-3.0-or-later
from importlib import import_module
from pathlib import Path

import bpy
import numpy as np
import pytest

import demo_blend
from demo_blend import files

FOLDER = Path(demo_blend.__file__).parent

#: Motion blur, open lens, corners of the lens and lamps of each scene.
KINDS = {
    "spinning_wheels": (True, True, 0, 1),
    "motion_blur": (True, False, 0, 1),
    "square_lens": (False, True, 4, 1),
    "round_lens": (False, True, 0, 1),
    "glossy_reflection": (False, False, 0, 1),
    "moving_penumbra": (True, False, 0, 1),
    "interior": (False, True, 0, 4),
    "windy_forest": (True, False, 0, 1),
    "dandelion": (True, True, 0, 2),
    "swinging_lamp": (True, False, 0, 1),
    "blinking_signs": (True, False, 0, 0),
}


def _state(scene: bpy.types.Scene) -> dict:
    """Return what the picture depends on most: engine, camera, and where everything is at two frames."""
    camera = scene.camera.data
    state = {"engine": scene.render.engine, "blur": scene.render.use_motion_blur, "bounces": scene.cycles.max_bounces}
    state |= {"lens": camera.lens, "fstop": camera.dof.aperture_fstop, "blades": camera.dof.aperture_blades}
    for frame in (1, 12):
        scene.frame_set(frame)
        for obj in scene.objects:
            state[frame, obj.name] = np.array(obj.matrix_world)
        state |= {(frame, light.name): light.energy for light in bpy.data.lights}
        for keys in bpy.data.shape_keys:
            state |= {(frame, keys.name, block.name): block.value for block in keys.key_blocks}
    for mesh in bpy.data.meshes:
        corners = np.empty(3 * len(mesh.vertices), np.float32)
        mesh.vertices.foreach_get("co", corners)
        state["mesh", mesh.name] = corners
    return state


@pytest.mark.parametrize("name", demo_blend.DEMOS)
def test_committed_file_is_what_the_builder_makes(name):
    scene = import_module(f"demo_blend.{name}").build()
    lamps = sum(obj.type == "LIGHT" for obj in scene.objects)
    dof = scene.camera.data.dof
    assert (scene.render.use_motion_blur, dof.use_dof, dof.aperture_blades, lamps) == KINDS[name]
    built = _state(scene)

    path = FOLDER / f"{name}.blend"
    assert path.stat().st_size < 2e6
    bpy.ops.wm.open_mainfile(filepath=str(path), load_ui=False)
    opened = _state(bpy.context.scene)
    assert opened.keys() == built.keys()
    for key, value in built.items():
        if isinstance(value, str):
            assert opened[key] == value
        else:
            np.testing.assert_allclose(opened[key], value, atol=1e-5, err_msg=str(key))


def test_nothing_but_time_is_left_to_sample_in_the_motion_blur_scene(tmp_path):
    scene = import_module("demo_blend.motion_blur").build()
    scene.render.use_motion_blur = False
    assert _spread_over_seeds(scene, tmp_path) == 0.0
    scene.render.use_motion_blur = True
    assert _spread_over_seeds(scene, tmp_path) > 0.01


@pytest.mark.parametrize("name", ["square_lens", "round_lens"])
def test_nothing_but_the_lens_is_left_to_sample_in_the_lens_scenes(name, tmp_path):
    scene = import_module(f"demo_blend.{name}").build()
    scene.camera.data.dof.use_dof = False
    assert _spread_over_seeds(scene, tmp_path) == 0.0
    scene.camera.data.dof.use_dof = True
    assert _spread_over_seeds(scene, tmp_path) > 0.01


def test_nothing_but_the_reflection_is_left_to_sample_in_the_glossy_scene(tmp_path):
    scene = import_module("demo_blend.glossy_reflection").build()
    roughness = bpy.data.materials["Plate"].node_tree.nodes["Principled BSDF"].inputs["Roughness"]
    rough, roughness.default_value = roughness.default_value, 0.0
    assert _spread_over_seeds(scene, tmp_path) == 0.0
    roughness.default_value = rough
    assert _spread_over_seeds(scene, tmp_path) > 0.01


def _spread_over_seeds(scene: bpy.types.Scene, folder: Path) -> float:
    """Return the largest difference between two renders with different seeds, one sample a pixel."""
    scene.render.resolution_x, scene.render.resolution_y = 96, 54
    scene.cycles.samples = 1
    scene.cycles.use_adaptive_sampling = scene.cycles.use_denoising = False
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.filepath = str(folder / "image.exr")
    images = []
    for seed in (0, 1):
        scene.cycles.seed = seed
        bpy.ops.render.render(write_still=True)
        image = bpy.data.images.load(scene.render.filepath, check_existing=False)
        images.append(np.array(image.pixels))
        bpy.data.images.remove(image)
    return float(np.abs(images[0] - images[1]).max())


@pytest.mark.parametrize("name", demo_blend.DEMOS)
def test_file_opens_ready_to_show_the_product(extension, name):
    bpy.ops.wm.open_mainfile(filepath=str(FOLDER / f"{name}.blend"))
    scene = bpy.context.scene
    assert scene.render.engine == "CYCLES" and scene.spectral_tiles.enabled
    assert (scene.spectral_tiles.method == "SUB_FRAMES") == (name in files.SUB_FRAMES)
    assert scene.cycles.use_adaptive_sampling != (name in files.SUB_FRAMES) and scene.cycles.use_denoising
    spaces = [space for screen in bpy.data.screens for area in screen.areas for space in area.spaces]
    views = [space.region_3d.view_perspective for space in spaces if space.type == "VIEW_3D"]
    assert views and set(views) == {"CAMERA"}
