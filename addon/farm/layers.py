# SPDX-License-Identifier: GPL-3.0-or-later
"""A frame's samples split over several renders: which layer takes which, and what their pictures say of themselves.

A layer is Cycles' own *sample subset*: a render that takes some of the frame's samples.  Which samples those are does
not depend on the split, because the plan and Cycles' sequence are those of the whole frame.  So the weighted mean of
all layers (`merge`) is the picture that one render would have made, but for the rounding of floats.
"""

import os
import re
import zlib

import bpy

from ..blender.refusal import Refused
from . import known_noise

#: In the header of a picture; a plan's digest, and what is known of its noise, bear the view layer's name.
PREFIX = "spectral_tiles."
PLAN, NOISE = "plan.", "noise."


def part(samples, layer, layers):
    """The samples of one layer, as nearly equal a share as whole samples allow.

    Parameters
    ----------
    samples : int
        Samples a pixel of the whole frame.
    layer, layers : int
        Layer number, from 1, of how many.

    Returns
    -------
    (int, int)
        First sample and how many.
    """
    first = samples * (layer - 1) // layers
    return first, samples * layer // layers - first


def file_of(path, layer, layers):
    """Path of a layer of the frame that goes to `path`."""
    return f"{os.path.splitext(path)[0]}_layer{layer}of{layers}.exr"


def facts(frame, layer_name, plan=None, noise="", tile=None):
    """What `merge` must know of a render, to be written into its picture.

    Parameters
    ----------
    frame : drivers.Frame
    layer_name : str
        The view layer.
    plan : Plan or CellPlan, optional
        None where Cycles renders as if nobody had asked.
    noise : str
        Of `known_noise.described`; empty if known noise is not to be taken out when layers are merged.
    tile : generator.Tile, optional
        That the plan follows.

    Returns
    -------
    dict of str to str
    """
    digest = "" if tile is None else f" {zlib.crc32(tile.values.tobytes()):08x}"
    return {
        "blender": bpy.app.version_string,
        "frame": str(frame.number),
        "samples": str(frame.sampling.samples),
        "seed": str(frame.sampling.frame_seed),
        "subset": f"{frame.sampling.first} {frame.sampling.count}",
        "pattern": frame.pattern + digest,
        f"{PLAN}{layer_name}": known_noise.digest(plan) if plan else "none",
        f"{NOISE}{layer_name}": noise,
    }


def stamp(engine, known):
    """Put `facts` into the engine's result; Blender saves them with the picture."""
    result = engine.get_result()
    for name, value in known.items():
        result.stamp_data_add_field(PREFIX + name, value)


def files_of(path):
    """The files of all layers of the frame that goes to `path`.

    Raises
    ------
    Refused
        There are none, or one is missing, or there are those of several splits.
    """
    folder = os.path.dirname(os.path.abspath(path))
    stem = re.escape(os.path.splitext(os.path.basename(path))[0])
    names = [re.fullmatch(rf"{stem}_layer\d+of(\d+)\.exr", name) for name in sorted(os.listdir(folder))]
    splits = {int(match[1]) for match in names if match}
    if not splits:
        raise Refused(f"There are no layers {file_of(path, 1, 'N')}")
    if len(splits) > 1:
        raise Refused(f"There are layers of several splits beside {path}: of {', of '.join(map(str, sorted(splits)))}")
    layers = splits.pop()
    files = [file_of(path, layer, layers) for layer in range(1, layers + 1)]
    if missing := [file for file in files if not os.path.isfile(file)]:
        raise Refused(f"Missing: {', '.join(missing)}")
    return files
