# SPDX-License-Identifier: GPL-3.0-or-later
"""Evaluated data that is written to for a render, and put back as it was."""

import bpy


def render_settings(engine):
    """The settings of an engine's render, its own copy; `engine.render` is a method, which hides them."""
    return engine.path_resolve("render")


def values(owner):
    """All plain values of a part of the evaluated scene, by name."""
    return {
        prop.identifier: getattr(owner, prop.identifier)
        for prop in owner.bl_rna.properties
        if not prop.is_readonly
        and prop.type in {"BOOLEAN", "INT", "FLOAT", "STRING", "ENUM"}
        and not getattr(prop, "is_array", False)
    }


def put_back(owner, before):
    """Undo what was written to a part of the evaluated scene since `values`.

    From the last to the first, since a camera's angle follows from its lens and sensor, which come after it.
    """
    for name in reversed(before):
        if getattr(owner, name) != before[name]:
            setattr(owner, name, before[name])


class Overwritten:
    """Values written to evaluated data, which can be put back.

    The next frame's evaluation starts from what it finds, so nothing of ours may be there.
    """

    def __init__(self):
        self._previous = {}

    def set(self, owner, **values):
        self.keep(owner, *values)
        for name, value in values.items():
            setattr(owner, name, value)

    def keep(self, owner, *names):
        """Remember values that will be written."""
        _, previous = self._previous.setdefault((owner.as_pointer(), owner.bl_rna.identifier), (owner, {}))
        for name in names:
            if name not in previous:
                value = getattr(owner, name)
                # Blender's own arrays change with what is written, and have no copy.
                is_array = isinstance(value, bpy.types.bpy_prop_array)
                previous[name] = value.copy() if hasattr(value, "copy") else value[:] if is_array else value

    def move(self, obj, matrix):
        """Put an evaluated object elsewhere; with the matrix Blender writes what it is made of."""
        self.keep(obj, "location", "rotation_euler", "rotation_quaternion", "rotation_axis_angle", "scale")
        self.set(obj, matrix_world=matrix)

    def put_back(self):
        """Make everything what it was."""
        while self._previous:
            put_back(*self._previous.popitem()[1])
