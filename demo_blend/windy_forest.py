# SPDX-License-Identifier: GPL-3.0-or-later
"""A clearing in the wind: hundreds of instances of three trees and of grass, whose meshes bend and flutter."""

import math
import random

import bpy
import numpy as np

from demo_blend.primitives import (
    Pose,
    add_camera,
    add_plane,
    add_sun,
    animate,
    empty_scene,
    material,
    mottled_material,
    place,
    set_world,
)

#: Frames between two keys of the wind; short, so that a still's exposure sees a good part of a gust.
GUST = 5


def build():
    """Build the scene and return it."""
    scene = empty_scene()
    scene.render.use_motion_blur = True
    scene.view_settings.exposure = -3.3
    _sky()
    add_sun("Sun", math.radians(1.2), 34, (-5, 3.0, 3.2), (1.0, 0.83, 0.6))
    moss = mottled_material("Moss", ((0.05, 0.09, 0.02), (0.14, 0.12, 0.05)), 0.6, roughness=0.95)
    add_plane("Ground", (200, 200), moss)

    bark = material("Bark", (0.09, 0.055, 0.035), roughness=0.9)
    greens = [
        material(f"Leaves {i + 1}", color, roughness=0.55, transmission_weight=0.0)
        for i, color in enumerate(((0.06, 0.17, 0.02), (0.17, 0.22, 0.025), (0.03, 0.10, 0.03)))
    ]
    trees = [
        _tree("Beech", greens[0], bark, crown=(1.5, 1.7, 3.6), leaves=2600, seed=1),
        _tree("Birch", greens[1], bark, crown=(0.95, 1.9, 3.5), leaves=1900, seed=2),
        _tree("Fir", greens[2], bark, crown=(1.25, 2.3, 2.9), leaves=2800, seed=3, conical=True),
    ]
    grass = _grass("Grass", material("Grass", (0.13, 0.20, 0.03), roughness=0.6))
    chance = random.Random(15)
    for i in range(110):
        y = 3.0 + 42.0 * chance.random() ** 1.4
        x = chance.uniform(-0.75, 0.75) * (y + 9.0)
        if y < 16.0 and abs(x + 0.2) < 2.4:
            continue  # the path
        _instance(f"Tree {i}", chance.choice(trees), (x, y), chance)
    for i in range(260):
        y = -6.5 + 20.0 * chance.random() ** 1.3
        x = chance.uniform(-0.7, 0.7) * (y + 10.0)
        _instance(f"Tuft {i}", grass, (x, y), chance)
    add_camera((0.3, -10.0, 1.5), (-0.1, 4.0, 2.5), 32)
    scene.frame_set(scene.frame_current)
    return scene


def _sky() -> None:
    """Light the world by Blender's sky texture with its own sun disc off."""
    world = set_world((0, 0, 0), 1.0)
    sky = world.node_tree.nodes.new("ShaderNodeTexSky")
    sky.sun_disc = False
    sky.sun_elevation = math.radians(24)
    sky.sun_rotation = math.radians(-55)
    world.node_tree.links.new(sky.outputs["Color"], world.node_tree.nodes["Background"].inputs["Color"])


def _instance(name: str, mesh: bpy.types.Mesh, spot, chance: random.Random) -> None:
    """Place a turned and scaled instance on the ground."""
    obj = place(name, mesh, Pose((*spot, 0.0), (0, 0, chance.uniform(-0.6, 0.6))))
    obj.scale = (chance.uniform(0.75, 1.3),) * 3


def _tree(name, leaf, bark, crown, leaves, seed, conical=False) -> bpy.types.Mesh:
    """Return a tree in the wind.

    Parameters
    ----------
    name : str
        Of the mesh.
    leaf, bark : bpy.types.Material
        Of its two parts.
    crown : tuple of float
        Radius, half height and height of the middle of the crown, in metres.
    leaves : int
        How many, each a quad.
    seed : int
        Of their places.
    conical : bool
        Narrow the crown towards the top.
    """
    random_numbers = np.random.default_rng(seed)
    radius, half, middle = crown
    # Leaves grow near the crown's surface, in clumps, as light lets them.
    clumps = random_numbers.normal(size=(leaves // 40, 3))
    clumps /= np.linalg.norm(clumps, axis=1, keepdims=True)
    spot = clumps[random_numbers.integers(0, len(clumps), leaves)] * random_numbers.uniform(0.55, 1.0, (leaves, 1))
    spot += random_numbers.normal(scale=0.16, size=spot.shape)
    if conical:
        spot[:, :2] *= 0.08 + 0.62 * (1.0 - spot[:, 2:])
    corners = _quads(spot * (radius, radius, half) + (0, 0, middle), 0.16, random_numbers)
    trunk, trunk_faces = _trunk(middle + 0.4 * half)
    return _windy_mesh(name, corners, (trunk, trunk_faces), (leaf, bark), random_numbers)


def _grass(name, blade) -> bpy.types.Mesh:
    """Return a tuft of grass in the wind."""
    random_numbers = np.random.default_rng(9)
    count = 90
    foot = random_numbers.normal(scale=0.22, size=(count, 1, 3)) * (1, 1, 0)
    lean = random_numbers.normal(scale=0.12, size=(count, 1, 3)) * (1, 1, 0)
    tall = random_numbers.uniform(0.18, 0.5, (count, 1, 1))
    wide = random_numbers.normal(size=(count, 1, 3)) * (1, 1, 0)
    wide *= 0.011 / np.linalg.norm(wide, axis=-1, keepdims=True)
    top = foot + lean + tall * np.array((0, 0, 1.0))
    corners = np.concatenate((foot - wide, foot + wide, top + 0.2 * wide, top - 0.2 * wide), axis=1)
    return _windy_mesh(name, corners, (np.empty((0, 3)), []), (blade, blade), random_numbers, bend=0.55)


def _quads(middles, size, random_numbers) -> np.ndarray:
    """Return the corners of randomly turned squares, shape (n, 4, 3)."""
    one, other = random_numbers.normal(size=(2, len(middles), 3))
    one /= np.linalg.norm(one, axis=1, keepdims=True)
    other -= one * (one * other).sum(1, keepdims=True)
    other /= np.linalg.norm(other, axis=1, keepdims=True)
    size = size * random_numbers.uniform(0.5, 1.0, (len(middles), 1))
    return np.stack([middles + size * (a * one + 0.6 * b * other) for a, b in ((-1, 0), (0, -1), (1, 0), (0, 1))], 1)


def _trunk(height, sides=9, rings=8):
    """Return the vertices and faces of a trunk that thins towards its top."""
    vertices, faces = [], []
    for ring in range(rings):
        part = ring / (rings - 1)
        for side in range(sides):
            turn = 2 * math.pi * side / sides
            radius = 0.16 * (1 - 0.8 * part) * (1.5 if ring == 0 else 1.0)
            vertices.append((radius * math.cos(turn), radius * math.sin(turn), part * height))
            if ring:
                below, beside = (ring - 1) * sides, (side + 1) % sides
                faces.append((below + side, below + beside, below + sides + beside, below + sides + side))
    return np.array(vertices), faces


def _windy_mesh(name, corners, trunk, materials, random_numbers, bend=0.045) -> bpy.types.Mesh:
    """Make a mesh of leaves and trunk with a shape key of what the wind makes of it, keyframed to sway."""
    trunk_vertices, trunk_faces = trunk
    leaves = len(corners)
    vertices = np.concatenate((corners.reshape(-1, 3), trunk_vertices))
    faces = [tuple(range(4 * i, 4 * i + 4)) for i in range(leaves)]
    faces += [tuple(4 * leaves + corner for corner in face) for face in trunk_faces]
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(vertices.tolist(), [], faces)
    for made in materials:
        mesh.materials.append(made)
    mesh.polygons.foreach_set("material_index", [0] * leaves + [1] * len(trunk_faces))

    # The whole bends with the square of the height; each leaf flutters by itself.
    bent = vertices.copy()
    bent[:, 0] += bend * vertices[:, 2] ** 2
    bent[: 4 * leaves] += random_numbers.normal(scale=0.05 if len(trunk_faces) else 0.0, size=(leaves, 3)).repeat(4, 0)
    holder = bpy.data.objects.new(name, mesh)
    holder.shape_key_add(name="Still")
    wind = holder.shape_key_add(name="Wind")
    wind.data.foreach_set("co", bent.astype(np.float32).ravel())
    wind.slider_min = -1.0
    keys = {frame: 0.55 * math.sin(1.9 * frame) + 0.35 for frame in range(1, 25 + GUST, GUST)}
    animate(wind, "value", keys)
    bpy.data.objects.remove(holder)
    return mesh
