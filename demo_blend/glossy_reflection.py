# SPDX-License-Identifier: GPL-3.0-or-later
"""Figures 13 and 14 of the paper: blocks and balls on a rough metal plate, whose reflections blur with distance."""

import math

from demo_blend.primitives import (
    Pose,
    add_box,
    add_camera,
    add_cylinder,
    add_plane,
    add_point_light,
    add_sphere,
    add_torus,
    checkered_material,
    empty_scene,
    light_as_in_1991,
    material,
    set_world,
)


def build():
    """Build the scene and return it."""
    scene = empty_scene()
    set_world((0.03, 0.045, 0.07))
    plate = material("Plate", (0.80, 0.82, 0.85), roughness=0.2, metallic=1.0)
    add_plane("Plate", (60, 60), plate)

    tiles = checkered_material("Tiles", ((0.75, 0.70, 0.60), (0.10, 0.16, 0.30)), 1.6, specular_ior_level=0.0)
    add_box("Wall", (6.4, 0.2, 2.6), tiles, Pose((0, 2.6, 1.3)))
    paints = {
        name: material(name, color, specular_ior_level=0.0)
        for name, color in {
            "Red": (0.62, 0.06, 0.04),
            "Yellow": (0.82, 0.50, 0.06),
            "White": (0.80, 0.78, 0.74),
            "Green": (0.10, 0.32, 0.12),
        }.items()
    }
    add_box("Red tower", (0.45, 0.45, 2.2), paints["Red"], Pose((-2.1, 0.6, 1.1), (0, 0, 0.4)), bevel=0.02)
    add_box("White tower", (0.4, 0.4, 1.5), paints["White"], Pose((-1.35, -0.4, 0.75), (0, 0, -0.3)), bevel=0.02)
    add_sphere("Yellow ball", 0.62, paints["Yellow"], Pose((0.2, 0.2, 0.62)))
    add_cylinder("Green cone", 0.55, 1.7, paints["Green"], Pose((1.75, 0.7, 0.85)), taper=0.0)
    add_torus("Red ring", (0.5, 0.13), paints["Red"], Pose((1.05, -0.75, 0.62), (math.radians(80), 0, 0.5)))
    add_sphere("White ball", 0.26, paints["White"], Pose((-0.55, -1.0, 0.26)))

    add_point_light("Key", 0.0, 850, (-3.2, -4.2, 5.2), (1.0, 0.95, 0.88))
    add_camera((0.3, -6.6, 1.75), (0.0, 0.0, 0.55), 45)
    light_as_in_1991(ambient=0.15, reflections=1)
    return scene
