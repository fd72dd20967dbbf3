# SPDX-License-Identifier: GPL-3.0-or-later
"""Neon rings and tubes over a wet-looking street corner: emissive meshes are the only light; one ring turns."""

import math

from demo_blend.primitives import (
    Pose,
    add_box,
    add_camera,
    add_cylinder,
    add_plane,
    add_sphere,
    add_torus,
    emission,
    empty_scene,
    material,
    mottled_material,
    place,
    spin,
)

QUARTER = math.radians(90)


def build():
    """Build the scene and return it."""
    scene = empty_scene()
    scene.render.use_motion_blur = True
    brick = mottled_material("Wall", ((0.24, 0.13, 0.10), (0.34, 0.22, 0.17)), 2.5, roughness=0.85)
    wet = material("Pavement", (0.10, 0.10, 0.12), roughness=0.22)
    add_plane("Pavement", (20, 20), wet)
    add_plane("Wall", (20, 10), brick, Pose((0, 1.6, 5), (QUARTER, 0, 0)))

    pink = emission("Pink neon", (1.0, 0.10, 0.35), 22.0)
    blue = emission("Blue neon", (0.12, 0.40, 1.0), 26.0)
    amber = emission("Amber neon", (1.0, 0.50, 0.08), 18.0)
    mount = place("Mount", None, Pose((-0.9, 1.35, 2.1), (QUARTER, 0, 0)))
    ring = add_torus("Ring", (0.72, 0.035), pink, Pose(parent=mount), segments=(48, 10))
    for i in range(3):
        turn = 2 * math.pi * i / 3
        pose = Pose((0.36 * math.cos(turn), 0.36 * math.sin(turn), 0), (0, QUARTER, turn), ring)
        add_cylinder(f"Ray {i + 1}", 0.03, 0.66, amber, pose)
    spin(ring, math.radians(22))
    for i in range(3):
        add_cylinder(f"Tube {i + 1}", 0.03, 1.3, blue, Pose((0.95, 1.45, 1.6 + 0.35 * i), (0, QUARTER, 0)))
    add_box("Lamp box", (0.5, 0.12, 0.9), emission("Lamp box", (1.0, 0.85, 0.6), 9.0), Pose((2.3, 1.45, 1.2)))

    iron = material("Iron", (0.15, 0.15, 0.16), roughness=0.4, metallic=1.0)
    paint = material("Bin", (0.08, 0.22, 0.12), roughness=0.4)
    add_cylinder("Bin", 0.33, 0.85, paint, Pose((-1.9, 0.55, 0.425)), taper=1.12)
    add_cylinder("Bollard", 0.1, 0.9, iron, Pose((0.5, 0.0, 0.45)))
    add_sphere("Bollard head", 0.14, iron, Pose((0.5, 0.0, 0.95)))
    add_box(
        "Crate",
        (0.6, 0.6, 0.5),
        material("Crate", (0.45, 0.30, 0.15), roughness=0.8),
        Pose((1.5, 0.4, 0.25), (0, 0, 0.5)),
    )
    add_camera((0.1, -5.6, 1.6), (0.1, 1.2, 1.4), 35)
    return scene
