# SPDX-License-Identifier: GPL-3.0-or-later
"""The living room full of haze: a sample costs about three times what one of the wheels does, for wall times."""

import bpy

from bench.scenes.room import build as build_room
from demo_blend.primitives import Pose, add_box

DENSITY = 0.06


def build():
    """Build the scene and return it."""
    scene = build_room()
    haze = bpy.data.materials.new("Haze")
    nodes, links = haze.node_tree.nodes, haze.node_tree.links
    nodes.remove(nodes["Principled BSDF"])
    scatter = nodes.new("ShaderNodeVolumeScatter")
    scatter.inputs["Density"].default_value = DENSITY
    links.new(scatter.outputs["Volume"], nodes["Material Output"].inputs["Volume"])
    add_box("Haze", (5.98, 6.98, 2.68), haze, Pose((0, -1, 1.35)))
    return scene
