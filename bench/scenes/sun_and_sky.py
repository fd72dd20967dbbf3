# SPDX-License-Identifier: GPL-3.0-or-later
"""A village seen from a moving car: a low sun, a physical sky, camera motion and nothing else that moves."""

import math
import random

from demo_blend.primitives import (
    Pose,
    add_box,
    add_camera,
    add_cylinder,
    add_plane,
    add_sphere,
    add_sun,
    animate,
    copy_of,
    empty_scene,
    material,
    mottled_material,
    set_world,
)


def build():
    """Build the scene and return it."""
    scene = empty_scene()
    scene.render.use_motion_blur = True
    scene.view_settings.exposure = -3.6
    _sky()
    # A lamp for the sun itself, as artists do to be free in its strength.
    add_sun("Sun", math.radians(0.9), 55, (-6, -5, 4.2), (1.0, 0.88, 0.7))

    grass = mottled_material("Grass", ((0.09, 0.16, 0.03), (0.19, 0.20, 0.07)), 0.8, roughness=0.95)
    road = material("Road", (0.12, 0.12, 0.12), roughness=0.7)
    add_plane("Grass", (300, 300), grass)
    add_box("Road", (300, 3.0, 0.04), road, Pose((0, -3, 0.0)))
    _houses()
    _trees()

    camera = add_camera((0, -9.5, 1.7), (1.5, 2, 1.9), 30)
    animate(camera, "location", {1: (-5.5, -9.5, 1.7), 24: (6.0, -9.5, 1.7)})
    scene.frame_set(scene.frame_current)
    return scene


def _sky() -> None:
    """Light the world by Blender's sky texture with its own sun disc off."""
    world = set_world((0, 0, 0), 1.0)
    nodes = world.node_tree.nodes
    sky = nodes.new("ShaderNodeTexSky")
    sky.sun_disc = False
    sky.sun_elevation = math.radians(28)
    sky.sun_rotation = math.radians(-130)
    world.node_tree.links.new(sky.outputs["Color"], nodes["Background"].inputs["Color"])


def _houses() -> None:
    """Add a row of gabled houses."""
    walls = [
        material(f"House {i}", color, roughness=0.85)
        for i, color in enumerate(((0.70, 0.62, 0.50), (0.62, 0.30, 0.20), (0.55, 0.58, 0.60)))
    ]
    tiles = material("Roof", (0.28, 0.09, 0.06), roughness=0.7)
    glass = material("Window", (0.03, 0.04, 0.05), roughness=0.05)
    chance = random.Random(3)
    for i, x in enumerate((-11, -6.2, -1.5, 3.4, 8.2, 13.5)):
        width, height, y = chance.uniform(2.6, 3.6), chance.uniform(2.0, 3.2), chance.uniform(2.5, 6.0)
        add_box(f"House {i}", (width, 3, height), walls[i % 3], Pose((x, y, height / 2)))
        for side in (-1, 1):
            pose = Pose((x, y + side * 0.85, height + 0.55), (side * math.radians(-35), 0, 0))
            add_box(f"Roof {i} {side}", (width + 0.5, 2.3, 0.12), tiles, pose)
        for column in (-0.28, 0.28):
            add_box(f"Window {i} {column}", (0.6, 0.06, 0.8), glass, Pose((x + column * width, y - 1.5, height * 0.55)))


def _trees() -> None:
    """Add instanced trees, round and pointed, before and behind the houses."""
    bark = material("Bark", (0.10, 0.06, 0.04), roughness=0.9)
    leaves = mottled_material("Leaves", ((0.03, 0.10, 0.02), (0.10, 0.18, 0.04)), 5.0, roughness=0.9)
    trunk = add_cylinder("Trunk", 0.12, 1.2, bark, Pose((-3.6, 1.0, 0.6)))
    shapes = (
        add_sphere("Crown", 0.8, leaves, Pose((-3.6, 1.0, 1.8))),
        add_cylinder("Fir", 0.9, 2.6, leaves, Pose((5.8, 1.2, 1.9)), taper=0.0),
    )
    chance = random.Random(8)
    for i in range(60):
        x = chance.uniform(-28, 28)
        y = chance.choice((chance.uniform(-0.8, 0.8), chance.uniform(8, 40)))
        height = chance.uniform(0.8, 1.5)
        kind = chance.randrange(2)
        copy_of(trunk, f"Trunk {i}", Pose((x, y, 0.5 * height)))
        crown = copy_of(
            shapes[kind], f"Crown {i}", Pose((x, y, (1.8, 2.2)[kind] * height), (0, 0, chance.random() * 6))
        )
        crown.scale = (height,) * 3
