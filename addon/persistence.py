# SPDX-License-Identifier: GPL-3.0-or-later
"""Persistent Data for the time of a render by Sub-Frames, without the user's setting.

Between two moments Cycles reads only what has changed if its session is kept, and the whole scene if not.  Whether it
is kept is asked of the settings that Blender's render has copied from the scene when it began: after the handlers of
*Render Init*, and before those of *Render Pre* (`RE_RenderFrame`, `RE_RenderAnim`).  So the scene's setting is on
between these two only, but for files that are saved there (autosave, which tells nobody, waits for a render's end), and
no evaluated scene or panel ever sees it.
"""

import bpy

from . import switch

# Scenes whose renders keep what they have read, and have it freed in the end; and of these, those that are switched on.
_kept, _on = set(), set()


@bpy.app.handlers.persistent
def _switch_on(scene, *_):
    render = scene.render
    wanted = switch.is_on(scene) and scene.spectral_tiles.method == "SUB_FRAMES" and render.use_motion_blur
    if wanted and render.engine == "CYCLES" and not render.use_persistent_data:
        _kept.add(scene.name_full)
        _on.add(scene.name_full)
        render.use_persistent_data = True


@bpy.app.handlers.persistent
def _switch_off(scene, *_):
    if scene.name_full in _on:
        _on.remove(scene.name_full)
        scene.render.use_persistent_data = False


@bpy.app.handlers.persistent
def _before_saving(*_):
    _set(False)


@bpy.app.handlers.persistent
def _after_saving(*_):
    _set(True)


def _set(is_kept):
    for scene in bpy.data.scenes:
        if scene.name_full in _on:
            scene.render.use_persistent_data = is_kept


@bpy.app.handlers.persistent
def _free(scene, *_):
    if scene.name_full in _kept:
        _kept.remove(scene.name_full)
        _switch_off(scene)  # there was no Render Pre if the picture was too small, say
        # Blender frees what was kept whenever this is set, and off; the user may have switched it on meanwhile.
        scene.render.use_persistent_data = scene.render.use_persistent_data


_HANDLERS = (
    ("render_init", _switch_on),
    ("render_pre", _switch_off),
    ("render_complete", _free),
    ("render_cancel", _free),
    ("save_pre", _before_saving),
    ("save_post", _after_saving),
)


def register():
    for name, handler in _HANDLERS:
        getattr(bpy.app.handlers, name).append(handler)


def unregister():
    for name, handler in _HANDLERS:
        getattr(bpy.app.handlers, name).remove(handler)
