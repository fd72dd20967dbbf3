# SPDX-License-Identifier: GPL-3.0-or-later
"""Metal of all roughnesses on a polished floor, lit by a painted environment alone: glossy and nothing moves."""

import math

from demo_blend.primitives import (
    Pose,
    add_box,
    add_camera,
    add_cylinder,
    add_plane,
    add_sphere,
    add_torus,
    empty_scene,
    material,
    set_world,
)


def build():
    """Build the scene and return it."""
    scene = empty_scene()
    _studio()
    floor = material("Floor", (0.10, 0.10, 0.11), roughness=0.28)
    add_plane("Floor", (40, 40), floor)

    chrome = material("Chrome", (0.90, 0.90, 0.92), roughness=0.12, metallic=1.0)
    gold = material("Gold", (0.95, 0.65, 0.22), roughness=0.25, metallic=1.0)
    copper = material("Copper", (0.90, 0.42, 0.25), roughness=0.4, metallic=1.0)
    steel = material("Brushed steel", (0.55, 0.56, 0.58), roughness=0.35, metallic=1.0, anisotropic=0.7)
    enamel = material("Enamel", (0.45, 0.02, 0.03), roughness=0.35, coat_weight=1.0, coat_roughness=0.05)

    add_sphere("Chrome ball", 0.75, chrome, Pose((-0.2, 0.6, 0.75)))
    add_torus("Gold ring", (0.5, 0.16), gold, Pose((-1.75, 0.0, 0.62), (math.radians(72), 0, math.radians(28))))
    add_cylinder("Copper cup", 0.42, 0.9, copper, Pose((1.35, 0.25, 0.45)), taper=1.25)
    add_box("Steel block", (0.7, 0.7, 0.7), steel, Pose((0.55, -0.95, 0.35), (0, 0, 0.6)), bevel=0.05)
    add_sphere("Enamel ball", 0.32, enamel, Pose((-0.75, -0.85, 0.32)))
    add_cylinder("Steel cone", 0.35, 0.8, steel, Pose((2.25, -0.6, 0.4)), taper=0.1)
    add_camera((0.6, -6.2, 2.3), (0.1, -0.1, 0.55), 50)
    return scene


def _studio() -> None:
    """Paint the world: a dim gradient, and bright bands that stand for the softboxes of a studio."""
    world = set_world((0, 0, 0), 1.0)
    nodes, links = world.node_tree.nodes, world.node_tree.links
    coordinates = nodes.new("ShaderNodeTexCoord")
    wave = nodes.new("ShaderNodeTexWave")
    wave.inputs["Scale"].default_value = 0.45
    wave.inputs["Distortion"].default_value = 1.5
    wave.inputs["Detail"].default_value = 1.0
    ramp = nodes.new("ShaderNodeValToRGB")
    elements = ramp.color_ramp.elements
    elements[0].position, elements[0].color = 0.55, (0.10, 0.13, 0.19, 1)
    elements[1].position, elements[1].color = 0.85, (3.0, 2.7, 2.2, 1)
    links.new(coordinates.outputs["Generated"], wave.inputs["Vector"])
    links.new(wave.outputs["Fac"], ramp.inputs["Fac"])
    links.new(ramp.outputs["Color"], nodes["Background"].inputs["Color"])
