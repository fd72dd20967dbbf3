# SPDX-License-Identifier: GPL-3.0-or-later
"""Wax candles and a marble head in a dark chapel: light below the surface, and eleven small flames."""

import math
import random

import bpy

from bench.scenes.ingredients import displaced, kneaded, roughened, subdivided, waxen
from demo_blend.primitives import (
    Pose,
    add_area_light,
    add_box,
    add_camera,
    add_plane,
    add_point_light,
    add_sphere,
    emission,
    empty_scene,
    material,
    mesh_of_revolution,
    mottled_material,
    place,
)

CANDLES = 11


def build():
    """Build the scene and return it."""
    scene = empty_scene()
    scene.view_settings.exposure = 1.0
    stone = displaced(
        mottled_material("Stone", ((0.20, 0.18, 0.15), (0.30, 0.27, 0.23)), 3.0, roughness=0.85), 2.5, 0.12
    )
    wall = subdivided(add_plane("Wall", (7, 5), stone, Pose((0, 1.6, 1.5), (math.radians(90), 0, 0))), 7, smooth=False)
    wall.rotation_euler.z = 0.05
    slab = roughened(
        mottled_material("Slab", ((0.16, 0.14, 0.12), (0.26, 0.23, 0.20)), 5.0, roughness=0.35), 14.0, 0.01
    )
    add_box("Altar", (5, 2.2, 0.3), slab, Pose((0, 0.3, -0.15)), bevel=0.03)
    _head()
    _candles()
    _bowl()
    add_area_light("Window", 1.2, 26, (-3.2, -1.5, 3.2), (0, 0, 0.5), (0.45, 0.6, 1.0))
    add_camera((0.25, -3.6, 0.95), (0.0, 0.1, 0.52), 46, fstop=2.0)
    return scene


def _head() -> None:
    """Add a head of translucent marble, put together of kneaded balls as a sculptor's first sketch."""
    marble = waxen("Marble", ((0.78, 0.74, 0.68), (0.66, 0.60, 0.54)), 0.03, roughness=0.25)
    parts = (
        ("Skull", 0.30, (0.0, 0.42, 0.82), (0.86, 1.05, 1.1)),
        ("Jaw", 0.20, (0.0, 0.28, 0.64), (0.9, 0.95, 1.1)),
        ("Nose", 0.055, (0.0, 0.10, 0.74), (0.7, 1.0, 1.6)),
        ("Brow", 0.12, (0.0, 0.19, 0.85), (1.7, 0.7, 0.4)),
        ("Mouth", 0.05, (0.0, 0.105, 0.61), (1.5, 0.6, 0.5)),
        ("Neck", 0.17, (0.0, 0.45, 0.42), (0.9, 0.9, 1.6)),
        ("Shoulders", 0.40, (0.0, 0.50, 0.08), (1.35, 0.7, 0.65)),
    )
    balls = bpy.data.metaballs.new("Head")
    balls.resolution = balls.render_resolution = 0.022
    balls.threshold = 0.05
    for _, radius, middle, stretch in parts:
        ball = balls.elements.new(type="ELLIPSOID")
        ball.co, ball.radius = middle, 1.35 * radius
        ball.size_x, ball.size_y, ball.size_z = stretch
    balls.materials.append(marble)
    place("Head", balls)


def _candles() -> None:
    """Add candles of different heights, kneaded as if the wax had run, each with a flame and the flame's light."""
    wax = waxen("Wax", ((0.85, 0.72, 0.50), (0.80, 0.62, 0.40)), 0.05)
    flame = emission("Flame", (1.0, 0.55, 0.2), 60.0)
    chance = random.Random(4)
    for i in range(CANDLES):
        side = -1 if i % 2 else 1
        x, y = side * (0.42 + 0.13 * i), chance.uniform(-0.55, 0.7)
        radius, height = chance.uniform(0.055, 0.1), chance.uniform(0.16, 0.6)
        dent = 0.75 * radius
        outline = [(0, 0), (1.25 * radius, 0), (1.05 * radius, 0.02), (radius, 0.06), (radius, 0.5 * height)]
        outline += [(radius, height), (dent, height + 0.01), (0.6 * dent, height - 0.02), (0, height - 0.03)]
        body = place(f"Candle {i}", mesh_of_revolution(f"Candle {i}", outline, wax), Pose((x, y, 0)))
        kneaded(subdivided(body, 2), 0.09, 0.02)
        tip = add_sphere(f"Flame {i}", 0.014, flame, Pose((x, y, height + 0.035)))
        tip.scale.z = 2.6
        add_point_light(f"Light {i}", 0.012, chance.uniform(1.4, 2.4), (x, y, height + 0.085), (1.0, 0.58, 0.25))


def _bowl() -> None:
    """Add a bowl of hammered brass."""
    brass = roughened(
        material("Brass", (0.75, 0.52, 0.22), roughness=0.22, metallic=1.0), 14.0, 0.01, "ShaderNodeTexVoronoi"
    )
    outline = [(0, 0), (0.1, 0), (0.11, 0.02), (0.22, 0.1), (0.27, 0.2), (0.255, 0.2), (0.2, 0.11), (0, 0.04)]
    bowl = place("Bowl", mesh_of_revolution("Bowl", outline, brass), Pose((0.12, -0.62, 0.0)))
    subdivided(bowl, 2)
