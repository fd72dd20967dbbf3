# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's half of Spectral Tiles: a render engine that makes Cycles take the samples of a plan."""

import bpy

OLDEST_BLENDER = (5, 2, 0)

if bpy.app.version < OLDEST_BLENDER:
    raise RuntimeError(
        f"Spectral Tiles needs Blender {'.'.join(map(str, OLDEST_BLENDER[:2]))} LTS or newer, "
        f"this is {bpy.app.version_string}"
    )

from . import (  # noqa: E402  (they use what older versions do not have)
    command,
    engine,
    forecast,
    main_thread,
    persistence,
    preset_menu,
    properties,
    slot_comparison,
    tile_making,
    tile_picture,
    ui,
)

_MODULES = (
    properties,
    persistence,
    main_thread,
    engine,
    forecast,
    tile_picture,
    preset_menu,
    tile_making,
    slot_comparison,
    ui,
    command,
)


def register():
    for module in _MODULES:
        module.register()


def unregister():
    for module in reversed(_MODULES):
        module.unregister()
