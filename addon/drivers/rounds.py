# SPDX-License-Identifier: GPL-3.0-or-later
"""Adaptive sampling by rounds of rectangles (in the making)."""


def suit(scene, layer, sampling):
    """Whether samples can be spread by noise."""
    return False


def render(session, frame):
    raise NotImplementedError
