"""Writing a built scene to its committed .blend file."""

import sys
from collections.abc import Callable
from pathlib import Path

import bpy

FOLDER = Path(__file__).parent


def write_blend(build: Callable[[], bpy.types.Scene], path: Path | None = None) -> Path:
    """Build a scene and save it, compressed.

    Parameters
    ----------
    build : callable
        A builder module's ``build``.
    path : Path, optional
        Where to; by default beside the builder module, under its name.
    """
    if path is None:
        path = Path(sys.modules[build.__module__].__file__).with_suffix(".blend")
    build()
    # Relative remapping would write this machine's folders into the file; no scene refers to other files.
    bpy.ops.wm.save_as_mainfile(filepath=str(path), compress=True, relative_remap=False, copy=True)
    return path
