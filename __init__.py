# SPDX-License-Identifier: GPL-3.0-or-later
"""Spectral Tiles: optimal samples for Cycles.  This is the door that Blender opens the extension by."""


def register():
    from . import addon

    addon.register()


def unregister():
    from . import addon

    addon.unregister()
