# SPDX-License-Identifier: GPL-3.0-or-later
"""Layers of a frame and their merge."""

__all__ = ["layers", "merge", "seal"]
