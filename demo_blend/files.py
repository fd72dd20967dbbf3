# SPDX-License-Identifier: GPL-3.0-or-later
"""Writing a built scene to its .blend file."""

import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import bpy

#: Scenes of what only sub-frames blur.
SUB_FRAMES = ("swinging_lamp", "blinking_signs")


def write_blend(build: Callable[[], bpy.types.Scene], path: Path | None = None) -> Path:
    """Build a scene and save it, compressed: with the switch on, seen through its camera.

    The add-on must be registered, or else the file has no switch.

    Parameters
    ----------
    build : callable
        A builder module's ``build``.
    path : Path, optional
        Where to; by default beside the builder module, under its name.
    """
    if path is None:
        path = Path(sys.modules[build.__module__].__file__).with_suffix(".blend")
    scene = build()
    if hasattr(scene, "spectral_tiles"):
        scene.spectral_tiles.enabled = True
        if path.stem in SUB_FRAMES:
            scene.spectral_tiles.method = "SUB_FRAMES"
            scene.cycles.samples, scene.cycles.use_adaptive_sampling = 16, False
    _look_through_camera()
    _forget_home()
    bpy.ops.wm.save_as_mainfile(filepath=str(path), compress=True, copy=True)
    return path


def _look_through_camera() -> None:
    """Let all 3D views of the file show what will be rendered."""
    for space in _spaces("VIEW_3D"):
        space.region_3d.view_perspective = "CAMERA"


def _forget_home() -> None:
    """Empty the factory layouts' file browsers, which open in the home folder of whoever builds the scene."""
    for browser in _spaces("FILE_BROWSER"):
        if browser.params:
            browser.params.directory = b""


def _spaces(kind: str) -> Iterator[bpy.types.Space]:
    """All spaces of a kind in the file's screens."""
    return (
        space for screen in bpy.data.screens for area in screen.areas for space in area.spaces if space.type == kind
    )
