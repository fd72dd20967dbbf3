# SPDX-License-Identifier: GPL-3.0-or-later
"""What the shader nodes of a material or world do: whether they emit light, and whether they draw random numbers.

Nodes are judged by their kind and their sockets' values, whether or not they are connected to an output: what is said
too often of a scene does no harm.
"""

from typing import NamedTuple

# Shaders that are one closure, or several that are seen all at once, and never let a ray through by chance.
_SURE_SHADERS = {
    "ShaderNodeBackground", "ShaderNodeBsdfAnisotropic", "ShaderNodeBsdfDiffuse", "ShaderNodeBsdfMetallic",
    "ShaderNodeBsdfSheen", "ShaderNodeBsdfToon", "ShaderNodeEmission",
}  # fmt: skip

# Other nodes that draw random numbers, or may.
_UNSURE = {"ShaderNodeAmbientOcclusion", "ShaderNodeBevel", "ShaderNodeRaycast", "ShaderNodeScript"}

_PRINCIPLED = "ShaderNodeBsdfPrincipled"

# Strength and colour of what nodes emit.
_EMISSION = {
    "ShaderNodeBackground": ("Strength", "Color"),
    "ShaderNodeEmission": ("Strength", "Color"),
    _PRINCIPLED: ("Emission Strength", "Emission Color"),
    "ShaderNodeVolumePrincipled": ("Emission Strength", "Emission Color"),
}


class Shading(NamedTuple):
    """What nodes do.

    Attributes
    ----------
    emits : bool
        Whether they add light of their own, or may.
    other_chance : bool
        Whether Cycles draws random numbers for them beside those of light and scattering, or may.
    """

    emits: bool
    other_chance: bool


def shading(tree, groups):
    """Look through a node tree.

    Parameters
    ----------
    tree : bpy.types.NodeTree or None
    groups : dict
        What is known of node groups; this adds to it.

    Returns
    -------
    Shading
    """
    emits = other_chance = False
    for node in tree.nodes if tree else ():
        if node.mute:
            continue
        inner = getattr(node, "node_tree", None)
        if inner is None:
            emits = emits or _emits(node)
            other_chance = other_chance or _leaves_to_chance(node)
        else:
            key = inner.as_pointer()
            if key not in groups:
                groups[key] = shading(inner, groups)
            emits, other_chance = emits or groups[key].emits, other_chance or groups[key].other_chance
    return Shading(emits, other_chance)


def _emits(node):
    if node.bl_idname == "ShaderNodeVolumePrincipled" and _may_exceed_zero(node.inputs["Blackbody Intensity"]):
        return True
    if sockets := _EMISSION.get(node.bl_idname):
        return all(_may_exceed_zero(node.inputs[name]) for name in sockets)
    # Nobody knows what a script does.
    return node.bl_idname == "ShaderNodeScript" and any(socket.type == "SHADER" for socket in node.outputs)


def _leaves_to_chance(node):
    kind = node.bl_idname
    if kind in _SURE_SHADERS:
        return False
    if kind == _PRINCIPLED:
        alpha = node.inputs["Alpha"]
        goes_through = any(_may_exceed_zero(node.inputs[name]) for name in ("Transmission Weight", "Subsurface Weight"))
        return goes_through or alpha.is_linked or alpha.default_value < 1.0
    if kind in {"ShaderNodeOutputMaterial", "ShaderNodeOutputWorld"}:
        return node.inputs["Volume"].is_linked
    return kind in _UNSURE or any(socket.type == "SHADER" for socket in node.outputs)


def _may_exceed_zero(socket):
    value = socket.default_value
    return socket.is_linked or (any(value[:3]) if socket.type == "RGBA" else value > 0.0)
