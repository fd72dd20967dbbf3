# SPDX-License-Identifier: GPL-3.0-or-later
"""Cycles, called one or several times for a view layer while its scene stays loaded.

A call of Cycles' render inside `CyclesRender.render` reads the sampling settings of the evaluated scene anew, but
nothing else: unless `cycles.engine.reset` comes between, nothing is synchronised again, and a call costs about a
millisecond.  Only the render border is read one call late, since Cycles takes the size of its buffers from its camera
as it was last synchronised (`BlenderSession::render`, `BlenderSync::get_buffer_params`).
"""

import _cycles
import bpy
from cycles import engine as cycles

from ..blender import main_thread, timeline
from ..blender.evaluated import Overwritten, render_settings
from ..blender.region import Rectangle, Region
from . import passes
from .shot import Shot

# A rectangle that costs next to nothing.
_PIXEL = Rectangle(0, 0, 1, 1)

#: Cycles renders larger pictures in tiles whatever its settings say (`TileManager::MAX_TILE_SIZE`).
LARGEST = 8192


class Session:
    """The calls of Cycles for one view layer, inside `CyclesRender.render`.

    Use it as a context: at its end the evaluated scene is as it was.

    Parameters
    ----------
    engine : bpy.types.RenderEngine
    depsgraph : bpy.types.Depsgraph

    Attributes
    ----------
    region : Region
        The pixels of the picture.
    time : float
        Of the frame.
    """

    def __init__(self, engine, depsgraph):
        self.engine, self.depsgraph = engine, depsgraph
        self.scene, self.layer = depsgraph.scene_eval, depsgraph.view_layer_eval
        # Names and originals outlast the evaluated data, which Blender may free.
        self.layer_name = self.layer.name
        self.original_scene, self.original_layer = depsgraph.scene, depsgraph.view_layer
        self.region = Region.of_render(self.scene.render)
        self.time = timeline.frame_of(self.original_scene)
        self._written = Overwritten()

    def __enter__(self):
        # Blender frees the evaluated scene once Cycles has read it, but for engines that draw by GPU
        # (`RE_engine_free_blender_memory`).
        self.engine.bl_use_gpu_context = True
        return self

    def __exit__(self, *exception):
        main_thread.run(self._written.put_back, self.engine)
        self.engine.bl_use_gpu_context = False

    def set(self, owner, **values):
        """Write evaluated data; they are put back in the end."""
        main_thread.run(lambda: self._written.set(owner, **values), self.engine)

    def write(self, function):
        """Call `function(written)`, which writes evaluated data by an `Overwritten`, in the main thread."""
        main_thread.run(lambda: function(self._written), self.engine)

    def set_sampling(self, **values):
        """Write settings of Cycles."""
        self.set(self.scene.cycles, **values)

    def reset(self):
        """Have Cycles read the scene again before the next call; needed where anything but sampling has changed."""
        cycles.reset(self.engine, bpy.data, self.depsgraph)

    def go_to(self, time, write):
        """Set the scene to a time, in frames, and have Cycles read it before the next call.

        Parameters
        ----------
        time : float or None
            None leaves it where it is.
        write : callable
            `write(written)` writes evaluated data, of which nothing is left that was written before.
        """
        main_thread.run(lambda: self._move(time, write), self.engine)
        self.reset()

    def leave(self):
        """Set the scene to the time that it was found at, after `go_to`."""
        main_thread.run(lambda: self._move(self.time, lambda written: None), self.engine)

    def _move(self, time, write):
        # What is written must not be what an evaluation starts from.
        self._written.put_back()
        if time is not None:
            timeline.go_to(self.engine, self.original_scene, time, self.time)
        write(self._written)

    def call(self, names=None, then_rectangles=False):
        """Render the whole region; return its passes, as of `passes.read`.

        Parameters
        ----------
        names : collection of str, optional
            The passes that are wanted; all by default.
        then_rectangles : bool
            Whether `call_rectangles` follows.
        """
        if then_rectangles:
            self._aim(_PIXEL)
        self._render()
        if max(self.region.size) > LARGEST:
            cycles.render_frame_finish(self.engine)  # puts Cycles' own tiles together
        return passes.read(self.engine, self.layer_name, names)

    def call_rectangles(self, shots, names=None):
        """Render some samples of rectangles of the region, one after the other, after a `call`.

        Parameters
        ----------
        shots : sequence of Shot
        names : collection of str, optional
            The passes that are wanted; all by default.

        Yields
        ------
        dict
            For each, (pass name, view name) -> float32 array (height, width, channels), which the next overwrites.
        """
        width, height = self.region.size
        # Until here the border is that of a single pixel.
        self._shoot(Shot(_PIXEL, shots[0].length, 0, 1), shots[0].rectangle)
        found = {}
        for shot, following in zip(shots, [*(shot.rectangle for shot in shots[1:]), _PIXEL], strict=True):
            self._shoot(shot, following)
            found = passes.read(self.engine, self.layer_name, names, found)
            yield {
                key: pixels.reshape(height, width, -1)[: shot.rectangle.height, : shot.rectangle.width]
                for key, pixels in found.items()
            }

    def _render(self):
        # As `cycles.engine.render` does, in whose place the switch is.
        _cycles.render(self.engine.session, self.depsgraph.as_pointer())

    def _shoot(self, shot, following):
        self._aim(following)
        self.set_sampling(
            samples=shot.length,
            use_sample_subset=True,
            sample_offset=shot.first,
            sample_subset_length=shot.count,
        )
        self._render()

    def _aim(self, rectangle):
        """Set the border of the call after the next."""
        self.set(render_settings(self.engine), **self.region.border(rectangle))
