# SPDX-License-Identifier: GPL-3.0-or-later
"""What the user excluded from motion blur, kept as it is at the frame while the scene goes to other moments.

Cycles leaves out an object whose *Motion Blur* is off, and the shape of one whose *Deformation* is off
(`object_use_motion`, `object_use_deform_motion` of `blender/util.h`).  Between moments that are rendered one by one it
would move all the same, so what was evaluated is overwritten.  That reaches objects of the scene and the vertices of
meshes; it does not reach inside instances, other kinds of geometry, or meshes whose topology changes meanwhile.
"""

import numpy as np

from ..blender.evaluated import values


class Standstill:
    """Excluded objects, as they are now.

    Parameters
    ----------
    depsgraph : bpy.types.Depsgraph
        At the frame.
    """

    def __init__(self, depsgraph):
        self._depsgraph = depsgraph
        self._placed, self._shaped, self._cameras = [], [], []
        for obj in depsgraph.objects:
            moves = obj.cycles.use_motion_blur
            if moves and obj.cycles.use_deform_motion:
                continue
            if not moves:
                self._placed.append((obj.original, obj.matrix_world.copy()))
            if obj.type == "MESH":
                self._shaped.append((obj.original, _vertices(obj.data)))
            elif obj.type == "CAMERA" and not moves:
                self._cameras.append((obj.original, values(obj.data)))

    def hold(self, written):
        """Make them, in the evaluated scene of another moment, what they were, by an `Overwritten`."""
        for original, vertices in self._shaped:
            mesh = original.evaluated_get(self._depsgraph).data
            now = _vertices(mesh)
            if now.shape == vertices.shape and not np.array_equal(now, vertices):
                # The next moment's evaluation makes the mesh anew, and with it the vertices.
                mesh.vertices.foreach_set("co", vertices)
                mesh.update()
        for original, matrix in self._placed:
            obj = original.evaluated_get(self._depsgraph)
            if obj.matrix_world != matrix:
                written.move(obj, matrix)
        for original, before in self._cameras:
            data = original.evaluated_get(self._depsgraph).data
            written.set(data, **{name: value for name, value in before.items() if getattr(data, name) != value})


def _vertices(mesh):
    found = np.empty(3 * len(mesh.vertices), np.float32)
    mesh.vertices.foreach_get("co", found)
    return found
