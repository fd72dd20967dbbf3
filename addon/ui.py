# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel in the render properties, and Cycles' own panels under our engine."""

import bpy
from cycles.ui import CYCLES_RENDER_PT_sampling_advanced_sample_subset as _CyclesSampleSubset
from cycles.ui import CYCLES_RENDER_PT_sampling_render_denoise as _CyclesDenoising

from .engine import SpectralTilesRender

_ENGINE = SpectralTilesRender.bl_idname

# Panels of Cycles whose settings this engine decides itself.
_REPLACED = {
    "CYCLES_RENDER_PT_sampling_render",
    "CYCLES_RENDER_PT_sampling_render_denoise",
    "CYCLES_RENDER_PT_sampling_advanced",
    "CYCLES_RENDER_PT_sampling_advanced_sample_subset",
}


class SPECTRAL_TILES_PT_sampling(bpy.types.Panel):
    bl_label = "Spectral Tiles"
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "render"
    COMPAT_ENGINES = {_ENGINE}

    @classmethod
    def poll(cls, context):
        return context.engine in cls.COMPAT_ENGINES

    def draw(self, context):
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        settings = context.scene.spectral_tiles
        layout.prop(settings, "samples")
        layout.prop(settings, "tile")
        if settings.tile == "FILE":
            layout.prop(settings, "tile_path")
        layout.prop(settings, "filter")
        if settings.filter != "AS_CYCLES":
            layout.prop(settings, "filter_width")
        if settings.filter == "MITCHELL_NETRAVALI":
            layout.prop(settings, "filter_b")
            layout.prop(settings, "filter_c")
        row = layout.row(align=True)
        row.prop(settings, "seed")
        row.prop(context.scene.cycles, "use_animated_seed", text="", icon="TIME")
        layout.prop(settings, "driver")


class SPECTRAL_TILES_PT_denoising(bpy.types.Panel):
    bl_label = _CyclesDenoising.bl_label
    bl_parent_id = "SPECTRAL_TILES_PT_sampling"
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "render"
    bl_options = {"DEFAULT_CLOSED"}
    COMPAT_ENGINES = {_ENGINE}

    draw_header = _CyclesDenoising.draw_header
    draw = _CyclesDenoising.draw


class SPECTRAL_TILES_PT_sample_subset(bpy.types.Panel):
    bl_label = _CyclesSampleSubset.bl_label
    bl_parent_id = "SPECTRAL_TILES_PT_sampling"
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "render"
    bl_options = {"DEFAULT_CLOSED"}
    COMPAT_ENGINES = {_ENGINE}

    draw_header = _CyclesSampleSubset.draw_header
    draw = _CyclesSampleSubset.draw


_CLASSES = (SPECTRAL_TILES_PT_sampling, SPECTRAL_TILES_PT_denoising, SPECTRAL_TILES_PT_sample_subset)


def _cycles_panels(base=bpy.types.Panel):
    """All panels that Cycles shows, and so should this engine, less those that it replaces."""
    for panel in base.__subclasses__():
        if "CYCLES" in getattr(panel, "COMPAT_ENGINES", ()) and panel.__name__ not in _REPLACED:
            yield panel
        yield from _cycles_panels(panel)


def register():
    for panel in _CLASSES:
        bpy.utils.register_class(panel)
    for panel in _cycles_panels():
        # Cycles' panels share one set, also with the replaced ones, so each gets a set of its own.
        panel.COMPAT_ENGINES = panel.COMPAT_ENGINES | {_ENGINE}


def unregister():
    for panel in _cycles_panels():
        panel.COMPAT_ENGINES = panel.COMPAT_ENGINES - {_ENGINE}
    for panel in reversed(_CLASSES):
        bpy.utils.unregister_class(panel)
