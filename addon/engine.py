# SPDX-License-Identifier: GPL-3.0-or-later
"""The render engine: Cycles, told which samples to take.

Final renders go through a driver (`addon.drivers`); the viewport, previews and baking are Cycles' own, called
just as Blender's Cycles add-on calls them (`addons_core/cycles/__init__.py`).
"""

import bpy
from cycles import engine as cycles

from . import driver, drivers, failure, subrender


class SpectralTilesRender(bpy.types.RenderEngine):
    bl_idname = "SPECTRAL_TILES"
    bl_label = "Cycles Spectral Tiles"
    bl_use_eevee_viewport = True
    bl_use_preview = True
    bl_use_exclude_layers = True
    bl_use_spherical_stereo = True
    bl_use_custom_freestyle = True

    # Cycles renders on its own, with our samples a pixel: what a comparison is made with.
    native = False

    def __init__(self, *args, **kwargs):
        super().__init__(*args, **kwargs)
        self.session = None
        self.job = None
        self.shown = None

    def __del__(self):
        cycles.free(self)

    # Final render

    def update(self, data, depsgraph):
        self.job = self.shown = None
        if self.native and not self.is_preview:
            driver.set_samples(depsgraph.scene_eval.cycles, depsgraph.scene.spectral_tiles.samples)
        elif not self.is_preview:
            self.job = failure.attempt(self, drivers.prepare, data, depsgraph)
            # Sub-renders have a session of their own.
            if self.job is None or isinstance(self.job, subrender.Job):
                return
        if not self.session:
            cycles.create(self, data, preview_osl=self.is_preview and bpy.context.scene.cycles.shading_system)
        cycles.reset(self, data, depsgraph)

    def render(self, depsgraph):
        if self.job is not None:
            failure.attempt(self, drivers.render, depsgraph, self.job)
        elif self.is_preview or self.native:
            cycles.render(self, depsgraph)

    def render_frame_finish(self):
        cycles.render_frame_finish(self)

    def update_render_passes(self, scene, view_layer):
        cycles.register_passes(self, scene, view_layer)

    def draw(self, context, depsgraph):
        def draw_cycles():
            cycles.draw(self, depsgraph, context.space_data)

        if self.shown is None:
            draw_cycles()
        else:
            self.shown.draw(context.space_data, draw_cycles)

    # Everything else is Cycles

    def bake(self, depsgraph, obj, pass_type, pass_filter, width, height):
        cycles.bake(self, depsgraph, obj, pass_type, pass_filter, width, height)

    def view_update(self, context, depsgraph):
        if not self.session:
            cycles.create(self, context.blend_data, context.region, context.space_data, context.region_data)
        cycles.reset(self, context.blend_data, depsgraph)
        cycles.sync(self, depsgraph, context.blend_data)

    def view_draw(self, context, depsgraph):
        cycles.view_draw(self, depsgraph, context.region, context.space_data, context.region_data)

    def update_script_node(self, node):
        from cycles import osl

        osl.update_script_node(node, self.report)

    def update_custom_camera(self, camera):
        from cycles import osl

        osl.update_custom_camera_shader(camera, self.report)


def register():
    bpy.utils.register_class(SpectralTilesRender)


def unregister():
    bpy.utils.unregister_class(SpectralTilesRender)
