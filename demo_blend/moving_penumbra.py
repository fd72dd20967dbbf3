# SPDX-License-Identifier: GPL-3.0-or-later
"""Figure 16 of the paper: spinning wheels under a large light, so that time and light must be good together."""

from demo_blend.primitives import add_area_light, light_as_in_1991
from demo_blend.spinning_wheels import KEY, stage


def build():
    """Build the scene and return it."""
    scene = stage()
    add_area_light("Key", 1.2, 560, KEY, (0.2, 0.6, 0.8), (1.0, 0.95, 0.88))
    light_as_in_1991(ambient=0.12)
    return scene
