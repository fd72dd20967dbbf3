# SPDX-License-Identifier: GPL-3.0-or-later
"""The rectangle of pixels that a render fills."""

from typing import NamedTuple


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

        The rounding is Blender's own: percentage in `BKE_render_resolution`, border in Cycles' `get_buffer_params`.
        """
        width = max(1, render.resolution_x * render.resolution_percentage // 100)
        height = max(1, render.resolution_y * render.resolution_percentage // 100)
        if not render.use_border:
            return cls((width, height), (0, 0), (width, height))
        left, right = int(render.border_min_x * width), int(render.border_max_x * width)
        bottom, top = int(render.border_min_y * height), int(render.border_max_y * height)
        return cls((width, height), (left, bottom), (max(1, right - left), max(1, top - bottom)))
