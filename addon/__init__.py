# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's half of Spectral Tiles: a switch in Cycles that takes samples where they are needed."""

import bpy

OLDEST_BLENDER = (5, 2, 0)

if bpy.app.version < OLDEST_BLENDER:
    raise RuntimeError(
        f"Spectral Tiles needs Blender {'.'.join(map(str, OLDEST_BLENDER[:2]))} LTS or newer, "
        f"this is {bpy.app.version_string}"
    )

# What follows uses what older versions do not have.  `cycles` is a wing of ours, here.
from cycles import engine as cycles_engine  # noqa: E402

from . import interface, persistence, settings, switch  # noqa: E402
from .blender import main_thread  # noqa: E402

_MODULES = (settings, main_thread, switch, persistence, *interface.REGISTERED)

# Copies of the extension that are enabled, the first of which is at work; kept where every copy finds it.
_COPIES = "spectral_tiles_copies"


def register():
    copies = vars(cycles_engine).setdefault(_COPIES, [])
    copies.append((_start, _stop))
    if len(copies) == 1:
        _start()
    else:
        print("Spectral Tiles: another copy of the extension is enabled, and at work; this one waits for its end")


def unregister():
    copies = vars(cycles_engine)[_COPIES]
    was_at_work = copies[0] == (_start, _stop)
    copies.remove((_start, _stop))
    if was_at_work:
        _stop()
        if copies:
            start, _ = copies[0]
            start()
    if not copies:
        delattr(cycles_engine, _COPIES)


def _start():
    for module in _MODULES:
        module.register()


def _stop():
    for module in reversed(_MODULES):
        module.unregister()
