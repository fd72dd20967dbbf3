# SPDX-License-Identifier: GPL-3.0-or-later
"""Passes of a render result: read what Cycles wrote, put every pixel where it belongs, write it back."""

import itertools

import numpy as np

from .region import bands

# Passes that Cycles writes for the first sample of its sequence only (kernel/film/data_passes.h).
FIRST_SAMPLE_PASSES = {"Depth", "Position", "Object Index", "Material Index"}


def read_passes(engine, layer_name):
    """Passes of one view layer of the engine's result.

    Returns
    -------
    dict
        (pass name, view name) -> float32 array (pixels, channels), rows from the bottom.
    """
    result = engine.get_result()
    layer = result.layers[layer_name]
    views = result.views.keys()
    pixels = result.resolution_x * result.resolution_y
    passes = {}
    for render_pass in layer.passes:
        buffer = np.empty(pixels * render_pass.channels, np.float32)
        render_pass.rect.foreach_get(buffer)
        passes[render_pass.name, views[render_pass.view_id]] = buffer.reshape(pixels, render_pass.channels)
    return passes


def write_passes(engine, region, layer_name, passes):
    """Replace passes of one view layer of the engine's result by those of `read_passes`' form."""
    width, height = region.size
    # Blender holds a copy of what is being written.
    for view, band in itertools.product(engine.get_result().views.keys(), bands(height)):
        result = engine.begin_result(0, band.start, width, band.stop - band.start, layer=layer_name, view=view)
        for render_pass in result.layers[0].passes:
            pixels = passes.get((render_pass.name, view))
            if pixels is not None:
                render_pass.rect.foreach_set(pixels[band.start * width : band.stop * width].ravel())
        engine.end_result(result)


def scatter(pixels, film):
    """Pixels moved to the film positions they serve: `moved[film[p]] = pixels[p]`."""
    pixels = np.ascontiguousarray(pixels)
    moved = np.empty_like(pixels)
    # Each as a whole: channel by channel it takes up to four times as long.
    whole = f"V{pixels[:1].nbytes}"
    moved.view(whole)[film] = pixels.view(whole)
    return moved


# Passes that cannot be mixed: one sample speaks for its pixel.
_DATA = ("Depth", "Position", "Normal", "Vector", "UV", "Object Index", "Material Index", "Crypto", "Debug")


def _colour_keys(passes):
    return [key for key in passes if not key[0].startswith(_DATA)]


def _albedo(passes, key):
    """Key of the pass that Cycles has divided this one by, if it was rendered."""
    kind, _, part = key[0].rpartition(" ")
    albedo = (f"{kind} Color", key[1])
    return albedo if part in {"Direct", "Indirect"} and albedo in passes else None


def add_divisors(engine, layer):
    """Add those colours to the passes of a view layer that its light was divided by; without them it cannot be mixed.

    Returns
    -------
    list of str
        Names of the passes that were added.
    """
    added = []
    for kind in ("diffuse", "glossy", "transmission"):
        parts = (getattr(layer, f"use_pass_{kind}_{part}") for part in ("direct", "indirect"))
        if any(parts) and not getattr(layer, f"use_pass_{kind}_color"):
            added.append(f"{kind.capitalize()} Color")
            engine.add_pass(added[-1], 3, "RGB", layer=layer.name)
    return added


def combined(passes):
    """The picture itself, (pixels, 4)."""
    return next(pixels for (name, _), pixels in passes.items() if name == "Combined")


def colours(passes, height, width):
    """All passes that a filter may mix, as light: (channels, height, width)."""
    lights = []
    for key in _colour_keys(passes):
        albedo = _albedo(passes, key)
        lights.append(passes[key] * passes[albedo] if albedo else passes[key])
    return np.concatenate(lights, axis=1).T.reshape(-1, height, width)


def with_colours(passes, planes):
    """Passes with their colours replaced by planes in the form of `colours`."""
    keys = _colour_keys(passes)
    ends = np.cumsum([passes[key].shape[1] for key in keys])
    lights = np.split(planes.reshape(len(planes), -1).T, ends[:-1], axis=1)
    replaced = passes | dict(zip(keys, lights, strict=True))
    for key in keys:
        if albedo := _albedo(passes, key):
            light, divisor = replaced[key], replaced[albedo]
            # Below zero where a filter's lobes are: the passes' product is to be the light there, too.
            replaced[key] = np.divide(light, divisor, out=np.zeros_like(light), where=divisor != 0.0)
    return replaced


def mean(before, passes, count, region):
    """Passes of `count` samples, of which the last one's are `passes`, and the others' mean is `before`."""
    if count == 1:
        return passes
    width, height = region.size
    share = np.float32(1.0 / count)
    colour_keys = _colour_keys(passes)
    data = {key: before[key] for key in passes.keys() - set(colour_keys)}
    for key in data:
        if key[0] not in FIRST_SAMPLE_PASSES:
            data[key] = data[key] + share * (passes[key] - data[key])
    light = colours(before, height, width)
    light = light + share * (colours(passes, height, width) - light)
    return with_colours(before | data, light)
