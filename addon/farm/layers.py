# SPDX-License-Identifier: GPL-3.0-or-later
"""A frame's samples split over several renders: which layer takes which, and what their pictures say of themselves.

A layer is Cycles' own *sample subset*: a render that takes some of the frame's samples.  Which samples those are does
not depend on the split, because the plan and Cycles' sequence are those of the whole frame.  So the weighted mean of
all layers (`merge`) is the picture that one render would have made, but for the rounding of floats.
"""

import json
import os
import re
import zlib

import bpy

from ..blender.refusal import Refused
from . import seal

#: In the header of a picture; a plan's digest and its AOVs bear the view layer's name.
PREFIX = "spectral_tiles."
PLAN, AOVS = "plan.", "aovs."

#: Number of this form of facts; pictures with another one are not merged.
FORMAT = 3


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


def facts(frame, layer_name, plan=None):
    """What `merge` must know of a render, to be written into its picture.

    Parameters
    ----------
    frame : drivers.Frame
    layer_name : str
        The view layer.
    plan : Plan or CellPlan, optional
        None where Cycles renders as if nobody had asked.

    Returns
    -------
    dict of str to str
    """
    return {
        seal.NAME.removeprefix(PREFIX): seal.OPEN,
        "format": str(FORMAT),
        "blender": bpy.app.version_string,
        "frame": str(frame.number),
        "samples": str(frame.sampling.samples),
        "seed": str(frame.sampling.frame_seed),
        "subset": f"{frame.sampling.first} {frame.sampling.count}",
        "pattern": f"{frame.pattern} {_digest(frame.tile.values.tobytes())}" if frame.tile else frame.pattern,
        "sub_frames": str(frame.sub_frames),
        f"{PLAN}{layer_name}": _digest(plan.film) if plan else "none",
        f"{AOVS}{layer_name}": json.dumps(frame.aovs, sort_keys=True),
    }


def _digest(numbers):
    """What tells arrays apart, as eight hexadecimal digits."""
    return f"{zlib.crc32(numbers):08x}"


def aovs_of(text):
    """Types of a view layer's AOVs by their names, out of its facts; None if that is not what the text says."""
    try:
        types = json.loads(text)
    except (ValueError, RecursionError):
        return None
    return types if isinstance(types, dict) and all(kind in ("COLOR", "VALUE") for kind in types.values()) else None


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
    folder, name = os.path.split(os.path.abspath(path))
    stem = re.escape(os.path.splitext(name)[0])
    if not os.path.isdir(folder):
        raise Refused(f"{folder}: no such folder")
    splits = {}
    for name in os.listdir(folder):
        # Numbers that no count of ours has, such as 01 or 0, are parts of other names.
        if match := re.fullmatch(rf"{stem}_layer([1-9]\d{{0,8}})of([1-9]\d{{0,8}})\.exr", name):
            splits.setdefault(int(match[2]), set()).add(int(match[1]))
    if not splits:
        raise Refused(f"There are no layers {file_of(path, 1, 'N')}")
    if len(splits) > 1:
        counts = ", of ".join(map(str, sorted(splits)[:4]))
        raise Refused(f"There are layers of several splits beside {path}: of {counts}")
    (layers, found) = splits.popitem()
    if max(found) > layers:
        raise Refused(f"There is a layer too many: {file_of(path, max(found), layers)}")
    if len(found) < layers:
        # The first missing one comes soon: at most as many come before it as there are files.
        first = next(layer for layer in range(1, layers + 1) if layer not in found)
        others = layers - len(found) - 1
        raise Refused(f"Missing: {file_of(path, first, layers)}" + (f" and {others} more" if others else ""))
    return [file_of(path, layer, layers) for layer in range(1, layers + 1)]
