# SPDX-License-Identifier: GPL-3.0-or-later
"""The rectangle of pixels that a render fills."""

import itertools
from typing import NamedTuple

import numpy as np

# Rows of a picture that are worked at together where all of them would take much memory.
_BAND = 64


def bands(height):
    """Rows of a picture in bands of a few, as slices."""
    return [slice(first, min(first + _BAND, height)) for first in range(0, height, _BAND)]


class Rectangle(NamedTuple):
    """Pixels of a region, from its lower left corner: the rectangle's own corner and size."""

    left: int
    bottom: int
    width: int
    height: int

    @property
    def part(self):
        """Its rows and columns, as slices."""
        return slice(self.bottom, self.bottom + self.height), slice(self.left, self.left + self.width)


class Region(NamedTuple):
    """Pixels of a render, absolute in the full frame, counted from its lower left corner.

    Attributes
    ----------
    frame : (int, int)
        Width and height of the full frame in pixels.
    corner : (int, int)
        The region's lower left pixel.
    size : (int, int)
        The region's width and height in pixels.
    """

    frame: tuple[int, int]
    corner: tuple[int, int]
    size: tuple[int, int]

    @classmethod
    def of_render(cls, render):
        """Region that Blender will render with these settings (`bpy.types.RenderSettings`).

        The rounding is Blender's own: the percentage in `BKE_render_resolution`, the border in single precision as in
        Cycles' `BlenderSync::get_buffer_params`.
        """
        width = max(1, render.resolution_x * render.resolution_percentage // 100)
        height = max(1, render.resolution_y * render.resolution_percentage // 100)
        if not render.use_border:
            return cls((width, height), (0, 0), (width, height))
        left, right = (int(np.float32(x) * np.float32(width)) for x in (render.border_min_x, render.border_max_x))
        bottom, top = (int(np.float32(y) * np.float32(height)) for y in (render.border_min_y, render.border_max_y))
        return cls((width, height), (left, bottom), (max(1, right - left), max(1, top - bottom)))

    @property
    def pixels(self):
        """Number of pixels in the region."""
        return self.size[0] * self.size[1]

    def holds(self, x, y):
        """Whether pixels of the full frame lie in the region; integer arrays that broadcast together."""
        left, bottom = self.corner
        return (left <= x) & (x < left + self.size[0]) & (bottom <= y) & (y < bottom + self.size[1])

    def border(self, rectangle):
        """Settings of Blender's border for a rectangle of the region (Rectangle).

        Returns
        -------
        dict of str to bool or float
            By property of `bpy.types.RenderSettings`.
        """
        # In the middle of pixels, as Blender rounds down.
        first = np.add(self.corner, rectangle[:2])
        left, bottom = (first + 0.5) / self.frame
        right, top = np.minimum((first + rectangle[2:] + 0.5) / self.frame, 1.0)
        return {
            "use_border": True,
            "border_min_x": left,
            "border_min_y": bottom,
            "border_max_x": right,
            "border_max_y": top,
        }

    def windows(self, side):
        """The region cut by the full frame's grid of squares of `side` pixels.

        Returns
        -------
        list of (slice, slice)
            Rows and columns of each piece, relative to the region's corner.
        """

        def cuts(start, length):
            inner = range((start // side + 1) * side, start + length, side)
            edges = [0, *(edge - start for edge in inner), length]
            return [slice(*pair) for pair in itertools.pairwise(edges)]

        return list(itertools.product(cuts(self.corner[1], self.size[1]), cuts(self.corner[0], self.size[0])))
