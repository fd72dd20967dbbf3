# SPDX-License-Identifier: GPL-3.0-or-later
"""A wood in the morning mist: the sun through trunks, clouds of a volume, leaves on the ground, a camera that walks."""

import math
import random

import bpy
from mathutils import Matrix, Vector

from bench.scenes.ingredients import (
    collected,
    displaced,
    kneaded,
    mist,
    place_collection,
    roughened,
    scatter,
    subdivided,
)
from demo_blend.primitives import (
    Pose,
    add_box,
    add_camera,
    add_cylinder,
    add_plane,
    add_sphere,
    add_sun,
    animate,
    copy_of,
    empty_scene,
    material,
    mottled_material,
    place,
    set_world,
)


def build():
    """Build the scene and return it."""
    scene = empty_scene()
    scene.render.use_motion_blur = True
    scene.cycles.volume_bounces = 2
    set_world((0.45, 0.58, 0.75), 0.5)
    add_sun("Sun", math.radians(0.7), 9, (2.5, 6.0, 3.0), (1.0, 0.80, 0.55))
    soil = roughened(
        mottled_material("Soil", ((0.05, 0.035, 0.02), (0.09, 0.07, 0.03)), 3.0, roughness=0.95), 8.0, 0.08
    )
    ground = kneaded(subdivided(add_plane("Ground", (30, 34), soil, Pose((0, 8, 0))), 6, smooth=False), 2.0, 0.5)
    scatter(ground, collected("Litter", _leaves()), 14.0, (0.6, 1.6), 1)
    scatter(ground, collected("Ferns", [_fern()]), 0.7, (0.6, 1.5), 4)
    _trunks()
    add_box("Mist", (24, 26, 7), mist("Mist", 0.045, 0.6, scale=0.35), Pose((0, 8, 3.4)))
    camera = add_camera((0.2, -5.5, 1.75), (0.4, 4, 1.9), 30)
    animate(camera, "location", {1: (-0.25, -6.0, 1.75), 24: (0.55, -5.1, 1.7)})
    scene.frame_set(scene.frame_current)
    return scene


def _trunks() -> None:
    """Add trunks with truly displaced bark, and branches."""
    bark = displaced(mottled_material("Bark", ((0.13, 0.09, 0.06), (0.06, 0.05, 0.03)), 7.0, roughness=0.9), 5.0, 0.14)
    moss = mottled_material("Mossy branch", ((0.10, 0.08, 0.05), (0.07, 0.10, 0.02)), 6.0, roughness=0.95)
    trunk = subdivided(add_cylinder("Trunk", 0.27, 11, bark, taper=0.6), 4, smooth=False)
    trees = collected("Tree", [trunk])
    place_collection("Near trunk", trees, Pose((-1.9, -1.2, 5)))
    branch = add_cylinder("Branch", 0.05, 1.8, moss, Pose((-1.5, -1.2, 3.0), (0, 1.1, 0.2)), taper=0.2)
    chance = random.Random(12)
    for i in range(46):
        x, y = chance.uniform(-10, 10), chance.uniform(0, 20)
        if abs(x - 0.4) < 0.9 and y < 8:
            continue
        pose = Pose((x, y, 5), (chance.gauss(0, 0.03), chance.gauss(0, 0.03), chance.uniform(0, 6.28)))
        tree = place_collection(f"Trunk {i}", trees, pose)
        tree.scale.x = tree.scale.y = chance.uniform(0.5, 1.2)
        for j in range(4):
            turn = Pose((x, y, chance.uniform(1.5, 5.5)), (0, chance.uniform(0.8, 1.3), chance.uniform(0, 6.28)))
            copy_of(branch, f"Branch {i} {j}", turn)


def _leaves() -> list[bpy.types.Object]:
    """Return fallen leaves of three colours and a pebble."""
    found = []
    for number, color in enumerate(((0.35, 0.12, 0.03), (0.40, 0.25, 0.05), (0.18, 0.09, 0.04))):
        leaf = material(f"Leaf {number}", color, roughness=0.6)
        mesh = bpy.data.meshes.new(f"Leaf {number}")
        rim = [(0, -0.08, 0.02), (0.045, -0.02, 0.035), (0.03, 0.05, 0.02), (0, 0.1, 0.05), (-0.03, 0.05, 0.03)]
        mesh.from_pydata([(0, 0, 0.01), *rim, (-0.045, -0.02, 0.03)], [], [(0, i, i % 6 + 1) for i in range(1, 7)])
        mesh.materials.append(leaf)
        found.append(place(f"Leaf {number}", mesh))
    return [*found, add_sphere("Pebble", 0.035, material("Pebble", (0.2, 0.2, 0.19), roughness=0.8))]


def _fern() -> bpy.types.Object:
    """Return a fern: fronds that arch from the ground, with leaflets on both sides."""
    vertices, faces = [], []
    for frond in range(9):
        turn = Matrix.Rotation(frond * 2.4, 3, "Z")
        for step in range(1, 15):
            along = step / 15
            out, height, width = 0.55 * along, 0.45 * along * (1.7 - 1.35 * along), 0.14 * (1.02 - along)
            for side in (-1, 1):
                first = len(vertices)
                shape = ((out, 0, height), (out + 0.03, side * width, height - 0.02), (out + 0.045, 0, height + 0.01))
                vertices += [turn @ Vector(point) for point in shape]
                faces.append((first, first + 1, first + 2))
    mesh = bpy.data.meshes.new("Fern")
    mesh.from_pydata(vertices, [], faces)
    mesh.materials.append(material("Fern", (0.08, 0.20, 0.03), roughness=0.5))
    return place("Fern", mesh)
