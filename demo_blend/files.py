# SPDX-License-Identifier: GPL-3.0-or-later
"""Writing a built scene to its .blend file."""

import sys
from collections.abc import Callable
from pathlib import Path

import bpy


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
    _forget_home()
    bpy.ops.wm.save_as_mainfile(filepath=str(path), compress=True, copy=True)
    return path


def _forget_home() -> None:
    """Empty the factory layouts' file browsers, which open in the home folder of whoever builds the scene."""
    browsers = (
        space
        for screen in bpy.data.screens
        for area in screen.areas
        for space in area.spaces
        if space.type == "FILE_BROWSER" and space.params
    )
    for browser in browsers:
        browser.params.directory = b""
