# SPDX-License-Identifier: GPL-3.0-or-later
"""A dining room in the evening: daylight from a window, three lamps over the table, and light off every wall."""

import math
import random

from demo_blend.primitives import (
    Pose,
    add_area_light,
    add_box,
    add_camera,
    add_cylinder,
    add_plane,
    add_point_light,
    add_sphere,
    checkered_material,
    copy_of,
    empty_scene,
    material,
    mesh_of_revolution,
    mottled_material,
    place,
)

QUARTER = math.radians(90)

#: Outlines of (radius, height) for the lathe.
BOWL = ((0.0, 0.0), (0.07, 0.0), (0.08, 0.015), (0.13, 0.05), (0.165, 0.10), (0.175, 0.10), (0.14, 0.05), (0.0, 0.025))
VASE = ((0.0, 0.0), (0.07, 0.0), (0.11, 0.08), (0.12, 0.16), (0.07, 0.27), (0.045, 0.33), (0.065, 0.37), (0.05, 0.37),
        (0.035, 0.32), (0.0, 0.2))  # fmt: skip
SHADE = ((0.03, 0.20), (0.05, 0.20), (0.10, 0.14), (0.20, 0.0), (0.19, 0.0), (0.09, 0.13), (0.03, 0.19))


def build():
    """Build the scene and return it."""
    scene = empty_scene()
    scene.cycles.caustics_reflective = False
    scene.view_settings.exposure = 0.4
    _shell()
    _table()
    _chairs()
    _shelves()
    add_area_light("Window", 1.5, 110, (-2.85, 0.2, 1.55), (0, 0.6, 0.8), (0.55, 0.75, 1.0))
    brass = material("Brass", (0.80, 0.58, 0.25), roughness=0.3, metallic=1.0)
    shade = mesh_of_revolution("Shade", SHADE, material("Enamel", (0.55, 0.16, 0.05), roughness=0.4))
    for i, x in enumerate((-0.75, 0.0, 0.75)):
        place(f"Shade {i + 1}", shade, Pose((x, 0.7, 1.72)))
        add_cylinder(f"Cord {i + 1}", 0.006, 0.9, brass, Pose((x, 0.7, 2.35)))
        add_point_light(f"Lamp {i + 1}", 0.08, 34, (x, 0.7, 1.69), (1.0, 0.68, 0.38))
    add_camera((1.35, -3.0, 1.5), (-0.15, 0.9, 0.98), 27, fstop=1.8)
    return scene


def _shell() -> None:
    """Add floor, ceiling and four walls, all facing inwards."""
    wall = material("Wall", (0.66, 0.62, 0.54), roughness=0.9)
    accent = material("Green wall", (0.10, 0.19, 0.15), roughness=0.8)
    floor = checkered_material("Floor", ((0.55, 0.52, 0.47), (0.14, 0.13, 0.13)), 2.0, roughness=0.3)
    white = material("Ceiling", (0.78, 0.76, 0.72), roughness=0.95)
    add_plane("Floor", (6, 8), floor, Pose((0, -1, 0)))
    add_plane("Ceiling", (6, 8), white, Pose((0, -1, 2.8), (math.pi, 0, 0)))
    add_plane("Back wall", (6, 2.8), accent, Pose((0, 2.6, 1.4), (QUARTER, 0, 0)))
    add_plane("Front wall", (6, 2.8), wall, Pose((0, -5, 1.4), (-QUARTER, 0, 0)))
    add_plane("Left wall", (2.8, 8), wall, Pose((-3, -1, 1.4), (0, QUARTER, 0)))
    add_plane("Right wall", (2.8, 8), wall, Pose((3, -1, 1.4), (0, -QUARTER, 0)))
    frame = material("Window frame", (0.7, 0.7, 0.68), roughness=0.5)
    for y in (-0.6, 0.2, 1.0):
        add_box(f"Mullion {y}", (0.08, 0.06, 1.7), frame, Pose((-2.94, y, 1.55)))
    for z in (0.7, 2.4):
        add_box(f"Transom {z}", (0.08, 1.7, 0.06), frame, Pose((-2.94, 0.2, z)))


def _table() -> None:
    """Add the table and what is on it."""
    oak = mottled_material("Oak", ((0.28, 0.16, 0.08), (0.40, 0.24, 0.12)), 5.0, roughness=0.35)
    china = material("China", (0.72, 0.72, 0.70), roughness=0.12)
    blue = material("Blue glaze", (0.03, 0.12, 0.30), roughness=0.1)
    steel = material("Steel", (0.65, 0.66, 0.68), roughness=0.18, metallic=1.0)
    orange = material("Orange", (0.85, 0.30, 0.03), roughness=0.45)
    add_box("Table top", (2.4, 1.0, 0.05), oak, Pose((0, 0.7, 0.74)), bevel=0.015)
    for x in (-1.05, 1.05):
        for y in (0.32, 1.08):
            add_box(f"Table leg {x} {y}", (0.07, 0.07, 0.715), oak, Pose((x, y, 0.3575)))
    bowl = mesh_of_revolution("Bowl", BOWL, china)
    for i, (x, y) in enumerate(((-0.75, 0.42), (0.15, 0.40), (-0.35, 1.0), (0.6, 0.98))):
        place(f"Bowl {i + 1}", bowl, Pose((x, y, 0.765), (0, 0, 0)))
    place("Vase", mesh_of_revolution("Vase", VASE, blue), Pose((-0.18, 0.72, 0.765)))
    tray = add_cylinder("Tray", 0.24, 0.02, steel, Pose((0.62, 0.55, 0.775)))
    chance = random.Random(4)
    for i in range(5):
        turn = 2 * math.pi * i / 5
        place_at = (0.11 * math.cos(turn), 0.11 * math.sin(turn), 0.05)
        add_sphere(f"Orange {i + 1}", chance.uniform(0.042, 0.05), orange, Pose(place_at, parent=tray))


def _chairs() -> None:
    """Add four chairs of a seat, a back and legs, all of the same meshes."""
    wood = material("Chair", (0.30, 0.06, 0.035), roughness=0.4)
    first = None
    for i, (x, y, turn) in enumerate(((-0.6, 0.02, 0.1), (0.75, -0.08, -0.35), (-0.5, 1.4, math.pi), (0.6, 1.4, 3.0))):
        stand = place(f"Chair {i + 1}", None, Pose((x, y, 0), (0, 0, turn)))
        if first is None:
            first = [
                add_box("Seat", (0.42, 0.42, 0.04), wood, Pose((0, 0, 0.45), parent=stand), bevel=0.012),
                add_box("Back", (0.40, 0.025, 0.16), wood, Pose((0, -0.2, 0.82), parent=stand), bevel=0.01),
                *(
                    add_cylinder("Leg", 0.018, height, wood, Pose((a, b, height / 2), parent=stand))
                    for a, b, height in ((-0.18, 0.18, 0.44), (0.18, 0.18, 0.44), (-0.18, -0.2, 0.9), (0.18, -0.2, 0.9))
                ),
            ]
        else:
            for part in first:
                copy_of(part, f"{part.name} of {stand.name}", Pose(part.location, parent=stand))


def _shelves() -> None:
    """Add two shelves of books on the back wall, and a picture between."""
    oak = material("Shelf", (0.30, 0.18, 0.09), roughness=0.5)
    chance = random.Random(21)
    covers = [
        material(f"Cover {i + 1}", color, roughness=0.7)
        for i, color in enumerate(((0.45, 0.07, 0.05), (0.08, 0.13, 0.26), (0.60, 0.45, 0.16), (0.62, 0.58, 0.48)))
    ]
    for side in (-1, 1):
        for height in (1.05, 1.5, 1.95):
            middle = side * 1.75
            add_box(f"Shelf {side} {height}", (1.5, 0.28, 0.03), oak, Pose((middle, 2.45, height)))
            x = middle - 0.7
            while x < middle + 0.55 * chance.uniform(0.3, 1.0):
                thick, tall = chance.uniform(0.025, 0.06), chance.uniform(0.2, 0.31)
                pose = Pose((x + thick / 2, 2.44, height + 0.015 + tall / 2))
                add_box(f"Book {x:.2f} {height}", (thick * 0.94, 0.2, tall), chance.choice(covers), pose)
                x += thick
    canvas = mottled_material("Canvas", ((0.75, 0.42, 0.12), (0.10, 0.22, 0.42)), 3.0, roughness=0.7)
    add_box("Picture", (1.1, 0.04, 0.8), canvas, Pose((0.0, 2.57, 1.6)))
