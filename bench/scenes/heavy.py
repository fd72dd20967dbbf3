# SPDX-License-Identifier: GPL-3.0-or-later
"""Two thousand objects and five level-5 subdivision surfaces, one of them deforming: much to sync, for wall times."""

import math
import random

from demo_blend.primitives import (
    Pose,
    add_area_light,
    add_box,
    add_camera,
    add_plane,
    add_torus,
    animate,
    copy_of,
    empty_scene,
    material,
    set_world,
)

BOXES = 1994  # with the ground and the five subdivided tori: 2,000 objects


def build():
    """Build the scene and return it."""
    scene = empty_scene()
    scene.render.use_motion_blur = True
    set_world((0.25, 0.32, 0.42), 0.6)
    add_plane("Ground", (80, 80), material("Ground", (0.35, 0.34, 0.32), roughness=0.8))
    _boxes()
    _knots()
    add_area_light("Key", 4.0, 9000, (-9, -12, 14), (0, 6, 0), (1.0, 0.92, 0.8))
    camera = add_camera((0, -11, 5.0), (0, 4, 0.6), 35)
    animate(camera, "location", {1: (-1.2, -11, 5.0), 24: (1.2, -11, 5.0)})
    return scene


def _boxes() -> None:
    """Add a town of instanced boxes; every tenth one moves."""
    chance = random.Random(2)
    first = [
        add_box(
            f"Block {i}",
            (0.35, 0.35, 0.5),
            material(f"Block {i}", color, roughness=0.5),
            Pose((-30, 60 + i, 0)),
            bevel=0.03,
        )
        for i, color in enumerate(((0.55, 0.50, 0.42), (0.50, 0.20, 0.12), (0.15, 0.25, 0.35)))
    ]
    for i in range(BOXES - len(first)):
        x, y = chance.uniform(-16, 16), chance.uniform(-4, 30)
        box = copy_of(first[i % 3], f"Box {i}", Pose((x, y, 0.25), (0, 0, chance.random() * 3)))
        box.scale.z = chance.uniform(0.6, 2.2)
        if i % 10 == 0:
            animate(box, "location", {1: (x - 1, y, 0.25), 24: (x + 1, y, 0.25)})


def _knots() -> None:
    """Add five coarse tori under subdivision level 5; the first one waves."""
    for i in range(5):
        paint = material(
            f"Knot {i + 1}", ((0.7, 0.25, 0.1), (0.2, 0.4, 0.6))[i % 2], roughness=0.25, metallic=float(i % 2)
        )
        pose = Pose((-4.0 + 2.0 * i, -3.0, 1.3), (math.radians(70), 0, 0.4 * i))
        knot = add_torus(f"Knot {i + 1}", (0.65, 0.25), paint, pose, segments=(12, 8))
        if i == 0:
            wave = knot.modifiers.new("Wave", "WAVE")
            wave.height, wave.width, wave.speed = 0.3, 0.6, 0.2
        subdivision = knot.modifiers.new("Subdivision", "SUBSURF")
        subdivision.levels = 1
        subdivision.render_levels = 5
