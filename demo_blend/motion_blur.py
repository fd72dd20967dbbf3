# SPDX-License-Identifier: GPL-3.0-or-later
"""Figures 8 to 10 of the paper: spinning wheels under a point light, where time is all there is to sample."""

from demo_blend.primitives import add_point_light, light_as_in_1991
from demo_blend.spinning_wheels import KEY, stage


def build():
    """Build the scene and return it."""
    scene = stage()
    add_point_light("Key", 0.0, 1500, KEY, (1.0, 0.95, 0.88))
    light_as_in_1991(ambient=0.12)
    return scene
