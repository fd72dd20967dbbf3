# SPDX-License-Identifier: GPL-3.0-or-later
"""What is to be sampled where: pure numpy."""

__all__ = [
    "arranged_plan",
    "cell_plan",
    "costs",
    "matching",
    "modes",
    "pattern_plan",
    "patterns",
    "rates",
    "rounds",
    "sample_plan",
    "sub_frame_plan",
]
