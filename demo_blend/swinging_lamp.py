# SPDX-License-Identifier: GPL-3.0-or-later
"""A lamp swings over a chess problem: its light moves and flickers, which Cycles by itself does not blur."""

import math

from demo_blend.primitives import (
    Pose,
    add_box,
    add_camera,
    add_cylinder,
    add_plane,
    add_point_light,
    add_sphere,
    animate,
    checkered_material,
    emission,
    empty_scene,
    material,
    mesh_of_revolution,
    place,
    set_world,
)
from demo_blend.round_lens import PAWN

#: Outlines of (radius, height) for the lathe.
BISHOP = ((0.0, 0.0), (0.34, 0.0), (0.36, 0.06), (0.28, 0.14), (0.26, 0.20), (0.16, 0.34), (0.11, 0.70), (0.12, 0.80),
          (0.20, 0.84), (0.14, 0.90), (0.20, 1.02), (0.19, 1.14), (0.10, 1.28), (0.05, 1.32), (0.06, 1.36),
          (0.0, 1.40))  # fmt: skip
ROOK = ((0.0, 0.0), (0.36, 0.0), (0.37, 0.07), (0.28, 0.15), (0.26, 0.22), (0.20, 0.32), (0.18, 0.70), (0.20, 0.76),
        (0.27, 0.80), (0.27, 1.02), (0.20, 1.02), (0.20, 0.92), (0.0, 0.92))  # fmt: skip
SHADE = ((0.05, 0.34), (0.08, 0.34), (0.12, 0.30), (0.42, 0.0), (0.41, 0.0), (0.10, 0.29), (0.05, 0.32))


def build():
    """Build the scene and return it."""
    scene = empty_scene()
    scene.render.use_motion_blur = True
    scene.cycles.caustics_reflective = False
    set_world((0.012, 0.016, 0.024))
    wood = checkered_material("Board", ((0.60, 0.46, 0.28), (0.11, 0.05, 0.025)), 1.0, roughness=0.35)
    frame = material("Frame", (0.16, 0.08, 0.04), roughness=0.3)
    cloth = material("Cloth", (0.06, 0.10, 0.09), roughness=0.95)
    add_plane("Table", (40, 40), cloth, Pose((0, 0, -0.25)))
    add_plane("Wall", (40, 20), cloth, Pose((0, 9, 5), (math.radians(90), 0, 0)))
    add_box("Frame", (8.7, 8.7, 0.24), frame, Pose((0, 0, -0.125)), bevel=0.05)
    add_plane("Board", (8, 8), wood, Pose((0, 0, 0.001)))

    ivory = material("Ivory", (0.80, 0.72, 0.58), roughness=0.28)
    ebony = material("Ebony", (0.045, 0.035, 0.032), roughness=0.25)
    for side, paint, men in (
        (
            "White",
            ivory,
            ((PAWN, ((-0.5, -1.5), (0.5, -2.5), (2.5, -0.5))), (BISHOP, ((1.5, -1.5),)), (ROOK, ((-2.5, -2.5),))),
        ),
        (
            "Black",
            ebony,
            ((PAWN, ((-1.5, 1.5), (0.5, 0.5), (1.5, 2.5))), (BISHOP, ((-2.5, 0.5),)), (ROOK, ((2.5, 1.5),))),
        ),
    ):
        for kind, (outline, squares) in enumerate(men):
            mesh = mesh_of_revolution(f"{side} {kind}", outline, paint)
            for x, y in squares:
                place(f"{side} {kind} {x} {y}", mesh, Pose((x, y, 0)))
    _lamp(scene)
    add_camera((4.2, -7.8, 4.6), (0.0, 0.2, 1.55), 38)
    return scene


def _lamp(scene) -> None:
    """Add a lamp on a long cord, and swing it; its power flickers with a period of three frames."""
    enamel = material("Enamel", (0.05, 0.12, 0.10), roughness=0.3)
    pivot = place("Pivot", None, Pose((0, 0.6, 7.1)))
    hang = -4.5
    place("Shade", mesh_of_revolution("Shade", SHADE, enamel), Pose((0, 0, hang), parent=pivot))
    add_cylinder("Cord", 0.015, -hang - 0.3, enamel, Pose((0, 0, (hang + 0.3) / 2), parent=pivot))
    bulb = emission("Bulb", (1.0, 0.72, 0.42), 30.0)
    bulb.cycles.emission_sampling = "NONE"  # the lamp in it is what lights
    globe = add_sphere("Bulb", 0.14, bulb, Pose((0, 0, hang - 0.04), parent=pivot))
    globe.visible_shadow = globe.visible_diffuse = globe.visible_glossy = False
    lamp = add_point_light("Lamp", 0.14, 1000, (0, 0, hang - 0.04), (1.0, 0.72, 0.42))
    lamp.parent = pivot
    period = 16
    frames = range(scene.frame_start - 1, scene.frame_end + 2)
    animate(
        pivot,
        "rotation_euler",
        {f: (0.0, math.radians(26) * math.sin(2 * math.pi * (f - 12) / period), 0.0) for f in frames},
    )
    animate(lamp.data, "energy", {f: 1000 * (1.0 + 0.35 * math.sin(2 * math.pi * f / 3)) for f in frames})
    scene.frame_set(12)
