# SPDX-License-Identifier: GPL-3.0-or-later
"""Shading that asks where the camera is looking, which Cycles cannot answer for a custom camera."""


def messages(depsgraph, camera):
    """Why a material, light or world in use would see another camera than the scene's.

    Window coordinates have no inverse of a custom camera (`camera_world_to_ndc` of Cycles); camera space has other
    axes for a panorama than for a custom camera.

    Parameters
    ----------
    depsgraph : bpy.types.Depsgraph
    camera : bpy.types.Object
        The scene's.

    Returns
    -------
    list of str
        One line, or none.
    """
    wanted = {("ShaderNodeTexCoord", "Window"): "Window coordinates"}
    if camera.data.type == "PANO":
        wanted[("ShaderNodeTexCoord", "Camera")] = "Camera coordinates"
        wanted[("ShaderNodeCameraData", "View Vector")] = "The View Vector"
        wanted[("ShaderNodeCameraData", "View Z Depth")] = "The View Z Depth"
    for data in depsgraph.ids:
        if data.bl_rna.identifier in {"Material", "World"} or data.bl_rna.identifier.endswith("Light"):
            for socket in _used_outputs(data.node_tree):
                what = wanted.get((socket.node.bl_idname, socket.name))
                if what:
                    return [
                        f'{what} in "{data.name}" cannot be rendered by Gather; '
                        "use other coordinates there, or set Method to In Place"
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
