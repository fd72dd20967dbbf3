# SPDX-License-Identifier: GPL-3.0-or-later
"""What a custom camera in the place of the scene's cannot show as that would.

Shading may ask where the camera is looking: window coordinates have no inverse of a custom camera
(`camera_world_to_ndc` of Cycles), and camera space has other axes for a panorama than for a custom camera.  And the far
clip cuts along the ray instead of the axis.
"""

import numpy as np


def messages(depsgraph):
    """Why a picture by a custom camera would be another one.

    Parameters
    ----------
    depsgraph : bpy.types.Depsgraph
        Evaluated, with a camera object as the scene's camera.

    Returns
    -------
    list of str
        One line, or none.
    """
    camera = depsgraph.scene.camera.evaluated_get(depsgraph)
    return _of_shading(depsgraph, camera) or _of_clipping(depsgraph, camera)


def _of_shading(depsgraph, camera):
    wanted = {("ShaderNodeTexCoord", "Window"): "Window coordinates"}
    if camera.data.type == "PANO":
        wanted[("ShaderNodeTexCoord", "Camera")] = "Camera coordinates"
        wanted[("ShaderNodeCameraData", "View Vector")] = "The View Vector"
        wanted[("ShaderNodeCameraData", "View Z Depth")] = "The View Z Depth"
    for data in depsgraph.ids:
        if data.id_type in {"LIGHT", "MATERIAL", "WORLD"}:
            for socket in _used_outputs(data.node_tree):
                what = wanted.get((socket.node.bl_idname, socket.name))
                if what:
                    return [
                        f'{what} in "{data.name}" cannot be rendered by Gather; '
                        "use other coordinates there, or set Method to In Place"
                    ]
    return []


def _of_clipping(depsgraph, camera):
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


def _used_outputs(tree, seen=None):
    """Output sockets that are linked, in a node tree (or None) and its groups."""
    seen = set() if seen is None else seen
    if tree is None or tree.as_pointer() in seen:
        return
    seen.add(tree.as_pointer())
    for node in tree.nodes:
        if not node.mute:
            yield from (socket for socket in node.outputs if socket.is_linked)
            if node.bl_idname == "ShaderNodeGroup":
                yield from _used_outputs(node.node_tree, seen)
