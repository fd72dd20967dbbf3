# SPDX-License-Identifier: GPL-3.0-or-later
"""Fruit and pottery under key, fill and rim light: nothing moves, the lens is a pinhole, three lights."""

from demo_blend.primitives import (
    Pose,
    add_area_light,
    add_box,
    add_camera,
    add_cylinder,
    add_plane,
    add_point_light,
    add_sphere,
    add_torus,
    empty_scene,
    material,
    mottled_material,
)


def build():
    """Build the scene and return it."""
    scene = empty_scene()
    wood = mottled_material("Table", ((0.28, 0.15, 0.07), (0.42, 0.25, 0.13)), 6.0, roughness=0.5)
    wall = material("Wall", (0.30, 0.32, 0.30), roughness=0.9)
    add_box("Table", (3.0, 1.6, 0.06), wood, Pose((0, 0.2, -0.03)), bevel=0.01)
    add_plane("Wall", (12, 6), wall, Pose((0, 1.6, 1.5), (1.5708, 0, 0)))

    clay = material("Clay", (0.55, 0.24, 0.13), roughness=0.8)
    glaze = material("Glaze", (0.72, 0.70, 0.62), roughness=0.2)
    apple = material("Apple", (0.55, 0.06, 0.04), roughness=0.35)
    lime = material("Lime", (0.28, 0.45, 0.05), roughness=0.4)
    add_cylinder("Jug", 0.19, 0.5, clay, Pose((-0.35, 0.35, 0.25)), taper=0.7)
    add_torus("Handle", (0.12, 0.025), clay, Pose((-0.54, 0.35, 0.29), (1.5708, 0, 0)), segments=(40, 10))
    add_cylinder("Bowl", 0.16, 0.16, glaze, Pose((0.32, 0.2, 0.08)), taper=1.6)
    add_sphere("Apple", 0.11, apple, Pose((0.02, -0.12, 0.11)))
    add_sphere("Second apple", 0.1, apple, Pose((0.34, 0.18, 0.2)))
    add_sphere("Lime", 0.07, lime, Pose((0.24, -0.25, 0.07)))
    add_box(
        "Book",
        (0.42, 0.3, 0.06),
        material("Book", (0.06, 0.13, 0.25), roughness=0.6),
        Pose((-0.42, -0.15, 0.03), (0, 0, 0.3)),
    )

    add_area_light("Key", 0.6, 42, (-1.5, -1.2, 1.7), (0, 0.1, 0.1), (1.0, 0.9, 0.76))
    add_area_light("Fill", 1.2, 12, (1.9, -1.3, 1.0), (0, 0.1, 0.2), (0.7, 0.82, 1.0))
    add_point_light("Rim", 0.08, 20, (0.9, 1.2, 1.2), (1.0, 0.75, 0.5))
    add_camera((0.05, -2.1, 0.75), (0.0, 0.15, 0.17), 55)
    return scene
