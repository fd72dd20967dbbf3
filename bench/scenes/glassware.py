# SPDX-License-Identifier: GPL-3.0-or-later
"""A set table at a window: wine glasses, bottles and a carafe on marble, before tiles, in an open lens."""

import math

import bpy

from bench.scenes.ingredients import glass, kneaded, roughened, subdivided
from demo_blend.primitives import (
    Pose,
    add_area_light,
    add_box,
    add_camera,
    add_plane,
    add_point_light,
    add_sphere,
    empty_scene,
    material,
    mesh_of_revolution,
    mottled_material,
    place,
    set_world,
)

#: Outlines of (radius, height) in metres, the outer wall up and the inner one down again.
GOBLET = (
    (0, 0), (0.036, 0), (0.034, 0.004), (0.006, 0.010), (0.0045, 0.05), (0.006, 0.088), (0.030, 0.108), (0.041, 0.145),
    (0.038, 0.185), (0.031, 0.215), (0.0295, 0.215), (0.0365, 0.185), (0.0395, 0.145), (0.0285, 0.110), (0, 0.094),
)  # fmt: skip
WINE = ((0, 0.0945), (0.0284, 0.1105), (0.0394, 0.1450), (0.0390, 0.1520), (0, 0.1520))
BOTTLE = (
    (0, 0.012), (0.030, 0), (0.038, 0.006), (0.038, 0.19), (0.034, 0.215), (0.015, 0.245), (0.014, 0.30),
    (0.016, 0.302), (0.016, 0.318), (0.011, 0.318), (0.011, 0.245), (0.031, 0.213), (0.035, 0.19),
    (0.035, 0.012), (0, 0.02),
)  # fmt: skip
TUMBLER = ((0, 0), (0.032, 0), (0.034, 0.004), (0.039, 0.095), (0.0365, 0.095), (0.0318, 0.012), (0, 0.011))
WATER = ((0, 0.0112), (0.0317, 0.0122), (0.0350, 0.0650), (0, 0.0650))


def build():
    """Build the scene and return it."""
    scene = empty_scene()
    scene.view_settings.exposure = 0.7
    scene.cycles.transmission_bounces = 16
    scene.cycles.max_bounces = 20
    set_world((0.30, 0.36, 0.45), 0.25)
    _room()
    _glasses()
    _fruit()
    add_area_light("Window", 0.7, 20, (-0.95, -0.25, 0.75), (0, 0.1, 0.1), (0.78, 0.88, 1.0))
    for i in range(3):
        add_point_light(f"Spot {i}", 0.02, 1.6, (-0.5 + 0.5 * i, 0.25, 0.85), (1.0, 0.78, 0.5))
    add_camera((0.14, -0.80, 0.30), (0.0, 0.06, 0.115), 42, fstop=2.0)
    return scene


def _room() -> None:
    """Add a marble table top, a wall of glazed tiles and a board."""
    marble = mottled_material("Marble", ((0.75, 0.73, 0.70), (0.30, 0.29, 0.30)), 5.0, roughness=0.12)
    nodes = marble.node_tree.nodes
    noise = next(node for node in nodes if node.type == "TEX_NOISE")
    noise.inputs["Distortion"].default_value = 2.5
    add_box("Table", (2.4, 1.3, 0.04), marble, Pose((0, 0.1, -0.02)), bevel=0.006)
    add_plane("Wall", (3, 1.6), _tiles(), Pose((0, 0.62, 0.6), (math.radians(90), 0, 0)))
    wood = mottled_material("Wood", ((0.32, 0.17, 0.08), (0.19, 0.09, 0.04)), 9.0, roughness=0.45)
    board = add_box("Board", (0.36, 0.22, 0.018), roughened(wood, 40.0, 0.001), Pose((0.24, -0.02, 0.009)), bevel=0.004)
    board.rotation_euler.z = 0.3


def _tiles() -> bpy.types.Material:
    """Return glazed tiles with sunken joints."""
    made = material("Tiles", (0.1, 0.3, 0.3), roughness=0.14)
    nodes, links = made.node_tree.nodes, made.node_tree.links
    bricks, bump = nodes.new("ShaderNodeTexBrick"), nodes.new("ShaderNodeBump")
    settings = {
        "Scale": 1.0, "Brick Width": 0.15, "Row Height": 0.075, "Mortar Size": 0.003, "Mortar Smooth": 0.3,
        "Color1": (0.05, 0.20, 0.20, 1), "Color2": (0.09, 0.32, 0.29, 1), "Mortar": (0.55, 0.53, 0.48, 1),
    }  # fmt: skip
    for name, value in settings.items():
        bricks.inputs[name].default_value = value
    bump.inputs["Distance"].default_value = 0.004
    bump.invert = True
    links.new(nodes.new("ShaderNodeTexCoord").outputs["Object"], bricks.inputs["Vector"])
    links.new(bricks.outputs["Color"], nodes["Principled BSDF"].inputs["Base Color"])
    links.new(bricks.outputs[1], bump.inputs["Height"])
    links.new(bump.outputs["Normal"], nodes["Principled BSDF"].inputs["Normal"])
    return made


def _glasses() -> None:
    """Add goblets of wine, tumblers of water and bottles."""
    clear = glass("Glass", ior=1.5)
    green = glass("Green glass", (0.35, 0.62, 0.32), ior=1.5)
    wine = glass("Wine", (0.42, 0.02, 0.05), ior=1.34)
    water = glass("Water", (0.95, 0.98, 1.0), ior=1.33)
    vessels = (
        ("Goblet", GOBLET, clear, WINE, wine, ((-0.16, 0.02), (-0.03, 0.10), (0.10, -0.08))),
        ("Tumbler", TUMBLER, clear, WATER, water, ((-0.24, -0.12), (0.0, -0.18), (0.38, 0.15))),
        ("Bottle", BOTTLE, green, None, None, ((-0.28, 0.20), (0.13, 0.24))),
    )
    for name, outline, stuff, inside, drink, places in vessels:
        shapes = [mesh_of_revolution(name, outline, stuff)]
        if inside:
            shapes.append(mesh_of_revolution(f"{name} filling", inside, drink))
        for i, (x, y) in enumerate(places):
            for mesh in shapes:
                subdivided(place(f"{mesh.name} {i}", mesh, Pose((x, y, 0.0005))), 2)


def _fruit() -> None:
    """Add oranges and a pear on the board."""
    peel = roughened(
        material("Peel", (0.85, 0.30, 0.03), roughness=0.4, subsurface_weight=0.4, subsurface_scale=0.01), 160.0, 0.002
    )
    pear = mottled_material("Pear", ((0.45, 0.42, 0.06), (0.55, 0.25, 0.06)), 18.0, roughness=0.4)
    for i, (x, y) in enumerate(((0.20, 0.01), (0.28, -0.04), (0.265, 0.055))):
        subdivided(kneaded(add_sphere(f"Orange {i}", 0.038, peel, Pose((x, y, 0.055))), 0.05, 0.003), 1)
    outline = ((0, 0), (0.02, 0.001), (0.036, 0.03), (0.03, 0.06), (0.016, 0.085), (0.008, 0.1), (0, 0.102))
    fruit = place("Pear", mesh_of_revolution("Pear", outline, pear), Pose((0.155, -0.055, 0.018), (0.1, 0.15, 0)))
    subdivided(fruit, 2)
