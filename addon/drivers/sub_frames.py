# SPDX-License-Identifier: GPL-3.0-or-later
"""The method Sub-Frames (in the making)."""

CHECKS = ()


def render(session, frame):
    raise NotImplementedError
