# SPDX-License-Identifier: GPL-3.0-or-later
from pathlib import Path

import bpy
import pytest

from demo_blend import spinning_wheels

FILE = Path(spinning_wheels.__file__).with_suffix(".blend")


def _state(scene: bpy.types.Scene) -> dict:
    """Return what the picture depends on most: the engine, the lens and where everything is at two frames."""
    state = {"engine": scene.render.engine, "blur": scene.render.use_motion_blur}
    state["fstop"] = scene.camera.data.dof.aperture_fstop
    for frame in (1, 12):
        scene.frame_set(frame)
        for obj in scene.objects:
            state[frame, obj.name] = [pytest.approx(list(row), abs=1e-5) for row in obj.matrix_world]
    return state


def test_committed_file_is_what_the_builder_makes():
    built = _state(spinning_wheels.build())
    bpy.ops.wm.open_mainfile(filepath=str(FILE), load_ui=False)
    opened = bpy.context.scene
    assert built.keys() == _state(opened).keys()
    for frame in (1, 12):
        opened.frame_set(frame)
        for obj in opened.objects:
            assert [list(row) for row in obj.matrix_world] == built[frame, obj.name]


def test_committed_file_is_small():
    assert FILE.stat().st_size < 2e6


def test_wheels_turn_at_constant_speed():
    scene = spinning_wheels.build()
    rim = bpy.data.objects["Middle rim"]
    angles = []
    for frame in (2, 3, 20, 21, 40, 41):  # the last two lie after the last key
        scene.frame_set(frame)
        angles.append(rim.rotation_euler.z)
    steps = [angles[i + 1] - angles[i] for i in (0, 2, 4)]
    assert steps == pytest.approx([steps[0]] * 3, abs=1e-4)
    assert abs(steps[0]) > 0.1
