# SPDX-License-Identifier: GPL-3.0-or-later
"""Compare with Cycles: the same frame with the switch off and on, each in a render slot."""

import bpy

from .. import switch
from . import forecast

# Name of the slot, and whether what goes into it is ours.
_RENDERS = (("Cycles", False), ("Spectral Tiles", True))

# What holds both; after another file is loaded, which brings empty slots of these names, it is another one.
_compared = None


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
    global _compared
    image = bpy.data.images["Render Result"]
    image.render_slots.active.name, _compared = name, image.session_uid


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


class SPECTRAL_TILES_OT_other_slot(bpy.types.Operator):
    bl_idname = "spectral_tiles.other_slot"
    bl_label = "Step Between the Compared"
    bl_description = "Show the other one of the two render slots that were compared"

    @classmethod
    def poll(cls, context):
        image = getattr(context.space_data, "image", None)
        is_compared = image is not None and image.session_uid == _compared
        return is_compared and image.render_slots.active.name in dict(_RENDERS)

    def execute(self, context):
        shown = context.space_data.image.render_slots.active.name
        _use_slot(next(name for name, _ in _RENDERS if name != shown))
        return {"FINISHED"}


_CLASSES = (SPECTRAL_TILES_OT_compare, SPECTRAL_TILES_OT_other_slot)
_register_classes, _unregister_classes = bpy.utils.register_classes_factory(_CLASSES)
_key = None


def register():
    global _key
    _register_classes()
    # Before Blender's own J, which steps through all slots that hold something, and is left to the user's slots.
    keymap = bpy.context.window_manager.keyconfigs.addon.keymaps.new("Image Generic", space_type="IMAGE_EDITOR")
    _key = keymap, keymap.keymap_items.new(SPECTRAL_TILES_OT_other_slot.bl_idname, "J", "PRESS")


def unregister():
    keymap, item = _key
    keymap.keymap_items.remove(item)
    _unregister_classes()
