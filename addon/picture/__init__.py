# SPDX-License-Identifier: GPL-3.0-or-later
"""What is done to pixels: pure numpy."""

__all__ = ["accumulation", "control_variates", "denoiser_bias", "nonnegative", "picture", "reconstruction"]
