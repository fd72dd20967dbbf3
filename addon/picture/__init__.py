# SPDX-License-Identifier: GPL-3.0-or-later
"""What is done to pixels: pure numpy."""

__all__ = ["accumulation", "denoiser_bias", "picture", "reconstruction"]
