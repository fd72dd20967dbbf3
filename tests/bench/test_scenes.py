# SPDX-License-Identifier: GPL-3.0-or-later
from importlib import import_module

import bpy
import pytest

from bench.scene_files import scene_file
from bench.scenes import BUILDERS

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


def test_unknown_scene():
    with pytest.raises(ValueError, match="no scene 'nowhere'; known are wheels"):
        scene_file("nowhere")


def test_missing_file():
    with pytest.raises(ValueError, match=r"no such file: nowhere\.blend"):
        scene_file("nowhere.blend")
