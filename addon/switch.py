# SPDX-License-Identifier: GPL-3.0-or-later
"""The switch in Cycles: two methods of `cycles.CyclesRender` that ask the scene whether the render is ours.

Blender looks an engine's methods up on its class at each call, so a function put there takes effect at once.  Final
renders and previews come through `render`; bakes, the viewport and all else never meet us.  What stood there before is
kept and called, be it Cycles' own method or that of another add-on.
"""

import cycles

from . import drivers
from .blender import failure

# What stood in our place, by the name of the method, as long as we are called.
_before = {}

_is_registered = False

#: Whether Cycles renders on its own even where the switch is on: what a comparison is made with.
native = False


def is_on(scene):
    """Whether final renders of a scene are ours."""
    return _is_registered and not native and scene.spectral_tiles.enabled


def _render(engine, depsgraph):
    engine.shown = None
    if engine.is_preview or not is_on(depsgraph.scene_eval):
        _before["render"](engine, depsgraph)
    else:
        failure.attempt(engine, drivers.render, depsgraph, _before["render"])


def _draw(engine, context, depsgraph):
    def draw_cycles():
        _before["draw"](engine, context, depsgraph)

    shown = getattr(engine, "shown", None)
    if shown is None:
        draw_cycles()
    else:
        shown.draw(context.space_data, draw_cycles)


_OURS = {"render": _render, "draw": _draw}


def register():
    global _is_registered
    for name, function in _OURS.items():
        found = vars(cycles.CyclesRender)[name]
        # Another add-on that wrapped us when we were registered before still calls us.
        is_inside = name in _before and found is not _before[name]
        if not is_inside:
            _before[name] = found
            setattr(cycles.CyclesRender, name, function)
    _is_registered = True


def unregister():
    global _is_registered
    _is_registered = False
    for name, function in _OURS.items():
        # Only the outermost can be taken out; inside another one we pass on what is asked.
        if vars(cycles.CyclesRender)[name] is function:
            setattr(cycles.CyclesRender, name, _before.pop(name))
