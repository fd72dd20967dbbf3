# SPDX-License-Identifier: GPL-3.0-or-later
"""The switch in Cycles: two functions of `cycles.engine` that ask the scene whether the render is ours.

`CyclesRender` looks its functions up at each call, so what is put there takes effect at once.  Its class stays as it
is: another add-on that wraps `CyclesRender.render`, before us or after us, sees one call and the whole picture.  Final
renders and previews come through `render`; bakes, the viewport and all else never meet us.
"""

from cycles import engine as cycles

from . import drivers
from .blender import failure

#: Whether final renders are ours whatever their scene says, for a comparison; None leaves it to the scene.
forced = None


def is_on(scene):
    """Whether final renders of a scene are ours."""
    return scene.spectral_tiles.enabled if forced is None else forced


def _render(render_by_cycles, engine, depsgraph):
    engine.shown = None
    if engine.is_preview or not is_on(depsgraph.scene_eval):
        render_by_cycles(engine, depsgraph)
    else:
        failure.attempt(engine, drivers.render, depsgraph, render_by_cycles)


def _draw(draw_by_cycles, engine, depsgraph, space):
    shown = getattr(engine, "shown", None)
    if shown is None:
        draw_by_cycles(engine, depsgraph, space)
    else:
        shown.draw(space, lambda: draw_by_cycles(engine, depsgraph, space))


class _Wrapper:
    """A function in the place of another one, which is given to it, and called instead of it once `is_over`."""

    def __init__(self, function, wrapped):
        self.wrapped = wrapped
        self.is_over = False
        self._function = function

    def __call__(self, *arguments):
        if self.is_over:
            self.wrapped(*arguments)
        else:
            self._function(self.wrapped, *arguments)


_OURS = {"render": _render, "draw": _draw}
_wrappers = {}


def register():
    for name, function in _OURS.items():
        found = getattr(cycles, name)
        # Whoever wrapped one of ours, and is gone, may have put it back when it was over.
        while isinstance(found, _Wrapper) and found.is_over:
            found = found.wrapped
        _wrappers[name] = _Wrapper(function, found)
        setattr(cycles, name, _wrappers[name])


def unregister():
    while _wrappers:
        name, wrapper = _wrappers.popitem()
        wrapper.is_over = True
        # Only the outermost can be taken out; inside another one it passes on what is asked.
        if getattr(cycles, name) is wrapper:
            setattr(cycles, name, wrapper.wrapped)
