# SPDX-License-Identifier: GPL-3.0-or-later
"""What is known of Cycles: its random numbers, cameras, passes, settings and denoiser."""

__all__ = [
    "aperture",
    "camera_film",
    "cell_camera",
    "custom_camera",
    "denoiser",
    "dicing",
    "exposure",
    "osl_camera",
    "passes",
    "plan_image",
    "random_numbers",
    "sampling",
    "scene_analysis",
    "session",
    "shader_nodes",
    "shared_sequence",
    "standstill",
]
