# SPDX-License-Identifier: GPL-3.0-or-later
"""Passes of a render result: what Cycles puts into each, and reading and writing them.

What a pass holds follows from Cycles' own list (`addons_core/cycles/engine.py`, `list_render_passes`), never from the
look of its name: users call their AOVs as they like.
"""

import enum
import itertools

import numpy as np

from ..blender.region import bands


class Kind(enum.Enum):
    """How the values of a pass come about, and so how those of several renders are put together."""

    #: Light or colour: the mean over samples, spread by the pixel filter.
    COLOUR = enum.auto()
    #: Light that Cycles has divided by the mean colour of what it fell on (`divisor`).
    DIVIDED = enum.auto()
    #: Data that are averaged over samples, but not meant to be filtered.
    MEAN = enum.auto()
    #: What the first sample of a pixel saw (`kernel/film/data_passes.h`).
    FIRST_SAMPLE = enum.auto()
    #: Ranked identifiers and their coverage.
    CRYPTOMATTE = enum.auto()
    #: Samples of the pixel, as a part of what any took at most.
    SAMPLE_COUNT = enum.auto()


#: Names of the passes of that kind.
FIRST_SAMPLE = {"Depth", "Position", "Object Index", "Material Index"}
_MEAN = {"Normal", "Vector", "UV", "Render Time", "Denoising Depth"}
_SAMPLE_COUNT = "Debug Sample Count"
_CRYPTOMATTES = ("CryptoObject", "CryptoMaterial", "CryptoAsset")
_DIVIDED = {
    f"{kind} {part}": f"{kind} Color"
    for kind in ("Diffuse", "Glossy", "Transmission")
    for part in ("Direct", "Indirect")
}

#: The largest sum of samples: Cycles has it in Denoising Depth where any sample hit nothing (`denoising_passes.h`).
LARGEST_SUM = np.finfo(np.float32).max

#: Passes that guide the denoiser: colours and normals of what is seen.
GUIDES = ALBEDO, NORMAL = "Denoising Albedo", "Denoising Normal"

#: The name under which Cycles renders Combined where that is to be denoised.
NOISY = "Noisy Image"


def divisor(name):
    """Name of the pass of the colour by which Cycles divides a pass of the kind DIVIDED."""
    return _DIVIDED[name]


def divisor_of(key, passes, kinds):
    """Key of the pass that Cycles has divided one of some passes by, if it was rendered; of `kinds` by name."""
    if kinds[key[0]] is not Kind.DIVIDED:
        return None
    found = divisor(key[0]), key[1]
    return found if found in passes and passes[found].shape == passes[key].shape else None


def kind(name, aov=None):
    """The `Kind` of a pass.

    Parameters
    ----------
    name : str
    aov : str, optional
        COLOR or VALUE if it is an AOV's.  Its name then says nothing, but where Cycles itself finds a pass of its own
        under it: those of four channels for colours, nearly all for values.
    """
    if aov == "COLOR" and name != "Vector" and name[:-2] not in _CRYPTOMATTES:
        return Kind.COLOUR
    if aov == "VALUE" and name in {"Render Time", _SAMPLE_COUNT}:
        return Kind.COLOUR
    if name in FIRST_SAMPLE:
        return Kind.FIRST_SAMPLE
    if name in _MEAN:
        return Kind.MEAN
    if name == _SAMPLE_COUNT:
        return Kind.SAMPLE_COUNT
    if name[:-2] in _CRYPTOMATTES:
        return Kind.CRYPTOMATTE
    return Kind.DIVIDED if name in _DIVIDED else Kind.COLOUR


def kinds(layer, names):
    """The `Kind` of each of some passes of a view layer, by name."""
    types = aov_types(layer)
    return {name: kind(name, types.get(name)) for name in names}


def aov_types(layer):
    """Types, COLOR or VALUE, of the AOVs that Cycles renders for a view layer, by name."""
    return {aov.name: aov.type for aov in layer.aovs if aov.is_valid}


def add_divisors(engine, layer):
    """Add those colours to the passes of a view layer that its light is divided by; without them it cannot be mixed."""
    for name in _missing_divisors(layer):
        engine.add_pass(name, 3, "RGB", layer=layer.name)


def can_be_mixed(layer):
    """Whether the light of a view layer can be multiplied again: no AOV bears the name of a colour that is missing."""
    return aov_types(layer).keys().isdisjoint(_missing_divisors(layer))


def _missing_divisors(layer):
    """Names of the colours that light of a view layer is divided by, and that are not among its passes."""
    missing = []
    for of in ("diffuse", "glossy", "transmission"):
        parts = (getattr(layer, f"use_pass_{of}_{part}") for part in ("direct", "indirect"))
        if any(parts) and not getattr(layer, f"use_pass_{of}_color"):
            missing.append(f"{of.capitalize()} Color")
    return missing


def read(engine, layer_name, names=None, buffers=None):
    """Passes of one view layer of the engine's result.

    Parameters
    ----------
    engine : bpy.types.RenderEngine
    layer_name : str
    names : collection of str, optional
        The passes that are wanted; all by default.
    buffers : dict, optional
        What an earlier call has returned, to be overwritten: memory that is new costs more than what is copied there.

    Returns
    -------
    dict
        (pass name, view name) -> float32 array (pixels, channels), rows from the bottom.
    """
    result = engine.get_result()
    layer = result.layers[layer_name]
    views = result.views.keys()
    pixels = result.resolution_x * result.resolution_y
    found = {} if buffers is None else buffers
    for render_pass in layer.passes:
        if names is None or render_pass.name in names:
            key = render_pass.name, views[render_pass.view_id]
            if key not in found:
                found[key] = np.empty((pixels, render_pass.channels), np.float32)
            render_pass.rect.foreach_get(found[key].reshape(-1))
    return found


def write(engine, region, layer_name, passes):
    """Replace all passes of one view layer of the engine's result by those of `read`'s form; others become black."""
    width, height = region.size
    # Blender holds a copy of what is being written.
    for view, band in itertools.product(engine.get_result().views.keys(), bands(height)):
        result = engine.begin_result(0, band.start, width, band.stop - band.start, layer=layer_name, view=view)
        for render_pass in result.layers[0].passes:
            pixels = passes.get((render_pass.name, view))
            if pixels is not None:
                render_pass.rect.foreach_set(pixels[band.start * width : band.stop * width].ravel())
        engine.end_result(result)
