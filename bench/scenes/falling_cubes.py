# SPDX-License-Identifier: GPL-3.0-or-later
"""Cubes tumble past a wall under one area light: object motion, translation and spin, through a pinhole."""

import math
import random

from demo_blend.primitives import (
    Pose,
    add_area_light,
    add_box,
    add_camera,
    add_plane,
    animate,
    empty_scene,
    material,
)

PALETTE = ((0.70, 0.12, 0.08), (0.75, 0.48, 0.10), (0.12, 0.35, 0.50), (0.20, 0.42, 0.18), (0.62, 0.60, 0.56))


def build():
    """Build the scene and return it."""
    scene = empty_scene()
    scene.render.use_motion_blur = True
    grey = material("Ground", (0.55, 0.55, 0.57), roughness=0.8)
    add_plane("Ground", (30, 30), grey)
    add_plane("Wall", (30, 15), grey, Pose((0, 3, 7.5), (math.radians(90), 0, 0)))

    chance = random.Random(5)
    paints = [material(f"Paint {i + 1}", color, roughness=0.4) for i, color in enumerate(PALETTE)]
    for i in range(26):
        size = chance.uniform(0.25, 0.7)
        paint = paints[i % len(paints)]
        x, y = chance.uniform(-3.4, 3.4), chance.uniform(-1.5, 2.2)
        if i < 10:  # already down
            add_box(
                f"Cube {i + 1}", (size,) * 3, paint, Pose((x, y, size / 2), (0, 0, chance.random() * 3)), bevel=0.02
            )
        else:
            _falling(f"Cube {i + 1}", size, paint, (x, y, chance.uniform(0.9, 4.2)), chance)

    add_area_light("Key", 2.0, 900, (3.5, -3.5, 6.0), (0, 0.5, 1.0))
    add_camera((0, -9.5, 2.4), (0, 0, 2.0), 42)
    return scene


def _falling(name, size, paint, middle, chance) -> None:
    """Add a cube that passes `middle` at the still's frame, falling and turning."""
    cube = add_box(name, (size,) * 3, paint, bevel=0.02)
    drop = chance.uniform(0.15, 0.5)
    turn = [chance.uniform(-0.35, 0.35) for _ in range(3)]
    keys = (1, 24)
    animate(cube, "location", {f: (*middle[:2], middle[2] - drop * (f - 12)) for f in keys})
    animate(cube, "rotation_euler", {f: tuple(t * (f - 5) for t in turn) for f in keys})
