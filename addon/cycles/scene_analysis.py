# SPDX-License-Identifier: GPL-3.0-or-later
"""What a frame uses: which of Cycles' random numbers have something to decide in it."""

from .scene_use import SceneUse


def emitters(depsgraph):
    """Number of emitters that Cycles chooses between, and whether any is not a lamp.

    A single lamp without size counts as none, for nothing about it is left to chance.

    Returns
    -------
    (int, bool)
    """
    lamps = [obj.data for obj in depsgraph.objects if obj.type == "LIGHT"]
    glowing = [data for data in depsgraph.ids if data.bl_rna.identifier in {"Material", "World"} and _emits(data)]
    only_a_point = len(lamps) == 1 and not glowing and _is_point(lamps[0])
    return 0 if only_a_point else len(lamps) + len(glowing), bool(glowing)


def scene_use(depsgraph, found=None):
    """Look a frame over, without touching its geometry.

    Parameters
    ----------
    depsgraph : bpy.types.Depsgraph
        Evaluated for the frame.
    found : (int, bool), optional
        What `emitters` found; it is asked by default.

    Returns
    -------
    SceneUse
    """
    scene, layer = depsgraph.scene, depsgraph.view_layer
    camera = scene.camera
    cycles = scene.cycles
    lights, glow = emitters(depsgraph) if found is None else found
    lens = camera is not None and camera.type == "CAMERA" and camera.data.dof.use_dof
    return SceneUse(
        motion_blur=scene.render.use_motion_blur and layer.use_motion_blur,
        lens=lens,
        lights=lights,
        bounces=cycles.max_bounces > 0
        and any((cycles.diffuse_bounces, cycles.glossy_bounces, cycles.transmission_bounces, cycles.volume_bounces)),
        glow=glow,
        blades=camera.data.dof.aperture_blades if lens and camera.data.dof.aperture_blades >= 3 else 0,
    )


def _is_point(lamp):
    """Whether all of a lamp's light comes from one point or direction."""
    return lamp.type != "AREA" and (lamp.angle if lamp.type == "SUN" else lamp.shadow_soft_size) == 0.0


def _emits(data):
    """Whether Cycles may choose a material or world as a light, judged by its nodes' strengths."""
    sampling = data.cycles.sampling_method if data.bl_rna.identifier == "World" else data.cycles.emission_sampling
    if sampling == "NONE":
        return False
    tree = data.node_tree
    if tree is None:
        return data.bl_rna.identifier == "World" and any(data.color)
    return any(_node_emits(node) for node in tree.nodes)


def _node_emits(node):
    if node.mute:
        return False
    if node.bl_idname == "ShaderNodeGroup":
        return node.node_tree is not None and any(_node_emits(inner) for inner in node.node_tree.nodes)
    if node.bl_idname in {"ShaderNodeEmission", "ShaderNodeBackground"}:
        return _may_exceed_zero(node.inputs["Strength"]) and _may_exceed_zero(node.inputs["Color"])
    if node.bl_idname == "ShaderNodeBsdfPrincipled":
        return _may_exceed_zero(node.inputs["Emission Strength"]) and _may_exceed_zero(node.inputs["Emission Color"])
    return False


def _may_exceed_zero(socket):
    value = socket.default_value
    return socket.is_linked or (any(value[:3]) if socket.type == "RGBA" else value > 0.0)
