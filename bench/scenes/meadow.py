# SPDX-License-Identifier: GPL-3.0-or-later
"""A hillside on a summer evening: grass, flowers and rocks scattered on displaced ground, a camera that glides."""

import math
import random

import bpy
from mathutils import Matrix

from bench.scenes.ingredients import collected, displaced, kneaded, roughened, scatter, subdivided
from demo_blend.primitives import (
    Pose,
    add_camera,
    add_cylinder,
    add_plane,
    add_sphere,
    add_sun,
    animate,
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
    scene.view_settings.exposure = -3.0
    _sky()
    add_sun("Sun", math.radians(0.6), 40, (-7, 3, 3.2), (1.0, 0.82, 0.6))

    soil = roughened(mottled_material("Soil", ((0.05, 0.04, 0.02), (0.10, 0.11, 0.04)), 2.0, roughness=0.95), 9.0, 0.05)
    ground = kneaded(subdivided(add_plane("Ground", (26, 26), soil), 6, smooth=False), 3.5, 1.6)
    scatter(ground, collected("Grass", _tufts()), 45.0, (0.5, 1.3), 1)
    scatter(ground, collected("Flowers", _flowers()), 1.6, (0.7, 1.2), 2)
    scatter(ground, collected("Rocks", _rocks()), 0.12, (0.3, 1.5), 3)
    scatter(ground, collected("Trees", [_tree()]), 0.03, (0.7, 1.2), 11)

    camera = add_camera((0, -9.0, 2.1), (0.5, 0, 1.1), 32, fstop=4.0)
    animate(camera, "location", {1: (-0.7, -9.0, 2.1), 24: (0.7, -8.8, 2.15)})
    scene.frame_set(scene.frame_current)
    return scene


def _sky() -> None:
    """Light the world by a low sun's sky."""
    world = set_world((0, 0, 0), 1.0)
    nodes = world.node_tree.nodes
    sky = nodes.new("ShaderNodeTexSky")
    sky.sun_disc = False
    sky.sun_elevation = math.radians(22)
    sky.sun_rotation = math.radians(-65)
    world.node_tree.links.new(sky.outputs["Color"], nodes["Background"].inputs["Color"])


def _tufts() -> list[bpy.types.Object]:
    """Return three tufts of bent blades, thin enough for light to shine through."""
    chance = random.Random(5)
    found = []
    for number, color in enumerate(((0.10, 0.20, 0.03), (0.17, 0.22, 0.04), (0.26, 0.22, 0.08))):
        vertices, faces = [], []
        for _ in range(28):
            turn, lean, tall = chance.uniform(0, 6.28), chance.uniform(0.05, 0.3), chance.uniform(0.15, 0.42)
            x, y = chance.gauss(0, 0.07), chance.gauss(0, 0.07)
            across, along = (math.cos(turn), math.sin(turn)), (-math.sin(turn), math.cos(turn))
            first = len(vertices)
            for step, width in ((0.0, 0.007), (0.5, 0.005), (0.85, 0.003), (1.0, 0.0005)):
                for side in (-width, width):
                    out = lean * step**2
                    vertices.append(
                        (x + side * across[0] + out * along[0], y + side * across[1] + out * along[1], tall * step)
                    )
            faces += [(first + i, first + i + 1, first + i + 3, first + i + 2) for i in (0, 2, 4)]
        mesh = bpy.data.meshes.new(f"Tuft {number}")
        mesh.from_pydata(vertices, [], faces)
        mesh.materials.append(material(f"Blade {number}", color, roughness=0.55, transmission_weight=0.15))
        mesh.shade_smooth()
        found.append(place(f"Tuft {number}", mesh))
    return found


def _flowers() -> list[bpy.types.Object]:
    """Return flowers of two colours: a stalk with a head."""
    stalk = material("Stalk", (0.10, 0.22, 0.05), roughness=0.7)
    found = []
    for name, color in (("Poppy", (0.65, 0.04, 0.02)), ("Daisy", (0.85, 0.83, 0.75))):
        petals = material(name, color, roughness=0.6, subsurface_weight=0.3, subsurface_scale=0.02)
        flower = add_cylinder(name, 0.006, 0.42, stalk, Pose())
        head = add_sphere(f"{name} head", 0.05, petals)
        flower.data.transform(_up(0.2))
        head.data.transform(_up(0.42))
        found.append(_joined(flower, head))
    return found


def _rocks() -> list[bpy.types.Object]:
    """Return two rocks with truly displaced surfaces."""
    found = []
    for number, color in enumerate(((0.26, 0.25, 0.23), (0.33, 0.28, 0.22))):
        stone = mottled_material(f"Rock {number}", (color, tuple(0.5 * part for part in color)), 5.0, roughness=0.9)
        rock = add_sphere(f"Rock {number}", 0.45, displaced(stone, 3.0 + number, 0.25))
        rock.data.transform(_up(0.1))
        found.append(subdivided(rock, 2))
    return found


def _tree() -> bpy.types.Object:
    """Return a tree: a trunk and a crown of leaves."""
    bark = roughened(material("Bark", (0.09, 0.06, 0.04), roughness=0.9), 20.0, 0.04)
    leaf = material("Leaf", (0.06, 0.14, 0.02), roughness=0.6)
    chance = random.Random(9)
    vertices, faces = [], []
    for _ in range(5000):
        way = [chance.gauss(0, 1) for _ in range(3)]
        length = math.hypot(*way)
        radius = 1.25 * chance.uniform(0.6, 1.0) * (1 + 0.25 * math.sin(4 * way[0] / length + 7 * way[2] / length))
        middle = [radius * part / length for part in way]
        middle[2] = 1.1 * middle[2] + 2.9
        first = len(vertices)
        one, other = ([chance.gauss(0, 0.05) for _ in range(3)] for _ in range(2))
        vertices += [
            tuple(m + a * p + b * q for m, p, q in zip(middle, one, other, strict=True))
            for a, b in ((-1, 0), (0, -1), (1, 0), (0, 1))
        ]
        faces.append((first, first + 1, first + 2, first + 3))
    mesh = bpy.data.meshes.new("Crown")
    mesh.from_pydata(vertices, [], faces)
    mesh.materials.append(leaf)
    trunk = add_cylinder("Tree", 0.16, 2.6, bark, taper=0.4)
    trunk.data.transform(_up(1.3))
    return _joined(trunk, place("Crown", mesh))


def _up(height: float) -> Matrix:
    return Matrix.Translation((0, 0, height))


def _joined(one: bpy.types.Object, other: bpy.types.Object) -> bpy.types.Object:
    """Join a second object's mesh to the first."""
    with bpy.context.temp_override(active_object=one, selected_editable_objects=[one, other]):
        bpy.ops.object.join()
    return one
