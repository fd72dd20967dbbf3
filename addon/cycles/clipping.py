# SPDX-License-Identifier: GPL-3.0-or-later
"""Whether a camera's far clip cuts anything that can be seen, which a custom camera would do along the ray instead."""

import numpy as np


def messages(depsgraph, camera):
    """Why a picture by the plan's camera would not end at the far clip where the user's does.

    Parameters
    ----------
    depsgraph : bpy.types.Depsgraph
        Evaluated.
    camera : bpy.types.Object
        The scene's.

    Returns
    -------
    list of str
        One line, or none.
    """
    data = camera.data
    if data.type != "PERSP":
        return []  # Cycles clips panoramas along the ray, and rays of an orthographic camera run along its axis
    axis = -np.array(camera.matrix_world.to_3x3().normalized())[:, 2]
    eye = np.array(camera.matrix_world.translation)
    for instance in depsgraph.object_instances:
        corners = np.ones((8, 4))
        corners[:, :3] = instance.object.bound_box
        depth = (corners @ np.array(instance.matrix_world).T[:, :3] - eye) @ axis
        if depth.max() > data.clip_end:
            return [
                f'"{instance.object.name}" reaches beyond the far clip of camera "{camera.name}", which Gather cannot '
                "cut; raise Clip End, or set Method to In Place"
            ]
    return []
