# SPDX-License-Identifier: GPL-3.0-or-later
"""A living room at dusk: a window, a ceiling light, two lamps, and much light that has bounced off the walls."""

import math

from demo_blend.primitives import (
    Pose,
    add_area_light,
    add_box,
    add_camera,
    add_cylinder,
    add_plane,
    add_point_light,
    add_sphere,
    empty_scene,
    material,
    mottled_material,
)

QUARTER = math.radians(90)


def build():
    """Build the scene and return it."""
    scene = empty_scene()
    _shell()
    _furniture()
    add_area_light("Window", 1.4, 60, (-2.9, 0.2, 1.6), (0, 0.4, 0.8), (0.65, 0.8, 1.0))
    add_area_light("Ceiling", 0.7, 35, (0.4, 0.2, 2.65), (0.4, 0.2, 0), (1.0, 0.9, 0.75))
    add_point_light("Floor lamp", 0.09, 30, (2.3, 1.55, 1.62), (1.0, 0.72, 0.42))
    add_point_light("Table lamp", 0.06, 14, (-2.2, 1.6, 1.02), (1.0, 0.65, 0.35))
    add_camera((0.5, -3.2, 1.45), (0.0, 1.2, 1.0), 24, fstop=2.8)
    return scene


def _shell() -> None:
    """Add floor, ceiling and four walls, all facing inwards."""
    wall = material("Wall", (0.70, 0.66, 0.58), roughness=0.9)
    accent = material("Accent wall", (0.16, 0.30, 0.30), roughness=0.9)
    boards = mottled_material("Boards", ((0.30, 0.17, 0.09), (0.40, 0.24, 0.13)), 3.0, roughness=0.35)
    white = material("Ceiling", (0.8, 0.8, 0.78), roughness=0.95)
    add_plane("Floor", (6, 7), boards, Pose((0, -1, 0)))
    add_plane("Ceiling", (6, 7), white, Pose((0, -1, 2.7), (math.pi, 0, 0)))
    add_plane("Back wall", (6, 2.7), accent, Pose((0, 2.5, 1.35), (QUARTER, 0, 0)))
    add_plane("Front wall", (6, 2.7), wall, Pose((0, -4.5, 1.35), (-QUARTER, 0, 0)))
    add_plane("Left wall", (2.7, 7), wall, Pose((-3, -1, 1.35), (0, QUARTER, 0)))
    add_plane("Right wall", (2.7, 7), wall, Pose((3, -1, 1.35), (0, -QUARTER, 0)))


def _furniture() -> None:
    """Add a sofa, a table with things on it, two lamps' stands and shades, a rug and a picture."""
    cloth = material("Cloth", (0.45, 0.16, 0.10), roughness=0.85)
    wood = material("Wood", (0.35, 0.20, 0.10), roughness=0.4)
    brass = material("Brass", (0.75, 0.55, 0.25), roughness=0.25, metallic=1.0)
    glazed = material("Glazed", (0.10, 0.25, 0.45), roughness=0.12)
    rug = material("Rug", (0.55, 0.48, 0.36), roughness=0.95)
    canvas = mottled_material("Canvas", ((0.7, 0.3, 0.1), (0.1, 0.2, 0.5)), 4.0, roughness=0.7)

    add_box("Sofa seat", (2.2, 0.9, 0.42), cloth, Pose((0, 1.75, 0.24)), bevel=0.06)
    add_box("Sofa back", (2.2, 0.25, 0.85), cloth, Pose((0, 2.2, 0.5)), bevel=0.06)
    for side in (-1, 1):
        add_box(f"Sofa arm {side}", (0.25, 0.9, 0.62), cloth, Pose((side * 1.2, 1.75, 0.33)), bevel=0.06)
    add_box("Rug", (3.0, 1.8, 0.02), rug, Pose((0, 0.35, 0.01)))
    add_box("Table top", (1.1, 0.6, 0.05), wood, Pose((0, 0.45, 0.42)), bevel=0.01)
    for x, y in ((-0.48, 0.22), (0.48, 0.22), (-0.48, 0.68), (0.48, 0.68)):
        add_cylinder(f"Leg {x} {y}", 0.025, 0.4, wood, Pose((x, y, 0.2)))
    add_sphere("Vase", 0.13, glazed, Pose((-0.22, 0.5, 0.575)))
    add_sphere("Ball", 0.09, brass, Pose((0.2, 0.38, 0.535)))
    add_box("Picture", (1.3, 0.04, 0.8), canvas, Pose((-0.1, 2.47, 1.75)))
    add_cylinder("Floor lamp stand", 0.02, 1.5, brass, Pose((2.3, 1.55, 0.75)))
    add_cylinder("Floor lamp dish", 0.22, 0.08, brass, Pose((2.3, 1.55, 1.47)), taper=1.3)
    add_box("Side table", (0.5, 0.5, 0.8), wood, Pose((-2.2, 1.6, 0.4)), bevel=0.01)
    add_cylinder("Table lamp foot", 0.1, 0.12, brass, Pose((-2.2, 1.6, 0.86)), taper=0.4)
