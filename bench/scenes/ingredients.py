# SPDX-License-Identifier: GPL-3.0-or-later
"""What production-like scenes share beyond the primitives: rough surfaces, glass, wax, mist, scattered instances."""

from collections.abc import Sequence

import bpy

from demo_blend.primitives import Vec3, material, mottled_material, place


def roughened(made: bpy.types.Material, scale: float, height: float, texture: str = "ShaderNodeTexNoise"):
    """Bump a Principled material by a procedural texture and return it.

    Parameters
    ----------
    made : bpy.types.Material
    scale : float
        Of the texture, in the object's coordinates.
    height : float
        Of the bumps, in metres.
    texture : str
        Type of the texture's node, with an input ``Scale``.
    """
    nodes, links = made.node_tree.nodes, made.node_tree.links
    bump = nodes.new("ShaderNodeBump")
    bump.inputs["Distance"].default_value = height
    links.new(_texture(made, scale, texture), bump.inputs["Height"])
    links.new(bump.outputs["Normal"], nodes["Principled BSDF"].inputs["Normal"])
    return made


def displaced(made: bpy.types.Material, scale: float, height: float, texture: str = "ShaderNodeTexNoise"):
    """Displace a material's surfaces truly, by a procedural texture as `roughened` takes it, and return it."""
    nodes, links = made.node_tree.nodes, made.node_tree.links
    displacement = nodes.new("ShaderNodeDisplacement")
    displacement.inputs["Scale"].default_value = height
    links.new(_texture(made, scale, texture), displacement.inputs["Height"])
    links.new(displacement.outputs["Displacement"], nodes["Material Output"].inputs["Displacement"])
    made.displacement_method = "BOTH"
    return made


def _texture(made: bpy.types.Material, scale: float, kind: str, detail: float = 6.0) -> bpy.types.NodeSocket:
    """Add a texture in the object's coordinates and return its first output."""
    nodes, links = made.node_tree.nodes, made.node_tree.links
    texture = nodes.new(kind)
    texture.inputs["Scale"].default_value = scale
    if "Detail" in texture.inputs:
        texture.inputs["Detail"].default_value = detail
    links.new(nodes.new("ShaderNodeTexCoord").outputs["Object"], texture.inputs["Vector"])
    return texture.outputs[0]


def glass(name: str, color: Vec3 = (1.0, 1.0, 1.0), ior: float = 1.5, roughness: float = 0.0) -> bpy.types.Material:
    """Make a material that light passes, bent."""
    return material(name, color, ior=ior, roughness=roughness, transmission_weight=1.0)


def waxen(name: str, colors: Sequence[Vec3], depth: float, roughness: float = 0.4) -> bpy.types.Material:
    """Make a mottled material below whose surface light scatters, red the farthest, over `depth` metres."""
    made = mottled_material(name, colors, 6.0, roughness=roughness, subsurface_weight=1.0, subsurface_scale=depth)
    made.node_tree.nodes["Principled BSDF"].inputs["Subsurface Radius"].default_value = (1.0, 0.45, 0.2)
    return made


def mist(name: str, density: float, anisotropy: float = 0.5, scale: float = 0.0) -> bpy.types.Material:
    """Make a volume that scatters, in clouds of a noise texture of that scale, or evenly if it is 0."""
    made = bpy.data.materials.new(name)
    nodes, links = made.node_tree.nodes, made.node_tree.links
    nodes.remove(nodes["Principled BSDF"])
    scatter = nodes.new("ShaderNodeVolumeScatter")
    scatter.inputs["Density"].default_value = density
    scatter.inputs["Anisotropy"].default_value = anisotropy
    if scale:
        clouds = nodes.new("ShaderNodeMapRange")
        clouds.inputs["From Min"].default_value, clouds.inputs["From Max"].default_value = 0.4, 0.65
        clouds.inputs["To Min"].default_value, clouds.inputs["To Max"].default_value = 0.2 * density, 2.0 * density
        links.new(_texture(made, scale, "ShaderNodeTexNoise", 1.0), clouds.inputs["Value"])
        links.new(clouds.outputs[0], scatter.inputs["Density"])
    links.new(scatter.outputs["Volume"], nodes["Material Output"].inputs["Volume"])
    return made


def subdivided(thing: bpy.types.Object, levels: int, smooth: bool = True) -> bpy.types.Object:
    """Subdivide an object's mesh at render, rounding it if `smooth`, and return it."""
    modifier = thing.modifiers.new("Subdivision", "SUBSURF")
    modifier.subdivision_type = "CATMULL_CLARK" if smooth else "SIMPLE"
    modifier.levels, modifier.render_levels = 1, levels
    thing.data.shade_smooth()
    return thing


def kneaded(thing: bpy.types.Object, size: float, strength: float) -> bpy.types.Object:
    """Displace an object's vertices by clouds of `size` metres, up to `strength` metres, and return it."""
    clouds = bpy.data.textures.new(f"{thing.name} clouds", "CLOUDS")
    clouds.noise_scale, clouds.noise_depth = size, 3
    modifier = thing.modifiers.new("Displace", "DISPLACE")
    modifier.texture, modifier.strength = clouds, strength
    return thing


def collected(name: str, things: Sequence[bpy.types.Object]) -> bpy.types.Collection:
    """Move objects out of the scene into a collection that is only instanced."""
    collection = bpy.data.collections.new(name)
    for thing in things:
        collection.objects.link(thing)
        bpy.context.scene.collection.objects.unlink(thing)
    return collection


def place_collection(name: str, collection: bpy.types.Collection, pose) -> bpy.types.Object:
    """Put an instance of a collection into the scene."""
    empty = place(name, None, pose)
    empty.instance_type, empty.instance_collection = "COLLECTION", collection
    return empty


def scatter(
    ground: bpy.types.Object, collection: bpy.types.Collection, density: float, sizes: Sequence[float], seed: int
) -> None:
    """Scatter a collection's objects over an object by geometry nodes, each upright, turned and sized by chance.

    Parameters
    ----------
    ground : bpy.types.Object
    collection : bpy.types.Collection
        One object of it at each point.
    density : float
        Points a square metre.
    sizes : sequence of float
        Smallest and largest scale.
    seed : int
        Of all chance.
    """
    tree = bpy.data.node_groups.new(f"Scatter {collection.name}", "GeometryNodeTree")
    for way in ("INPUT", "OUTPUT"):
        tree.interface.new_socket(name="Geometry", in_out=way, socket_type="NodeSocketGeometry")
    kinds = {
        "input": "NodeGroupInput",
        "points": "GeometryNodeDistributePointsOnFaces",
        "things": "GeometryNodeCollectionInfo",
        "turn": "FunctionNodeRandomValue",
        "size": "FunctionNodeRandomValue",
        "instances": "GeometryNodeInstanceOnPoints",
        "join": "GeometryNodeJoinGeometry",
        "output": "NodeGroupOutput",
    }
    node = {name: tree.nodes.new(kind) for name, kind in kinds.items()}
    node["points"].inputs["Density"].default_value = density
    node["points"].inputs["Seed"].default_value = seed
    node["things"].inputs["Collection"].default_value = collection
    node["things"].inputs["Separate Children"].default_value = True
    node["things"].inputs["Reset Children"].default_value = True
    node["instances"].inputs["Pick Instance"].default_value = True
    node["turn"].data_type = "FLOAT_VECTOR"
    for name, limits in (("turn", ((0, 0, 0), (0.2, 0.2, 6.283))), ("size", sizes)):
        node[name].inputs["Seed"].default_value = seed
        for end, limit in zip(("Min", "Max"), limits, strict=True):
            node[name].inputs[end].default_value = limit
    for source, output, target, wanted in (
        ("input", 0, "points", "Mesh"),
        ("points", 0, "instances", "Points"),
        ("things", 0, "instances", "Instance"),
        ("turn", 0, "instances", "Rotation"),
        ("size", 0, "instances", "Scale"),
        ("input", 0, "join", "Geometry"),
        ("instances", 0, "join", "Geometry"),
        ("join", 0, "output", "Geometry"),
    ):
        tree.links.new(node[source].outputs[output], node[target].inputs[wanted])
    ground.modifiers.new(f"Scatter {collection.name}", "NODES").node_group = tree
