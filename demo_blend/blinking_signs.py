# SPDX-License-Identifier: GPL-3.0-or-later
"""Neon signs of a bar go on and off, and a row of bulbs grows, while the shutter is open.

Cycles by itself takes one moment's signs and bulbs: it blurs neither visibility nor a mesh whose topology changes.
"""

import math

import bpy

from demo_blend.primitives import (
    Pose,
    add_box,
    add_camera,
    add_cylinder,
    add_plane,
    add_torus,
    emission,
    empty_scene,
    material,
    mottled_material,
    place,
    set_world,
    spin,
)

#: Frames that a sign is off, of a round of this length.
_ROUND, _DARK = 0.8, 0.3


def build():
    """Build the scene and return it."""
    scene = empty_scene()
    scene.render.use_motion_blur = True
    scene.cycles.caustics_reflective = scene.cycles.caustics_refractive = False
    set_world((0.03, 0.036, 0.06))
    bricks = mottled_material("Wall", ((0.20, 0.09, 0.06), (0.07, 0.035, 0.03)), 6.0, roughness=0.9)
    asphalt = mottled_material("Street", ((0.05, 0.05, 0.055), (0.02, 0.02, 0.025)), 9.0, roughness=0.22)
    iron = material("Iron", (0.04, 0.04, 0.045), metallic=1.0, roughness=0.4)
    add_plane("Wall", (24, 10), bricks, Pose((0, 0, 5), (math.radians(90), 0, 0)))
    add_plane("Street", (24, 16), asphalt, Pose((0, -8, 0)))
    add_box("Door", (1.5, 0.2, 2.5), material("Door", (0.10, 0.03, 0.02), roughness=0.4), Pose((2.2, -0.05, 1.25)))
    add_box("Awning", (4.4, 1.1, 0.12), iron, Pose((1.6, -0.5, 2.75)), bevel=0.03)

    _sign(scene, "JAZZ", (1.0, 0.10, 0.25), (-3.4, -0.22, 2.9), 1.5, 0.0)
    _sign(scene, "BAR", (0.10, 0.55, 1.0), (0.2, -0.22, 3.25), 1.3, 0.4)
    _bulbs(scene)
    _ring(iron)
    add_camera((-0.3, -9.8, 1.7), (-0.3, 0.0, 1.95), 33)
    scene.frame_set(12)
    return scene


def _sign(scene, text, color, location, size, late) -> None:
    """Add a word of neon, which is off for a while in each round; it begins that many frames late."""
    curve = bpy.data.curves.new(text, "FONT")
    curve.body, curve.size = text, size
    curve.fill_mode, curve.bevel_depth, curve.bevel_resolution, curve.resolution_u = "NONE", 0.03, 0, 4
    curve.materials.append(emission(text, color, 14.0))
    sign = place(text, curve, Pose(location, (math.radians(90), 0, 0)))
    for turn in range(math.ceil((scene.frame_end + 2) / _ROUND)):
        start = turn * _ROUND + late
        for frame, is_hidden in ((start, True), (start + _DARK, False)):
            sign.hide_render = is_hidden
            sign.keyframe_insert("hide_render", frame=frame)


def _bulbs(scene) -> None:
    """Add a row of bulbs along the awning, of which more and more are there: a mesh that changes its topology."""
    bulb = add_cylinder("Bulbs", 0.06, 0.13, emission("Bulbs", (1.0, 0.70, 0.30), 20.0), Pose((-0.45, -1.1, 2.72)))
    row = bulb.modifiers.new("Row", "ARRAY")
    row.use_relative_offset, row.use_constant_offset = False, True
    row.constant_offset_displace = (0.32, 0.0, 0.0)
    most = 13
    # One more with each thirteenth of a frame.
    for step in range((scene.frame_end + 2) * most):
        row.count = 1 + step % most
        row.keyframe_insert("count", frame=step / most)


def _ring(iron) -> None:
    """Add a wheel above the street that turns, which Cycles blurs by itself."""
    hub = place("Hub", None, Pose((-5.2, -0.6, 3.2), (math.radians(90), 0, 0)))
    add_torus("Rim", (0.75, 0.05), iron, Pose(parent=hub))
    for spoke in range(5):
        turn = 2 * math.pi * spoke / 5
        place_at = Pose((0.6 * math.cos(turn), 0.6 * math.sin(turn), 0.0), parent=hub)
        add_cylinder(f"Lamp {spoke}", 0.09, 0.1, bpy.data.materials["Bulbs"], place_at)
    spin(hub, math.radians(40), axis=1)
