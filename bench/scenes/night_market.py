# SPDX-License-Identifier: GPL-3.0-or-later
"""A market at night after rain: fifty bulbs over stalls, crates of fruit as collection instances, wet cobbles."""

import itertools
import math
import random

import bpy

from bench.scenes.ingredients import collected, place_collection, roughened
from demo_blend.primitives import (
    Pose,
    add_area_light,
    add_box,
    add_camera,
    add_cylinder,
    add_plane,
    add_point_light,
    add_sphere,
    animate,
    checkered_material,
    copy_of,
    emission,
    empty_scene,
    material,
    mottled_material,
    set_world,
)

#: Strings of bulbs across the street, and bulbs on each; with the shop's two windows that makes 50 lamps.
STRINGS, BULBS = 6, 8


def build():
    """Build the scene and return it."""
    scene = empty_scene()
    scene.render.use_motion_blur = True
    set_world((0.02, 0.03, 0.07), 1.0)
    _street()
    _bulbs()
    crates = [_crate(i, color) for i, color in enumerate(((0.75, 0.25, 0.02), (0.55, 0.03, 0.03), (0.25, 0.42, 0.05)))]
    for side in (-1, 1):
        for i in range(4):
            _stall(side, i, crates)
    for i, x in enumerate((-3.85, 3.85)):
        add_area_light(f"Shop {i}", 1.5, 60, (x, 6.5, 1.8), (0, 6.0, 0.8), ((0.6, 0.8, 1.0), (1.0, 0.45, 0.6))[i])
    camera = add_camera((0.2, -6.0, 1.6), (0.0, 3, 1.35), 30, fstop=2.8)
    animate(camera, "location", {1: (0.05, -6.3, 1.6), 24: (0.35, -5.7, 1.6)})
    scene.frame_set(scene.frame_current)
    return scene


def _street() -> None:
    """Add wet cobbles and house fronts of brick."""
    cobbles = mottled_material("Cobbles", ((0.07, 0.065, 0.06), (0.13, 0.12, 0.11)), 2.0, roughness=0.16)
    add_plane("Street", (8, 30), roughened(cobbles, 6.0, 0.035, "ShaderNodeTexVoronoi"), Pose((0, 6, 0)))
    brick = roughened(
        mottled_material("Brick", ((0.22, 0.09, 0.05), (0.30, 0.15, 0.09)), 4.0, roughness=0.85),
        1.6,
        0.02,
        "ShaderNodeTexBrick",
    )
    for side in (-1, 1):
        add_plane(f"Front {side}", (30, 7), brick, Pose((side * 4, 6, 3.5), (math.pi / 2, 0, -side * math.pi / 2)))
    add_plane("End", (8, 7), brick, Pose((0, 15, 3.5), (math.pi / 2, 0, 0)))
    pane = emission("Lit window", (1.0, 0.7, 0.35), 1.5)
    for side in (-1, 1):
        for i in range(5):
            add_box(f"Window {side} {i}", (0.04, 0.8, 1.1), pane, Pose((side * 3.99, 1.5 + 2.8 * i, 3.9)))


def _bulbs() -> None:
    """Add strings of bulbs that sag across the street."""
    wire = material("Wire", (0.02, 0.02, 0.02), roughness=0.6)
    glow = emission("Bulb", (1.0, 0.72, 0.4), 25.0)
    bulb, cord = add_sphere("Bulb", 0.035, glow, Pose((0, -30, 0))), add_cylinder("Cord", 0.006, 1.0, wire)
    cord.location.y = -30
    for string in range(STRINGS):
        y = -2.0 + 2.6 * string
        knots = [
            (-3.6 + 7.2 * i / (BULBS + 1), y, 2.75 + 0.09 * (i - (BULBS + 1) / 2) ** 2 / 2) for i in range(BULBS + 2)
        ]
        for i, (x, _, z) in enumerate(knots[1:-1]):
            copy_of(bulb, f"Bulb {string} {i}", Pose((x, y, z - 0.06)))
            add_point_light(f"Lamp {string} {i}", 0.04, 16, (x, y, z - 0.12), (1.0, 0.70, 0.38))
        for i, (one, other) in enumerate(itertools.pairwise(knots)):
            run, rise = other[0] - one[0], other[2] - one[2]
            middle = Pose((one[0] + run / 2, y, one[2] + rise / 2), (0, math.atan2(run, rise), 0))
            copy_of(cord, f"Cord {string} {i}", middle).scale.z = math.hypot(run, rise)


def _crate(number: int, color) -> bpy.types.Collection:
    """Return a collection of a wooden crate with fruit."""
    wood = roughened(mottled_material(f"Slats {number}", ((0.30, 0.19, 0.10), (0.20, 0.12, 0.06)), 9.0), 30.0, 0.004)
    skin = mottled_material(f"Fruit {number}", (color, tuple(0.6 * part for part in color)), 14.0, roughness=0.25)
    sides = [
        add_box(f"Side {number} {i}", size, wood, Pose(where))
        for i, (size, where) in enumerate(
            (
                ((0.5, 0.02, 0.2), (0, -0.18, 0.1)),
                ((0.5, 0.02, 0.2), (0, 0.18, 0.1)),
                ((0.02, 0.36, 0.2), (-0.25, 0, 0.1)),
                ((0.02, 0.36, 0.2), (0.25, 0, 0.1)),
                ((0.5, 0.36, 0.02), (0, 0, 0.01)),
            )
        )
    ]
    first = add_sphere(f"Fruit {number}", 0.045, skin, Pose((0, 0, 0.2)))
    chance = random.Random(number)
    others = [
        copy_of(
            first,
            f"Fruit {number} {i}",
            Pose((chance.uniform(-0.2, 0.2), chance.uniform(-0.13, 0.13), chance.uniform(0.12, 0.23))),
        )
        for i in range(45)
    ]
    return collected(f"Crate {number}", [*sides, first, *others])


def _stall(side: int, number: int, crates) -> None:
    """Add a stall: a counter of crates below a striped awning."""
    x, y = 2.7 * side, -1.6 + 3.0 * number
    wood = bpy.data.materials.get("Counter") or material("Counter", (0.18, 0.10, 0.05), roughness=0.6)
    stripes = ((0.6, 0.08, 0.06), (0.08, 0.25, 0.45), (0.10, 0.35, 0.15), (0.6, 0.42, 0.08))[(number + (side > 0)) % 4]
    cloth = checkered_material(f"Awning {side} {number}", (stripes, (0.75, 0.72, 0.66)), 3.0, roughness=0.9)
    add_box(f"Counter {side} {number}", (1.1, 2.2, 0.75), wood, Pose((x, y, 0.375)))
    add_box(f"Awning {side} {number}", (1.6, 2.4, 0.02), cloth, Pose((x, y, 2.2), (0, 0.3 * side, 0)))
    for end in (-1, 1):
        add_cylinder(f"Post {side} {number} {end}", 0.03, 2.1, wood, Pose((x - 0.6 * side, y + 1.1 * end, 1.05)))
    chance = random.Random(10 * number + side)
    for row in range(2):
        for column in range(5):
            where = (x + (0.25 - 0.5 * row) * side, y - 0.86 + 0.43 * column, 0.76)
            turn = (0, 0, math.pi / 2 + chance.gauss(0, 0.05))
            place_collection(f"Crate {side} {number} {row} {column}", chance.choice(crates), Pose(where, turn))
