# SPDX-License-Identifier: GPL-3.0-or-later
"""The paper's wheels with everything at once: they spin in the penumbra of an area light, seen through an open lens.

Three spoked wheels of different size and speed stand between one soft light and a wall, so that every parameter of the
paper's sample matters somewhere in the picture: time on the spokes, the light's position in the shadows of what stands
still, both together in the moving shadows, and the lens on the wheel in front and the wall behind. `motion_blur`
(figures 8 to 10) and `moving_penumbra` (figure 16) are the same wheels with less to sample.
"""

import math

from demo_blend.primitives import (
    Pose,
    add_area_light,
    add_box,
    add_camera,
    add_cylinder,
    add_plane,
    add_torus,
    empty_scene,
    material,
    place,
    spin,
)

SPOKES = 8

#: Where the light hangs.
KEY = (-3.6, -3.2, 3.9)


def build():
    """Build the scene and return it."""
    scene = stage(fstop=0.28)
    add_area_light("Key", 1.0, 560, KEY, (0.2, 0.6, 0.8), (1.0, 0.95, 0.88))
    return scene


def stage(fstop: float | None = None):
    """Build everything but the light, and return the scene; without an f-stop the camera is a pinhole."""
    scene = empty_scene()
    scene.render.use_motion_blur = True

    plaster = material("Plaster", (0.72, 0.70, 0.66), roughness=0.9)
    floor = material("Floor", (0.42, 0.34, 0.26), roughness=0.45)
    add_plane("Floor", (24, 24), floor)
    add_plane("Wall", (24, 12), plaster, Pose((0, 1.9, 6), (math.radians(90), 0, 0)))

    # Name, rim radius, place of the hub on the floor, heading, degrees a frame, colour of the rim.
    _wheel("Left", 0.82, (-1.95, 0.95), 24, 31, (0.62, 0.07, 0.05))
    _wheel("Middle", 1.15, (0.1, 0.65), -8, -24, (0.80, 0.42, 0.05))
    _wheel("Right", 0.58, (1.7, -1.45), -30, 43, (0.03, 0.26, 0.38))

    add_camera((0.7, -7.4, 2.3), (0.2, 0.55, 1.0), 46, fstop)
    return scene


def _wheel(name: str, radius: float, hub: tuple[float, float], heading: float, speed: float, color) -> None:
    """Add one wheel on a stand; its hub is `radius` and a gap above the floor, its axle horizontal.

    Parameters
    ----------
    name : str
        Prefix of the objects' names.
    radius : float
        Radius of the rim's centre line.
    hub : tuple of float
        x and y of the hub.
    heading, speed : float
        Turn of the whole wheel about the vertical, and spin about the axle a frame, in degrees.
    color : tuple of float
        Paint of the rim.
    """
    paint = material(f"{name} paint", color, roughness=0.35)
    wood = material(f"{name} spokes", (0.75, 0.62, 0.42), roughness=0.5)
    iron = material(f"{name} iron", (0.10, 0.10, 0.11), roughness=0.4)

    tube = 0.075 * radius
    height = radius + tube + 0.12
    stand = place(f"{name} stand", None, Pose((*hub, 0.0), (0, 0, math.radians(heading))))
    # The axle's empty turns z, about which all parts are round, to the wheel's own horizontal axis.
    axle = place(f"{name} axle", None, Pose((0, 0, height), (math.radians(90), 0, 0), stand))
    wheel = add_torus(f"{name} rim", (radius, tube), paint, Pose(parent=axle))
    add_cylinder(f"{name} hub", 0.16 * radius, 0.3 * radius, iron, Pose(parent=wheel))
    for spoke in range(SPOKES):
        turn = 2 * math.pi * spoke / SPOKES
        middle = 0.55 * radius
        pose = Pose((middle * math.cos(turn), middle * math.sin(turn), 0), (0, math.radians(90), turn), wheel)
        add_cylinder(f"{name} spoke {spoke + 1}", 0.042 * radius, 0.82 * radius, wood, pose)
    spin(wheel, math.radians(speed))

    _stand(name, radius, height, iron, stand)


def _stand(name: str, radius: float, height: float, iron, stand) -> None:
    """Add what carries a wheel: an axle to a post behind it, and a foot."""
    back = 0.32 * radius
    add_cylinder(f"{name} pin", 0.05 * radius, back, iron, Pose((0, back / 2, height), (math.radians(90), 0, 0), stand))
    thick = 0.09 * radius
    add_box(f"{name} post", (thick, thick, height), iron, Pose((0, back, height / 2), parent=stand), bevel=0.1 * thick)
    add_box(f"{name} foot", (0.7 * radius, 0.5 * radius, 0.05), iron, Pose((0, back, 0.025), parent=stand), bevel=0.01)
