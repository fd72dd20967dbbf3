# SPDX-License-Identifier: GPL-3.0-or-later
"""Passes of a render result: read what Cycles wrote, put every pixel where it belongs, write it back."""

import numpy as np


def read_passes(engine, layer_name):
    """Passes of one view layer of the engine's result.

    Returns
    -------
    dict
        (pass name, view name) -> float32 array (pixels, channels), rows from the bottom.
    """
    result = engine.get_result()
    layer = result.layers[layer_name]
    pixels = result.resolution_x * result.resolution_y
    passes = {}
    for render_pass in layer.passes:
        buffer = np.empty(pixels * render_pass.channels, np.float32)
        render_pass.rect.foreach_get(buffer)
        passes[render_pass.name, render_pass.view_id] = buffer.reshape(pixels, render_pass.channels)
    return passes


def write_passes(engine, region, layer_name, passes):
    """Replace passes of one view layer of the engine's result by those of `read_passes`' form."""
    for view in engine.get_result().views.keys() or [""]:
        result = engine.begin_result(0, 0, *region.size, layer=layer_name, view=view)
        for render_pass in result.layers[0].passes:
            pixels = passes.get((render_pass.name, render_pass.view_id))
            if pixels is not None:
                render_pass.rect.foreach_set(pixels.ravel())
        engine.end_result(result)


def scatter(pixels, film):
    """Pixels moved to the film positions they serve: `moved[film[p]] = pixels[p]`."""
    moved = np.empty_like(pixels)
    moved[film] = pixels
    return moved
