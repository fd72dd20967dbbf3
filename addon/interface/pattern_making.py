# SPDX-License-Identifier: GPL-3.0-or-later
"""Generate Pattern: the generator at work in the background, and its tile set as the pattern of the scene."""

import threading

import bpy
from bpy.props import EnumProperty, IntProperty, StringProperty
from bpy_extras.io_utils import ExportHelper

from ..blender.refusal import Cancelled
from ..cycles.scene_analysis import scene_use
from ..plan.patterns import generator

# Dimensions of a tile for a scene that uses none yet.
_ALL = ("t", "lens.u", "lens.v", "light.u", "light.v")


class Job(threading.Thread):
    """A tile in the making.

    Attributes
    ----------
    fraction : float
        How much is done, 0 to 1.
    cancelled : bool
        Set it to stop the generator at its next step.
    error : str or None
        Why no tile was written.
    """

    def __init__(self, path, **parameters):
        super().__init__(name="Generate Pattern")
        self.fraction = 0.0
        self.cancelled = False
        self.error = None
        self._path = generator.tile_file.check_path(path)
        self._parameters = parameters

    def run(self):
        try:
            generator.save_tile(generator.make_tile(**self._parameters, progress=self._report), self._path)
        except Cancelled:
            pass
        except (ValueError, OSError) as error:
            self.error = str(error)

    def _report(self, done, total):
        if self.cancelled:
            raise Cancelled
        self.fraction = done / total


# The job at work, or None; one at a time.
job = None


class SPECTRAL_TILES_OT_generate_pattern(bpy.types.Operator, ExportHelper):
    bl_idname = "spectral_tiles.generate_pattern"
    bl_label = "Generate Pattern"
    bl_description = (
        "Make a pattern for what this scene uses, such as motion blur and its lights, in the background, "
        "and use it when it is done"
    )
    bl_options = {"REGISTER", "UNDO"}

    filename_ext = ".npz"
    filter_glob: StringProperty(default="*.npz", options={"HIDDEN"})
    method: EnumProperty(
        name="Method",
        description="Design of the tile, as the generator names it",
        items=[(name, name.replace("-", " ").capitalize(), f"Design {name}") for name in generator.METHODS],
        default="spectral",
    )
    size: EnumProperty(
        name="Size",
        description="Side of the tile in pixels. A larger one repeats less and takes longer to make",
        items=[(str(side), f"{side} px", f"{side} x {side} pixels") for side in (16, 32, 64, 128)],
        default="64",
    )
    seed: IntProperty(name="Seed", description="Another seed gives another tile of the same quality", min=0)

    @classmethod
    def poll(cls, context):
        return job is None

    def execute(self, context):
        global job
        dims = scene_use(context.evaluated_depsgraph_get()).dims or _ALL
        try:
            job = Job(self.filepath, method=self.method, size=int(self.size), dims=dims, seed=self.seed)
        except (ValueError, OSError) as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        job.start()
        if bpy.app.background:
            job.join()
            return self._finish(context)
        self._timer = context.window_manager.event_timer_add(0.2, window=context.window)
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        if event.type != "TIMER":
            return {"PASS_THROUGH"}
        for window in context.window_manager.windows:
            for area in window.screen.areas:
                if area.type == "PROPERTIES":
                    area.tag_redraw()
        if job.is_alive():
            return {"PASS_THROUGH"}
        context.window_manager.event_timer_remove(self._timer)
        return self._finish(context)

    def cancel(self, context):
        """Blender ends the operator, because it loads another file or closes the window."""
        stop()

    def _finish(self, context):
        global job
        ended, job = job, None
        if ended.error:
            self.report({"ERROR"}, ended.error)
        if ended.error or ended.cancelled:
            return {"CANCELLED"}
        settings = context.scene.spectral_tiles
        settings.pattern, settings.pattern_path = "FILE", self.filepath
        self.report({"INFO"}, f"Pattern saved as {self.filepath}")
        return {"FINISHED"}


class SPECTRAL_TILES_OT_cancel_pattern(bpy.types.Operator):
    bl_idname = "spectral_tiles.cancel_pattern"
    bl_label = "Cancel"
    bl_description = "Stop making the pattern; no file is written"

    @classmethod
    def poll(cls, context):
        return job is not None

    def execute(self, context):
        job.cancelled = True
        return {"FINISHED"}


def stop():
    """End the job at work, if there is one, without a tile."""
    global job
    if job is not None:
        job.cancelled = True
        job.join()
        job = None


register, _unregister_classes = bpy.utils.register_classes_factory(
    (SPECTRAL_TILES_OT_generate_pattern, SPECTRAL_TILES_OT_cancel_pattern)
)


def unregister():
    stop()
    _unregister_classes()
