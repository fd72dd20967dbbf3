# SPDX-License-Identifier: GPL-3.0-or-later
"""What is known of Cycles: its random numbers, cameras, passes, settings and denoiser."""

__all__ = [
    "aperture",
    "denoiser",
    "exposure",
    "passes",
    "plan_image",
    "random_numbers",
    "sampling",
    "scene_analysis",
    "session",
    "shared_sequence",
]
