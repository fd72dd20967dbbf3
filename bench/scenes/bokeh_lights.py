# SPDX-License-Identifier: GPL-3.0-or-later
"""A bottle and glasses on a bar, the lights of a town far out of focus: a wide open six-bladed lens, many emitters."""

import math
import random

from demo_blend.primitives import (
    Pose,
    add_area_light,
    add_box,
    add_camera,
    add_cylinder,
    add_plane,
    add_sphere,
    copy_of,
    emission,
    empty_scene,
    material,
    set_world,
)

BULBS = (((1.0, 0.55, 0.2), 9.0), ((1.0, 0.8, 0.5), 7.0), ((0.3, 0.6, 1.0), 8.0), ((1.0, 0.15, 0.12), 9.0))


def build():
    """Build the scene and return it."""
    scene = empty_scene()
    set_world((0.010, 0.014, 0.028))
    _bar()
    _town()
    add_area_light("Bar light", 0.5, 40, (-0.9, -0.5, 1.3), (0, 0.1, 0.1), (1.0, 0.8, 0.6))
    camera = add_camera((0.05, -1.35, 0.36), (0.0, 0.12, 0.20), 60, fstop=1.2)
    camera.data.dof.aperture_blades = 6
    camera.data.dof.aperture_rotation = math.radians(12)
    return scene


def _bar() -> None:
    """Add the things in focus and those just before and behind them."""
    top = material("Bar top", (0.12, 0.05, 0.025), roughness=0.25)
    ceramic = material("Ceramic", (0.65, 0.62, 0.55), roughness=0.3)
    blue = material("Blue glaze", (0.05, 0.15, 0.35), roughness=0.15)
    brass = material("Brass", (0.8, 0.6, 0.25), roughness=0.25, metallic=1.0)
    add_box("Bar top", (3.0, 1.1, 0.06), top, Pose((0, 0.15, -0.03)))
    add_cylinder("Bottle", 0.055, 0.26, blue, Pose((0.03, 0.12, 0.13)), taper=0.95)
    add_cylinder("Neck", 0.05, 0.1, blue, Pose((0.03, 0.12, 0.31)), taper=0.35)
    add_cylinder("Cup", 0.045, 0.09, ceramic, Pose((-0.17, -0.1, 0.045)), taper=1.2)
    add_cylinder("Shaker", 0.05, 0.18, brass, Pose((0.26, 0.4, 0.09)), taper=0.8)
    add_sphere("Orange", 0.045, material("Orange", (0.8, 0.28, 0.03), roughness=0.5), Pose((0.17, -0.16, 0.045)))


def _town() -> None:
    """Add the far lights: small emissive spheres of four colours over a dark street."""
    chance = random.Random(11)
    add_plane("Street", (60, 60), material("Street", (0.05, 0.05, 0.06), roughness=0.4), Pose((0, 25, -1.2)))
    first = {}
    for i in range(44):
        kind = chance.randrange(len(BULBS))
        away = chance.uniform(5, 16)
        pose = Pose((chance.uniform(-0.42, 0.42) * away, away, chance.uniform(-0.1, 0.28) * away))
        if kind in first:
            bulb = copy_of(first[kind], f"Bulb {i}", pose)
        else:
            color, strength = BULBS[kind]
            bulb = first[kind] = add_sphere(f"Bulb {i}", 0.05, emission(f"Bulb {kind}", color, strength), pose)
        bulb.scale = (chance.uniform(0.6, 1.4),) * 3
