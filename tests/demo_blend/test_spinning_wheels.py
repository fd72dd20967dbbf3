# SPDX-License-Identifier: GPL-3.0-or-later
import bpy
import pytest

from demo_blend import spinning_wheels


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
