# SPDX-License-Identifier: GPL-3.0-or-later
"""A dandelion lets its seeds go: hair in motion before an open lens, the evening sun through far trees behind it."""

import math
import random

import bpy
import numpy as np

from demo_blend.primitives import (
    Pose,
    add_area_light,
    add_camera,
    add_plane,
    add_sphere,
    animate,
    copy_of,
    emission,
    empty_scene,
    material,
    mottled_material,
    place,
    set_world,
)

#: Length of a seed's stalk, and radius of the flower that seeds stand on, in metres at a hundred times life size.
STALK = 0.62
HEART = 0.10


def build():
    """Build the scene and return it."""
    scene = empty_scene()
    scene.render.use_motion_blur = True
    set_world((0.10, 0.14, 0.10))
    white = material("Seed hair", (0.85, 0.83, 0.78), roughness=0.6)
    brown = material("Seed", (0.20, 0.11, 0.05), roughness=0.6)
    green = material("Stem", (0.16, 0.26, 0.06), roughness=0.5)
    _backdrop()

    add_sphere("Heart", HEART, green, Pose((-0.55, 0, 1.25)))
    place("Stem", _strands("Stem", _stem(), 0.035, 0.035, green))
    seed = _strands("Seed", _seed(), 0.004, 0.003, white)
    fruit = _strands("Fruit", np.array([[(0, 0, z) for z in np.linspace(0.0, 0.09, 4)]]), 0.014, 0.008, brown)
    _standing(seed, fruit)
    _flying(seed, fruit)

    add_area_light("Sun", 0.9, 260, (2.6, 3.2, 3.4), (0, 0, 1.2), (1.0, 0.80, 0.52))
    add_area_light("Sky", 3.0, 60, (-2.0, -3.0, 3.5), (0, 0, 1.2), (0.65, 0.8, 1.0))
    add_camera((0.35, -5.2, 1.25), (0.30, 0.0, 1.32), 40, fstop=0.45)
    return scene


def _backdrop() -> None:
    """Add a meadow and, far away, what the low sun leaves of the trees' gaps."""
    meadow = mottled_material("Meadow", ((0.05, 0.12, 0.02), (0.13, 0.19, 0.03)), 1.5, roughness=0.9)
    add_plane("Meadow", (80, 80), meadow, Pose((0, 20, -1.0)))
    add_plane("Trees", (80, 30), material("Trees", (0.06, 0.12, 0.05), roughness=1.0),
              Pose((0, 26, 8), (math.radians(90), 0, 0)))  # fmt: skip
    chance = random.Random(2)
    colors = ((1.0, 0.72, 0.3), (1.0, 0.85, 0.5), (0.6, 0.85, 0.35))
    gaps = [
        add_sphere(f"Gap {i}", 0.10, emission(f"Gap {i}", c, 5.0), Pose((-4 + 4 * i, 22, 4)))
        for i, c in enumerate(colors)
    ]
    for i in range(26):
        pose = Pose((chance.uniform(-7.5, 8.5), chance.uniform(14, 25), chance.uniform(0.6, 7.0)))
        gap = copy_of(chance.choice(gaps), f"Far gap {i}", pose)
        gap.scale = (chance.uniform(0.5, 1.3),) * 3


def _standing(seed, fruit) -> None:
    """Add the seeds that are still on the flower, all but those on the lee side."""
    directions = _even_directions(110)
    for i, out in enumerate(directions):
        if (out[0] > 0.35 and out[2] > -0.5) or out[2] < -0.85:
            continue
        _place_seed(f"{i}", seed, fruit, Pose(tuple(HEART * out + (-0.55, 0, 1.25)), _upright(out)))


def _flying(seed, fruit) -> None:
    """Add the seeds in the air, which drift and tumble."""
    chance = random.Random(9)
    for i in range(26):
        along = chance.random() ** 0.8
        spot = (0.2 + 2.3 * along, chance.uniform(-1.3, 1.6), 1.3 + 0.75 * along + chance.uniform(-0.75, 0.6))
        turn = (chance.uniform(-0.6, 0.6), chance.uniform(0.1, 1.0), chance.uniform(0, 6))
        carrier = place(f"Carrier {i}", None, Pose(spot, turn))
        _place_seed(f"flying {i}", seed, fruit, Pose(parent=carrier))
        way = (chance.uniform(0.03, 0.12), chance.uniform(-0.03, 0.03), chance.uniform(-0.01, 0.05))
        swing = chance.uniform(-0.12, 0.12)
        animate(
            carrier, "location", {f: tuple(s + w * (f - 12) for s, w in zip(spot, way, strict=True)) for f in (1, 24)}
        )
        animate(carrier, "rotation_euler", {f: (turn[0], turn[1] + swing * (f - 12), turn[2]) for f in (1, 24)})


def _place_seed(name, seed, fruit, pose: Pose) -> None:
    place(f"Seed {name}", seed, pose)
    place(f"Fruit {name}", fruit, pose)


def _seed() -> np.ndarray:
    """Return a stalk along z and the parachute on it, shape (strands, points, 3)."""
    chance = np.random.default_rng(5)
    part = np.linspace(0.0, 1.0, 4)[:, None]
    stalk = part * (0.0, 0.0, STALK)
    strands = [stalk]
    for turn in np.arange(30) * 2.399963:
        rise = chance.uniform(0.15, 0.75)
        tip = chance.uniform(0.24, 0.30) * np.array(
            (math.cos(turn) * math.cos(rise), math.sin(turn) * math.cos(rise), math.sin(rise))
        )
        strands.append((0, 0, STALK) + part * tip + part**2 * (0, 0, 0.03))
    return np.stack(strands)


def _stem() -> np.ndarray:
    part = np.linspace(0.0, 1.0, 8)[:, None]
    foot, head = np.array((-0.30, 0.1, -1.0)), np.array((-0.55, 0, 1.18))
    return (foot + part * (head - foot) + np.sin(np.pi * part) * (0.10, 0, 0))[None]


def _even_directions(count: int) -> np.ndarray:
    """Return unit vectors on a spiral over the sphere, shape (count, 3)."""
    z = 1 - (2 * np.arange(count) + 1) / count
    turn = np.arange(count) * 2.399963
    out = np.sqrt(1 - z * z)
    return np.stack((out * np.cos(turn), out * np.sin(turn), z), axis=1)


def _upright(direction) -> tuple[float, float, float]:
    """Return the rotation that turns z into a direction."""
    x, y, z = direction
    return (0.0, math.acos(z), math.atan2(y, x))


def _strands(name, points, root, tip, made) -> bpy.types.Curves:
    """Return hair curves along points of shape (strands, points, 3), with radii from root to tip."""
    strands, count, _ = points.shape
    curves = bpy.data.hair_curves.new(name)
    curves.add_curves([count] * strands)
    curves.position_data.foreach_set("vector", points.astype(np.float32).ravel())
    radii = np.broadcast_to(np.linspace(root, tip, count), (strands, count)).astype(np.float32)
    curves.attributes.new("radius", "FLOAT", "POINT").data.foreach_set("value", radii.ravel())
    curves.materials.append(made)
    return curves
