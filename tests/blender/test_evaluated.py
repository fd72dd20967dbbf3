# SPDX-License-Identifier: GPL-3.0-or-later
"""What is written to data for a render is put back as it was."""

import bpy
import pytest

from addon.blender import evaluated


@pytest.fixture
def data():
    """A camera of which no value is Blender's own."""
    made = bpy.data.cameras.new("wide")
    made.sensor_width, made.lens, made.clip_end = 70.0, 50.0, 300.0
    yield made
    bpy.data.cameras.remove(made)


def test_a_camera_that_was_written_to(data):
    before, written = evaluated.values(data), evaluated.Overwritten()
    written.keep(data, *before)
    data.sensor_width, data.clip_end = 20.0, 1.0
    written.set(data, shift_x=0.5)
    written.put_back()
    assert evaluated.values(data) == before


def test_an_object_that_was_moved():
    made = bpy.data.objects.new("turned", None)
    made.rotation_mode, made.rotation_axis_angle, made.location = "AXIS_ANGLE", (0.5, 0.0, 1.0, 0.0), (1.0, 2.0, 3.0)
    before, written = made.matrix_basis.copy(), evaluated.Overwritten()
    written.keep(made, "location", "rotation_axis_angle")
    made.location, made.rotation_axis_angle = (0.0, 0.0, 0.0), (1.0, 1.0, 0.0, 0.0)
    written.put_back()
    assert made.matrix_basis == before
    bpy.data.objects.remove(made)


def test_a_copy_of_a_camera(data):
    other = bpy.data.cameras.new("other")
    evaluated.put_back(other, {name: value for name, value in evaluated.values(data).items() if name != "name"})
    assert (other.lens, other.sensor_width, other.angle) == (data.lens, data.sensor_width, data.angle)
    bpy.data.cameras.remove(other)
