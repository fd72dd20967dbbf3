# SPDX-License-Identifier: GPL-3.0-or-later
"""A pavilion under one sun, at rest: nothing for the switch to gain, and so nothing that it may cost."""

import math

from demo_blend.primitives import Pose, add_box, add_camera, add_cylinder, add_plane, add_sun, empty_scene, material


def build():
    """Build the scene and return it."""
    scene = empty_scene()
    stone, grass = material("Stone", (0.6, 0.57, 0.5), roughness=0.9), material("Grass", (0.12, 0.2, 0.05))
    add_plane("Lawn", (60, 60), grass)
    for k in range(8):
        turn = k * math.tau / 8
        add_cylinder(f"Column {k}", 0.25, 3.0, stone, Pose((3 * math.cos(turn), 3 * math.sin(turn), 1.5)))
    add_cylinder("Roof", 3.6, 0.5, stone, Pose((0, 0, 3.25)))
    add_box("Step", (8, 8, 0.2), stone, Pose((0, 0, 0.1)))
    add_sun("Sun", 0.0, 3, (-6, -5, 6), (1.0, 0.95, 0.85))
    add_camera((6, -9, 3), (0, 0, 1.5), 32)
    return scene
