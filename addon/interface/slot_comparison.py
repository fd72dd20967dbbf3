# SPDX-License-Identifier: GPL-3.0-or-later
"""Compare with Cycles: the same frame with the switch off and on, each in a render slot."""

import bpy

from .. import switch
from . import forecast

# Name of the slot, and whether what goes into it is ours.
_RENDERS = (("Cycles", False), ("Spectral Tiles", True))


def _use_slot(name):
    """Render into the slot of this name, which is made if needed; the user's own slots keep what they hold."""
    result = bpy.data.images.get("Render Result")
    if result is None:
        return  # nothing was rendered yet, so no slot holds anything
    slots = result.render_slots
    if name not in [slot.name for slot in slots]:
        slots.new(name=name)
    slots.active_index = [slot.name for slot in slots].index(name)


def _name_slot(name):
    """Name the slot that was rendered into, which Blender made if there was none."""
    bpy.data.images["Render Result"].render_slots.active.name = name


class SPECTRAL_TILES_OT_compare(bpy.types.Operator):
    bl_idname = "spectral_tiles.compare"
    bl_label = "Compare with Cycles"
    bl_description = (
        "Render this frame without and with Spectral Tiles, each into a render slot of its own. "
        "Press J over the picture to step between them"
    )

    @classmethod
    def poll(cls, context):
        return context.engine == "CYCLES" and not bpy.app.is_job_running("RENDER")

    def execute(self, context):
        try:
            for name, switch.forced in _RENDERS:
                _use_slot(name)
                bpy.ops.render.render()
                _name_slot(name)
        except RuntimeError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        finally:
            switch.forced = None
        return {"FINISHED"}

    # In a window each render is a job of its own, and this waits for it to end.

    def invoke(self, context, event):
        how = forecast.chosen(context.scene, context.view_layer)
        for message in how.refusals if how else ():
            self.report({"ERROR"}, message)
            return {"CANCELLED"}
        self._left = list(_RENDERS)
        self._stopped = False
        bpy.app.handlers.render_cancel.append(self._stop)
        self._timer = context.window_manager.event_timer_add(0.2, window=context.window)
        context.window_manager.modal_handler_add(self)
        self._start_next(context)
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        if event.type != "TIMER" or bpy.app.is_job_running("RENDER"):
            return {"PASS_THROUGH"}
        _name_slot(self._name)
        if self._left and not self._stopped:
            self._start_next(context)
            return {"PASS_THROUGH"}
        self.cancel(context)
        if self._stopped:
            return {"CANCELLED"}
        self.report({"INFO"}, "Both are rendered; press J over the picture to step between them")
        return {"FINISHED"}

    def cancel(self, context):
        context.window_manager.event_timer_remove(self._timer)
        bpy.app.handlers.render_cancel.remove(self._stop)
        switch.forced = None

    def _start_next(self, context):
        self._name, switch.forced = self._left.pop(0)
        _use_slot(self._name)
        view = context.preferences.view
        shown = view.render_display_type
        if not self._left:
            # In the place of the first: Blender would fill the window once more, and forget what had been in it.
            view.render_display_type = "NONE"
        try:
            bpy.ops.render.render("INVOKE_DEFAULT")
        finally:
            view.render_display_type = shown

    def _stop(self, *_):
        self._stopped = True


register, unregister = bpy.utils.register_classes_factory((SPECTRAL_TILES_OT_compare,))
