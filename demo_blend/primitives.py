# SPDX-License-Identifier: GPL-3.0-or-later
"""Shapes, materials, lights, cameras and keyframes: the few words all scene builders speak.

Units are Blender's: metres, radians, watts. Colours are linear RGB.
"""

import itertools
import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import bmesh
import bpy
from mathutils import Matrix, Vector

Vec3 = Sequence[float]


class Pose(NamedTuple):
    """Where an object stands: location, Euler rotation and the parent both are relative to."""

    location: Vec3 = (0.0, 0.0, 0.0)
    rotation: Vec3 = (0.0, 0.0, 0.0)
    parent: bpy.types.Object | None = None


ORIGIN = Pose()


def empty_scene(frames: int = 24, frame: int = 12) -> bpy.types.Scene:
    """Replace the open file by an empty factory one set to Cycles, at settings that artists use.

    Parameters
    ----------
    frames : int
        Length of the animation, from frame 1.
    frame : int
        The frame stills are made of; not the first, so that motion reaches to both sides of it.
    """
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.cycles.samples, scene.cycles.adaptive_threshold = 1024, 0.03
    scene.frame_end = frames
    scene.frame_set(frame)
    scene.render.resolution_x = 960
    scene.render.resolution_y = 540
    return scene


# --- Objects ---------------------------------------------------------------------------------------------------------


def place(name: str, data: bpy.types.ID | None, pose: Pose = ORIGIN) -> bpy.types.Object:
    """Link a new object holding `data` into the scene."""
    obj = bpy.data.objects.new(name, data)
    bpy.context.scene.collection.objects.link(obj)
    obj.location = pose.location
    obj.rotation_euler = pose.rotation
    obj.parent = pose.parent
    return obj


def copy_of(obj: bpy.types.Object, name: str, pose: Pose) -> bpy.types.Object:
    """Link another object with the same mesh (a true instance in Cycles)."""
    return place(name, obj.data, pose)


def mesh_of(name: str, shape: bmesh.types.BMesh, material: bpy.types.Material, smooth: bool) -> bpy.types.Mesh:
    """Turn a bmesh (freed here) into a mesh; smooth ones keep edges sharper than 30 degrees."""
    mesh = bpy.data.meshes.new(name)
    shape.to_mesh(mesh)
    shape.free()
    mesh.materials.append(material)
    if smooth:
        mesh.shade_smooth()
        mesh.set_sharp_from_angle(angle=math.radians(30))
    return mesh


def add_box(name: str, size: Vec3, material: bpy.types.Material, pose: Pose = ORIGIN, bevel: float = 0.0):
    """Add a box of the given edge lengths, its edges rounded by `bevel`."""
    shape = bmesh.new()
    bmesh.ops.create_cube(shape, size=1.0, matrix=Matrix.Diagonal((*size, 1.0)))
    if bevel:
        bmesh.ops.bevel(shape, geom=shape.edges[:], offset=bevel, segments=2, affect="EDGES", profile=0.5)
    return place(name, mesh_of(name, shape, material, smooth=bool(bevel)), pose)


def add_cylinder(
    name: str, radius: float, depth: float, material: bpy.types.Material, pose: Pose = ORIGIN, taper: float = 1.0
):
    """Add a closed cylinder along z; `taper` is the top radius over the bottom one (0 makes a cone)."""
    shape = bmesh.new()
    bmesh.ops.create_cone(shape, cap_ends=True, segments=48, radius1=radius, radius2=radius * taper, depth=depth)
    return place(name, mesh_of(name, shape, material, smooth=True), pose)


def add_sphere(name: str, radius: float, material: bpy.types.Material, pose: Pose = ORIGIN):
    """Add a smooth UV sphere."""
    shape = bmesh.new()
    bmesh.ops.create_uvsphere(shape, u_segments=48, v_segments=24, radius=radius)
    return place(name, mesh_of(name, shape, material, smooth=True), pose)


def add_plane(name: str, size: Sequence[float], material: bpy.types.Material, pose: Pose = ORIGIN):
    """Add a rectangle in the xy plane, facing +z."""
    shape = bmesh.new()
    bmesh.ops.create_grid(shape, size=0.5, matrix=Matrix.Diagonal((size[0], size[1], 1.0, 1.0)))
    return place(name, mesh_of(name, shape, material, smooth=False), pose)


def add_torus(name: str, radii: Sequence[float], material: bpy.types.Material, pose: Pose = ORIGIN, segments=(96, 16)):
    """Add a torus around z; `radii` are (of the ring, of its tube), `segments` (along the ring, around the tube)."""
    ring, tube = radii
    along, around = segments
    vertices = []
    for i in range(along):
        turn = 2 * math.pi * i / along
        for j in range(around):
            roll = 2 * math.pi * j / around
            out = ring + tube * math.cos(roll)
            vertices.append((out * math.cos(turn), out * math.sin(turn), tube * math.sin(roll)))

    def corner(i: int, j: int) -> int:
        return (i % along) * around + j % around

    faces = [
        (corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1))
        for i in range(along)
        for j in range(around)
    ]
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(vertices, [], faces)
    mesh.materials.append(material)
    mesh.shade_smooth()
    return place(name, mesh, pose)


def mesh_of_revolution(name: str, outline: Sequence[Sequence[float]], material: bpy.types.Material) -> bpy.types.Mesh:
    """Make what a lathe makes: an outline of (radius, height) turned about z."""
    shape = bmesh.new()
    line = [shape.verts.new((radius, 0.0, height)) for radius, height in outline]
    edges = [shape.edges.new(pair) for pair in itertools.pairwise(line)]
    axis, turn = (0, 0, 1), 2 * math.pi
    bmesh.ops.spin(shape, geom=line + edges, cent=(0, 0, 0), axis=axis, angle=turn, steps=48, use_merge=True)
    bmesh.ops.remove_doubles(shape, verts=shape.verts[:], dist=1e-5)
    bmesh.ops.recalc_face_normals(shape, faces=shape.faces[:])
    return mesh_of(name, shape, material, smooth=True)


# --- Materials -------------------------------------------------------------------------------------------------------


def material(name: str, color: Vec3, **inputs: float) -> bpy.types.Material:
    """Make a Principled material; keywords name its sockets in lower case (``roughness=0.2, ior=1.4``)."""
    made = bpy.data.materials.new(name)
    principled = made.node_tree.nodes["Principled BSDF"]
    principled.inputs["Base Color"].default_value = (*color, 1.0)
    sockets = {socket.name.lower().replace(" ", "_"): socket for socket in principled.inputs}
    for key, value in inputs.items():
        sockets[key].default_value = value
    return made


def mottled_material(name: str, colors: Sequence[Vec3], scale: float, **inputs: float) -> bpy.types.Material:
    """Make a Principled material whose colour wanders between two along a noise texture."""
    made = material(name, colors[0], **inputs)
    nodes, links = made.node_tree.nodes, made.node_tree.links
    coordinates = nodes.new("ShaderNodeTexCoord")
    noise = nodes.new("ShaderNodeTexNoise")
    noise.inputs["Scale"].default_value = scale
    noise.inputs["Detail"].default_value = 4.0
    ramp = nodes.new("ShaderNodeValToRGB")
    for stop, position, color in zip(ramp.color_ramp.elements, (0.35, 0.65), colors, strict=True):
        stop.position = position
        stop.color = (*color, 1.0)
    links.new(coordinates.outputs["Object"], noise.inputs["Vector"])
    links.new(noise.outputs[0], ramp.inputs["Fac"])
    links.new(ramp.outputs["Color"], nodes["Principled BSDF"].inputs["Base Color"])
    return made


def checkered_material(name: str, colors: Sequence[Vec3], squares: float, **inputs: float) -> bpy.types.Material:
    """Make a Principled material of two colours in squares, that many along a unit of the object's coordinates."""
    made = material(name, colors[0], **inputs)
    nodes, links = made.node_tree.nodes, made.node_tree.links
    coordinates = nodes.new("ShaderNodeTexCoord")
    checker = nodes.new("ShaderNodeTexChecker")
    checker.inputs["Scale"].default_value = squares
    for socket, color in zip(("Color1", "Color2"), colors, strict=True):
        checker.inputs[socket].default_value = (*color, 1.0)
    links.new(coordinates.outputs["Object"], checker.inputs["Vector"])
    links.new(checker.outputs["Color"], nodes["Principled BSDF"].inputs["Base Color"])
    return made


def emission(name: str, color: Vec3, strength: float) -> bpy.types.Material:
    """Make a material that only emits (black otherwise)."""
    return material(name, (0.0, 0.0, 0.0), emission_color=(*color, 1.0), emission_strength=strength)


# --- Lights and world ------------------------------------------------------------------------------------------------


def aim(source: Vec3, target: Vec3) -> Vec3:
    """Return the Euler rotation that points a light's or camera's -z from `source` to `target`, with y up."""
    return (Vector(target) - Vector(source)).to_track_quat("-Z", "Y").to_euler()


def add_area_light(name: str, size: float, power: float, location: Vec3, target: Vec3, color: Vec3 = (1.0, 1.0, 1.0)):
    """Add a square area light of edge `size` that looks at `target`."""
    light = bpy.data.lights.new(name, "AREA")
    light.size = size
    light.energy = power
    light.color = color
    return place(name, light, Pose(location, aim(location, target)))


def add_point_light(name: str, radius: float, power: float, location: Vec3, color: Vec3 = (1.0, 1.0, 1.0)):
    """Add a spherical light."""
    light = bpy.data.lights.new(name, "POINT")
    light.shadow_soft_size = radius
    light.energy = power
    light.color = color
    return place(name, light, Pose(location))


def add_sun(name: str, angle: float, strength: float, location: Vec3, color: Vec3 = (1.0, 1.0, 1.0)):
    """Add a sun that shines from `location` towards the origin; `angle` is its apparent diameter."""
    light = bpy.data.lights.new(name, "SUN")
    light.angle = angle
    light.energy = strength
    light.color = color
    return place(name, light, Pose(location, aim(location, (0, 0, 0))))


def set_world(color: Vec3, strength: float = 1.0) -> bpy.types.World:
    """Give the scene a uniform background and return its world (for builders that add nodes to it)."""
    world = bpy.data.worlds.new("World")
    bpy.context.scene.world = world
    background = world.node_tree.nodes["Background"]
    background.inputs["Color"].default_value = (*color, 1.0)
    background.inputs["Strength"].default_value = strength
    return world


def light_as_in_1991(ambient: float, reflections: int = 0) -> None:
    """Light the scene as the ray tracers of the paper did: directly from its lamps, plus a constant ambient term.

    So nothing but the effect that a scene demonstrates is left to sample. The ambient term is emission in each
    material's own colour, which Cycles must neither take for a lamp nor let fall on other surfaces.

    Parameters
    ----------
    ambient : float
        Part of its colour that a surface shows without any light; materials that emit already are left alone.
    reflections : int
        How often glossy surfaces reflect.
    """
    cycles = bpy.context.scene.cycles
    cycles.max_bounces = cycles.glossy_bounces = reflections
    cycles.diffuse_bounces = cycles.transmission_bounces = cycles.volume_bounces = 0
    seen_in = [obj for obj in bpy.context.scene.objects if obj.type != "LIGHT"]
    if world := bpy.context.scene.world:
        world.cycles.sampling_method = "NONE"
        seen_in.append(world.cycles_visibility)
    for seen in seen_in:
        prefix = "visible_" if isinstance(seen, bpy.types.Object) else ""
        setattr(seen, f"{prefix}diffuse", False)
        setattr(seen, f"{prefix}glossy", reflections > 0)
    for made in bpy.data.materials:
        made.cycles.emission_sampling = "NONE"
        principled = made.node_tree.nodes.get("Principled BSDF")
        if principled and not principled.inputs["Emission Strength"].default_value:
            color, glow = principled.inputs["Base Color"], principled.inputs["Emission Color"]
            glow.default_value = color.default_value
            for link in color.links:
                made.node_tree.links.new(link.from_socket, glow)
            principled.inputs["Emission Strength"].default_value = ambient


# --- Camera and motion -----------------------------------------------------------------------------------------------


def add_camera(location: Vec3, target: Vec3, focal_length: float, fstop: float | None = None) -> bpy.types.Object:
    """Add the scene's camera, looking at and (given an f-stop) focused on `target`."""
    camera = bpy.data.cameras.new("Camera")
    camera.lens = focal_length
    if fstop is not None:
        camera.dof.use_dof = True
        camera.dof.aperture_fstop = fstop
        camera.dof.focus_distance = (Vector(target) - Vector(location)).length
    obj = place("Camera", camera, Pose(location, aim(location, target)))
    bpy.context.scene.camera = obj
    return obj


def animate(owner: bpy.types.bpy_struct, path: str, keys: Mapping[int, float | Vec3], index: int = -1) -> None:
    """Keyframe a property linearly, going on at the same rate outside the keys.

    Parameters
    ----------
    owner : bpy.types.ID or part of one
        What has the property.
    path : str
        Data path of the property.
    keys : mapping of int to float or sequence
        Value at each frame; floats for one component (`index`), else all of them.
    index : int
        Component of an array property, -1 for all.
    """
    for frame, value in keys.items():
        if index < 0:
            setattr(owner, path, value)
        else:
            getattr(owner, path)[index] = value
        owner.keyframe_insert(path, index=index, frame=frame)
    for curve in owner.id_data.animation_data.action.layers[0].strips[0].channelbags[0].fcurves:
        curve.extrapolation = "LINEAR"
        for key in curve.keyframe_points:
            key.interpolation = "LINEAR"


def spin(obj: bpy.types.Object, per_frame: float, axis: int = 2) -> None:
    """Rotate an object at `per_frame` radians a frame, for the whole animation.

    The axis is the object's own only while its other two angles are zero: tilt it through a parent.
    """
    scene = bpy.context.scene
    start = obj.rotation_euler[axis]
    frames = scene.frame_end - scene.frame_start
    animate(obj, "rotation_euler", {scene.frame_start: start, scene.frame_end: start + per_frame * frames}, axis)
