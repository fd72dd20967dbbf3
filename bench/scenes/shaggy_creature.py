# SPDX-License-Identifier: GPL-3.0-or-later
"""A shaggy creature looks round on a studio's floor: thirty thousand hairs on a kneaded body, glossy eyes."""

import math

import bpy
import numpy as np

from bench.scenes.ingredients import kneaded, roughened, subdivided
from demo_blend.primitives import (
    Pose,
    add_area_light,
    add_camera,
    add_plane,
    add_sphere,
    animate,
    empty_scene,
    material,
    mottled_material,
    place,
    set_world,
)

#: Hairs of all parts together, and points of each.
HAIRS, POINTS = 30_000, 7

#: Name, middle, radii and share of the hairs of the body's parts, in the frame of the creature.
PARTS = (
    ("Body", (0, 0, 0.62), (0.62, 0.58, 0.62), 0.46),
    ("Head", (0, -0.22, 1.32), (0.46, 0.44, 0.42), 0.30),
    ("Left arm", (-0.66, -0.12, 0.66), (0.17, 0.18, 0.36), 0.07),
    ("Right arm", (0.66, -0.12, 0.66), (0.17, 0.18, 0.36), 0.07),
    ("Left foot", (-0.30, -0.34, 0.13), (0.22, 0.32, 0.14), 0.05),
    ("Right foot", (0.30, -0.34, 0.13), (0.22, 0.32, 0.14), 0.05),
)


def build():
    """Build the scene and return it."""
    scene = empty_scene()
    scene.render.use_motion_blur = True
    set_world((0.30, 0.34, 0.40), 0.3)
    paper = roughened(
        mottled_material("Paper", ((0.42, 0.30, 0.22), (0.48, 0.36, 0.27)), 1.5, roughness=0.9), 30.0, 0.004
    )
    add_plane("Floor", (14, 14), paper)
    add_plane("Wall", (14, 8), paper, Pose((0, 3.5, 4), (math.radians(80), 0, 0)))
    creature = place("Creature", None)
    animate(creature, "rotation_euler", {1: (0, 0.03, -0.30), 24: (0, -0.03, 0.35)})
    _body(creature)
    _face(creature)
    add_area_light("Key", 1.2, 190, (-2.6, -2.6, 3.2), (0, 0, 0.9), (1.0, 0.93, 0.84))
    add_area_light("Rim", 0.8, 240, (2.4, 2.2, 2.8), (0, 0, 1.1), (0.65, 0.78, 1.0))
    add_area_light("Fill", 2.5, 40, (3.0, -3.0, 1.6), (0, 0, 0.8), (1.0, 0.85, 0.9))
    add_camera((0.5, -4.9, 1.35), (0, -0.3, 0.92), 50, fstop=1.8)
    return scene


def _body(creature: bpy.types.Object) -> None:
    """Add skin and hair of all parts."""
    skin = material("Skin", (0.10, 0.06, 0.10), roughness=0.8, subsurface_weight=0.3, subsurface_scale=0.05)
    fur = _fur_material()
    for number, (name, middle, radii, share) in enumerate(PARTS):
        part = add_sphere(name, 1.0, skin, Pose(middle, parent=creature))
        part.scale = radii
        kneaded(subdivided(part, 1), 0.6, 0.05)
        bald = middle if name == "Head" else None
        place(
            f"{name} fur", _hairs(name, radii, round(share * HAIRS), number, fur, bald), Pose(middle, parent=creature)
        )


def _fur_material() -> bpy.types.Material:
    """Return hair that scatters as hair does, dark at its root and teal at its tip."""
    made = bpy.data.materials.new("Fur")
    nodes, links = made.node_tree.nodes, made.node_tree.links
    nodes.remove(nodes["Principled BSDF"])
    hair, ramp, info = (nodes.new(f"ShaderNode{kind}") for kind in ("BsdfHairPrincipled", "ValToRGB", "HairInfo"))
    hair.parametrization = "COLOR"
    hair.inputs["Roughness"].default_value = 0.35
    hair.inputs["Random Roughness"].default_value = 0.3
    first, last = ramp.color_ramp.elements
    first.color, last.color = (0.05, 0.08, 0.16, 1), (0.10, 0.45, 0.42, 1)
    links.new(info.outputs["Intercept"], ramp.inputs["Fac"])
    links.new(ramp.outputs["Color"], hair.inputs["Color"])
    links.new(hair.outputs[0], nodes["Material Output"].inputs["Surface"])
    return made


def _hairs(name, radii, count, seed, strand, bald) -> bpy.types.Curves:
    """Return curly hairs that stand on an ellipsoid and hang, but for a head's face."""
    chance = np.random.default_rng(seed)
    out = chance.normal(size=(3 * count, 1, 3))
    out /= np.linalg.norm(out, axis=-1, keepdims=True)
    if bald is not None:
        face = (out[:, 0, 1] < -0.75) & (np.abs(out[:, 0, 2] - 0.05) < 0.45)
        out = out[~face]
    out = out[:count]
    along = np.linspace(0.0, 1.0, POINTS).reshape(1, POINTS, 1)
    length = chance.uniform(0.14, 0.30, (count, 1, 1)) * min(1.0, 2.2 * min(radii))
    clump = np.sin(7 * out @ chance.normal(size=(3, 3)))
    bend = 0.45 * clump + chance.normal(scale=0.18, size=(count, 1, 3)) - np.array((0.0, 0.0, 0.9))
    phase = chance.uniform(0, 2 * np.pi, (count, 1, 1))
    curl = (
        0.035
        * along
        * np.concatenate([np.cos(9 * along + phase), np.sin(9 * along + phase), np.cos(7 * along + 2 * phase)], axis=-1)
    )
    points = out * np.array(radii) + length * (along * out + along**2 * bend + curl)
    curves = bpy.data.hair_curves.new(f"{name} fur")
    curves.add_curves([POINTS] * count)
    curves.position_data.foreach_set("vector", points.astype(np.float32).ravel())
    widths = curves.attributes.new("radius", "FLOAT", "POINT")
    taper = np.broadcast_to(0.0032 * (1.0 - 0.8 * along), (count, POINTS, 1))
    widths.data.foreach_set("value", taper.astype(np.float32).ravel())
    curves.materials.append(strand)
    return curves


def _face(creature: bpy.types.Object) -> None:
    """Add eyes with irises, a nose and horns."""
    white = material("Eye", (0.85, 0.82, 0.78), roughness=0.08, subsurface_weight=0.3, subsurface_scale=0.02)
    iris = mottled_material("Iris", ((0.55, 0.25, 0.02), (0.25, 0.08, 0.01)), 60.0, roughness=0.1)
    pupil = material("Pupil", (0.005, 0.005, 0.005), roughness=0.05)
    nose = roughened(material("Nose", (0.30, 0.06, 0.07), roughness=0.25), 60.0, 0.004)
    horn = roughened(mottled_material("Horn", ((0.55, 0.45, 0.30), (0.35, 0.25, 0.15)), 9.0, roughness=0.4), 25.0, 0.01)
    for side in (-1, 1):
        eye = (0.16 * side, -0.60, 1.42)
        add_sphere(f"Eye {side}", 0.115, white, Pose(eye, parent=creature))
        add_sphere(f"Iris {side}", 0.068, iris, Pose((0.157 * side, -0.655, 1.42), parent=creature))
        add_sphere(f"Pupil {side}", 0.037, pupil, Pose((0.155 * side, -0.692, 1.42), parent=creature))
        tip = add_sphere(f"Horn {side}", 0.09, horn, Pose((0.26 * side, -0.2, 1.78), (0, 0.45 * side, 0), creature))
        tip.scale = (0.7, 0.7, 2.6)
    add_sphere("Nose", 0.085, nose, Pose((0, -0.68, 1.27), parent=creature)).scale.x = 1.4
