# SPDX-License-Identifier: GPL-3.0-or-later
"""Furry balls bounce across a table: thousands of moving hairs, two lights."""

import math

import bpy
import numpy as np

from demo_blend.primitives import (
    Pose,
    add_area_light,
    add_camera,
    add_plane,
    add_point_light,
    add_sphere,
    animate,
    empty_scene,
    material,
    place,
)

HAIRS = 5000
POINTS = 5


def build():
    """Build the scene and return it."""
    scene = empty_scene()
    scene.render.use_motion_blur = True
    cloth = material("Backdrop", (0.30, 0.33, 0.36), roughness=0.9)
    add_plane("Table", (30, 30), cloth)
    add_plane("Backdrop", (30, 15), cloth, Pose((0, 4, 7.5), (math.radians(90), 0, 0)))

    # Name, colour of the fur, radius, place at the still's frame, way and turn a frame.
    _ball("Ginger", (0.60, 0.25, 0.07), 0.55, (-1.35, 0.2, 0.95), (0.10, 0.0, -0.16), 0.25)
    _ball("White", (0.75, 0.72, 0.68), 0.70, (0.25, 0.9, 1.75), (-0.07, 0.0, 0.12), -0.3)
    _ball("Grey", (0.16, 0.15, 0.17), 0.42, (1.4, -0.3, 0.62), (0.16, 0.0, 0.0), 0.38)

    add_area_light("Key", 1.4, 420, (-3.0, -3.0, 4.5), (0, 0.3, 0.8), (1.0, 0.94, 0.86))
    add_point_light("Rim", 0.3, 260, (3.4, 2.2, 3.0), (0.7, 0.82, 1.0))
    add_camera((0, -6.4, 1.7), (0.0, 0.3, 1.05), 48)
    return scene


def _ball(name, color, radius, middle, way, turn) -> None:
    """Add a moving ball with hair all over it."""
    hide = material(f"{name} hide", [0.4 * part for part in color], roughness=0.9)
    strand = material(f"{name} hair", color, roughness=0.5)
    ball = add_sphere(name, radius, hide)
    place(f"{name} fur", _fur(name, radius, strand), Pose(parent=ball))
    keys = (1, 24)
    animate(ball, "location", {f: tuple(m + w * (f - 12) for m, w in zip(middle, way, strict=True)) for f in keys})
    animate(ball, "rotation_euler", {f: (0.0, turn * (f - 12), 0.3) for f in keys})


def _fur(name, radius, strand) -> bpy.types.Curves:
    """Return curves that stand on a sphere, bent over by gravity and some chance."""
    random = np.random.default_rng(len(name))
    out = random.normal(size=(HAIRS, 1, 3))
    out /= np.linalg.norm(out, axis=-1, keepdims=True)
    along = np.linspace(0.0, 1.0, POINTS).reshape(1, POINTS, 1)
    length = 0.45 * radius * random.uniform(0.7, 1.2, (HAIRS, 1, 1))
    bend = random.normal(scale=0.35, size=(HAIRS, 1, 3)) - np.array((0.0, 0.0, 0.45))
    points = out * radius + length * (along * out + along**2 * bend)

    curves = bpy.data.hair_curves.new(f"{name} fur")
    curves.add_curves([POINTS] * HAIRS)
    curves.position_data.foreach_set("vector", points.astype(np.float32).ravel())
    widths = curves.attributes.new("radius", "FLOAT", "POINT")
    taper = np.broadcast_to(0.011 * radius * (1.0 - 0.85 * along), (HAIRS, POINTS, 1))
    widths.data.foreach_set("value", taper.astype(np.float32).ravel())
    curves.materials.append(strand)
    return curves
