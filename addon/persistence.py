# SPDX-License-Identifier: GPL-3.0-or-later
"""Evaluated data that outlives one Cycles render: kept for further renders of the frame, and put back as it was.

Blender frees the evaluated scene as soon as Cycles has read it, unless persistent data is on.  It takes that setting
from the user's scene when a render starts, so scenes that need several renders a frame get it for that long.
"""

import bpy

from . import driver

_switched = []


def needed(scene):
    """Whether the scene's settings ask for several Cycles renders of a frame."""
    if scene.render.engine != "SPECTRAL_TILES":
        return False
    settings = scene.spectral_tiles
    return settings.filter != "AS_CYCLES" or settings.adaptive != "OFF" or driver.may_be_subrender(scene)


@bpy.app.handlers.persistent
def _keep(*_):
    for scene in bpy.data.scenes:
        if needed(scene) and not scene.render.use_persistent_data:
            scene.render.use_persistent_data = True
            _switched.append(scene)


@bpy.app.handlers.persistent
def _release(*_):
    while _switched:
        _switched.pop().render.use_persistent_data = False


def render_settings(engine):
    """The settings of an engine's render, its own copy; `engine.render` is a method of ours, which hides them."""
    return engine.path_resolve("render")


def is_kept(engine):
    """Whether the evaluated scene is still there after a Cycles render."""
    return render_settings(engine).use_persistent_data


def values(owner):
    """All plain values of a part of the evaluated scene, by name."""
    return {
        prop.identifier: getattr(owner, prop.identifier)
        for prop in owner.bl_rna.properties
        if not prop.is_readonly
        and prop.type in {"BOOLEAN", "INT", "FLOAT", "STRING", "ENUM"}
        and not getattr(prop, "is_array", False)
    }


def put_back(owner, before):
    """Undo what was written to a part of the evaluated scene since `values`."""
    for name, value in values(owner).items():
        if value != before[name]:
            setattr(owner, name, before[name])


class Overwritten:
    """Values written to evaluated data, which can be put back.

    The next frame's evaluation starts from what it finds, so nothing of ours may be there.
    """

    def __init__(self):
        self._previous = []

    def set(self, owner, **values):
        for name, value in values.items():
            self.keep(owner, name)
            setattr(owner, name, value)

    def keep(self, owner, *names):
        for name in names:
            value = getattr(owner, name)
            self._previous.append((owner, name, value.copy() if hasattr(value, "copy") else value))

    def put_back(self):
        while self._previous:
            setattr(*self._previous.pop())


_HANDLERS = (("render_init", _keep), ("render_complete", _release), ("render_cancel", _release))


def register():
    for name, handler in _HANDLERS:
        getattr(bpy.app.handlers, name).append(handler)


def unregister():
    for name, handler in _HANDLERS:
        getattr(bpy.app.handlers, name).remove(handler)
