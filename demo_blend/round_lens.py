# SPDX-License-Identifier: GPL-3.0-or-later
"""Figures 11 and 12 of the paper with the round lens it wished for: pawns on a board, one of them in focus."""

import math

from demo_blend.primitives import (
    Pose,
    add_camera,
    add_plane,
    add_point_light,
    add_sphere,
    checkered_material,
    copy_of,
    emission,
    empty_scene,
    light_as_in_1991,
    material,
    mesh_of_revolution,
    place,
    set_world,
)

#: Half the outline of a pawn: (radius, height), from the foot up.
PAWN = (
    (0.0, 0.0), (0.30, 0.0), (0.32, 0.05), (0.30, 0.10), (0.24, 0.13), (0.23, 0.18), (0.17, 0.26), (0.12, 0.40),
    (0.10, 0.52), (0.11, 0.57), (0.18, 0.60), (0.19, 0.63), (0.13, 0.66), (0.12, 0.68), (0.17, 0.73), (0.19, 0.80),
    (0.18, 0.87), (0.13, 0.94), (0.07, 0.975), (0.0, 0.985),
)  # fmt: skip

#: Paint and square of each pawn.
MEN = ((0, -0.5, -0.5), (1, 1.5, 0.5), (2, 0.5, 1.5), (0, -0.5, 2.5), (1, 1.5, 3.5), (0, 2.5, 5.5), (1, -1.5, 4.5),
       (2, -3.5, 6.5), (0, 0.5, 7.5), (1, 4.5, 9.5), (0, -4.5, 11.5), (2, 2.5, 12.5))  # fmt: skip

BULBS = ((1.0, 0.62, 0.25), (1.0, 0.35, 0.2), (0.4, 0.65, 1.0))


def build(blades: int = 0):
    """Build the scene and return it; `blades` are the corners of the lens, 0 for a round one."""
    scene = empty_scene()
    set_world((0.008, 0.010, 0.018))
    board = checkered_material("Board", ((0.62, 0.50, 0.34), (0.09, 0.045, 0.025)), 1.0, roughness=0.5)
    add_plane("Board", (24, 40), board, Pose((0, 14, -0.001)))

    paints = [
        material("Ivory", (0.78, 0.70, 0.55), roughness=0.25),
        material("Ebony", (0.035, 0.03, 0.03), roughness=0.22),
        material("Red", (0.52, 0.05, 0.035), roughness=0.25),
    ]
    pawns = [mesh_of_revolution(f"{paint.name} pawn", PAWN, paint) for paint in paints]
    for kind, x, y in MEN:
        place(f"Pawn {x} {y}", pawns[kind], Pose((x, y, 0)))

    bulbs = []
    for i in range(17):
        pose = Pose((0.8 * i - 6.6, 22.0, 1.75 - 1.1 * math.sin(math.pi * (i % 8) / 8)))
        if i < len(BULBS):
            bulbs.append(add_sphere(f"Bulb {i}", 0.14, emission(f"Bulb {i}", BULBS[i], 6.0), pose))
        else:
            copy_of(bulbs[i % len(BULBS)], f"Bulb {i}", pose)

    add_point_light("Key", 0.0, 1100, (-3.5, -2.5, 5.0), (1.0, 0.93, 0.82))
    camera = add_camera((0.9, -3.6, 1.45), (0.5, 1.5, 0.55), 50, fstop=0.35)
    camera.data.dof.aperture_blades = blades
    camera.data.dof.aperture_rotation = math.radians(45)
    light_as_in_1991(ambient=0.10)
    return scene
