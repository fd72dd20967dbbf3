# SPDX-License-Identifier: GPL-3.0-or-later
"""What is known of Cycles: its random numbers, cameras, passes, settings and denoiser."""
