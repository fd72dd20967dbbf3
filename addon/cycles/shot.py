# SPDX-License-Identifier: GPL-3.0-or-later
"""What Cycles is asked for in one call."""

from typing import NamedTuple

from ..blender.region import Rectangle


class Shot(NamedTuple):
    """Samples of a rectangle of the picture.

    Attributes
    ----------
    rectangle : Rectangle
        Of the region.
    length : int
        Of each pixel's sequence; Cycles heeds a change only upwards (`Session::update_scene`).
    first, count : int
        First sample of the sequence, and how many.
    """

    rectangle: Rectangle
    length: int
    first: int
    count: int
