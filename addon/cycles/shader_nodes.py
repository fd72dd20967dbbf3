# SPDX-License-Identifier: GPL-3.0-or-later
"""Whether the shader nodes of a material or world emit light, or have a volume.

Nodes that may emit are judged by their kind and their sockets' values, whether or not they are connected to an output:
what is said too often of a scene does no harm.
"""

# Strength and colour of what nodes emit.
_EMISSION = {
    "ShaderNodeBackground": ("Strength", "Color"),
    "ShaderNodeEmission": ("Strength", "Color"),
    "ShaderNodeBsdfPrincipled": ("Emission Strength", "Emission Color"),
    "ShaderNodeVolumePrincipled": ("Emission Strength", "Emission Color"),
}


def emit(tree, groups):
    """Whether nodes add light of their own, or may.

    Parameters
    ----------
    tree : bpy.types.NodeTree or None
    groups : dict
        What is known of node groups; this adds to it.
    """
    return tree is not None and any(_emits(node, groups) for node in tree.nodes if not node.mute)


def have_volume(tree):
    """Whether an output of a material's or world's nodes has a volume."""
    return tree is not None and any(
        "Volume" in node.inputs and node.inputs["Volume"].is_linked
        for node in tree.nodes
        if node.bl_idname in {"ShaderNodeOutputMaterial", "ShaderNodeOutputWorld"}
    )


def _emits(node, groups):
    if inner := getattr(node, "node_tree", None):
        key = inner.as_pointer()
        if key not in groups:
            groups[key] = emit(inner, groups)
        return groups[key]
    if node.bl_idname == "ShaderNodeVolumePrincipled" and _may_exceed_zero(node.inputs["Blackbody Intensity"]):
        return True
    if sockets := _EMISSION.get(node.bl_idname):
        return all(_may_exceed_zero(node.inputs[name]) for name in sockets)
    # Nobody knows what a script does.
    return node.bl_idname == "ShaderNodeScript" and any(socket.type == "SHADER" for socket in node.outputs)


def _may_exceed_zero(socket):
    value = socket.default_value
    return socket.is_linked or (any(value[:3]) if socket.type == "RGBA" else value > 0.0)
