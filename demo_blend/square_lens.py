# SPDX-License-Identifier: GPL-3.0-or-later
"""Figures 11 and 12 of the paper: pawns seen through a square lens, as its "simple experimental ray tracer" had one."""

from demo_blend import round_lens


def build():
    """Build the scene and return it."""
    return round_lens.build(blades=4)
