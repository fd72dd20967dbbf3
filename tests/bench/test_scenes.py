# SPDX-License-Identifier: GPL-3.0-or-later
from importlib import import_module

import bpy
import numpy as np
import pytest

from bench.scene_files import scene_file
from bench.scenes import BUILDERS, PRODUCTION

#: What each scene is there for: motion blur, an open lens, and how many lamps (sun and sky counting one).
KINDS = {
    "wheels": (True, True, 1),
    "cubes": (True, False, 1),
    "room": (False, True, 4),
    "sun_sky": (True, False, 1),
    "metal": (False, False, 0),
    "fur": (True, False, 2),
    "bokeh": (False, True, 1),
    "neon": (True, False, 0),
    "still_life": (False, False, 3),
    "hazy_room": (False, True, 4),
    "heavy": (True, False, 1),
    "meadow": (True, True, 1),
    "glassware": (False, True, 4),
    "candles": (False, True, 12),
    "misty_wood": (True, False, 1),
    "night_market": (True, True, 50),
    "creature": (True, True, 3),
}

#: Nodes, modifiers and objects that make each production scene costly.
COSTLY_PARTS = {
    "meadow": {"DISPLACEMENT", "TEX_NOISE", "SUBSURF", "DISPLACE", "NODES"},
    "glassware": {"TEX_BRICK", "TEX_NOISE", "BUMP", "SUBSURF", "transmission", "subsurface"},
    "candles": {"DISPLACEMENT", "TEX_VORONOI", "SUBSURF", "META", "subsurface"},
    "misty_wood": {"VOLUME_SCATTER", "DISPLACEMENT", "SUBSURF", "NODES", "COLLECTION"},
    "night_market": {"TEX_VORONOI", "TEX_BRICK", "BUMP", "COLLECTION"},
    "creature": {"BSDF_HAIR_PRINCIPLED", "CURVES", "SUBSURF", "DISPLACE", "subsurface"},
}


@pytest.mark.parametrize("name", KINDS)
def test_scene_is_of_its_kind(name):
    scene = import_module(BUILDERS[name]).build()
    lamps = sum(obj.type == "LIGHT" for obj in scene.objects)
    assert scene == bpy.context.scene
    assert scene.render.engine == "CYCLES"
    assert (scene.render.use_motion_blur, scene.camera.data.dof.use_dof, lamps) == KINDS[name]


def test_heavy_scene_is_heavy():
    scene = import_module(BUILDERS["heavy"]).build()
    assert len(scene.objects) == 2000 + 2  # and the light and the camera


def _parts(scene):
    """Return types of shader nodes, modifiers, objects and instances, and which weights of Principled are used."""
    nodes = [node for made in bpy.data.materials if made.node_tree for node in made.node_tree.nodes]
    things = [*scene.objects, *bpy.data.objects]
    found = {node.type for node in nodes} | {modifier.type for thing in things for modifier in thing.modifiers}
    found |= {thing.type for thing in things} | {thing.instance_type for thing in things}
    for node in nodes:
        for weight in ("Transmission", "Subsurface"):
            socket = node.inputs.get(f"{weight} Weight")
            if socket is not None and socket.default_value:
                found.add(weight.lower())
    return found


@pytest.mark.parametrize("name", PRODUCTION)
def test_production_scene_has_its_costly_parts_and_a_picture(name, tmp_path):
    scene = import_module(BUILDERS[name]).build()
    assert COSTLY_PARTS[name] <= _parts(scene)
    scene.cycles.samples = 1
    scene.cycles.use_denoising = False
    scene.render.resolution_x = scene.render.resolution_y = 16
    scene.render.resolution_percentage = 100
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.filepath = str(tmp_path / "picture.exr")
    bpy.ops.render.render(write_still=True)
    pixels = np.array(bpy.data.images.load(scene.render.filepath).pixels)
    assert np.isfinite(pixels).all()
    assert pixels.reshape(-1, 4)[:, :3].std() > 0


@pytest.mark.parametrize(("name", "count"), [("meadow", 5000), ("night_market", 1000)])
def test_instances_are_many(name, count):
    import_module(BUILDERS[name]).build()
    assert sum(each.is_instance for each in bpy.context.evaluated_depsgraph_get().object_instances) >= count


def test_all_production_scenes_are_checked():
    assert set(PRODUCTION) == set(COSTLY_PARTS)


def test_unknown_scene():
    with pytest.raises(ValueError, match="no scene 'nowhere'; known are wheels"):
        scene_file("nowhere")


def test_missing_file():
    with pytest.raises(ValueError, match=r"no such file: nowhere\.blend"):
        scene_file("nowhere.blend")
