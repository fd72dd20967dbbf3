# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel in the render properties, and Cycles' own panels under our engine."""

import textwrap

import bpy
from cycles.ui import CYCLES_RENDER_PT_sampling_advanced_sample_subset as _CyclesSampleSubset
from cycles.ui import CYCLES_RENDER_PT_sampling_render_denoise as _CyclesDenoising

from . import forecast, library, tile_making, tile_picture
from .control_variates import MOST_SAMPLES
from .engine import SpectralTilesRender
from .failure import Refused
from .plan import memory
from .preset_menu import SPECTRAL_TILES_PT_presets

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
    bl_parent_id = "CYCLES_RENDER_PT_sampling"  # where Cycles has the settings that ours replace
    COMPAT_ENGINES = {_ENGINE}

    @classmethod
    def poll(cls, context):
        return context.engine in cls.COMPAT_ENGINES

    def draw_header_preset(self, context):
        SPECTRAL_TILES_PT_presets.draw_panel_header(self.layout)

    def draw(self, context):
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        settings = context.scene.spectral_tiles
        layout.prop(settings, "samples")
        row = layout.row(align=True)
        row.prop(settings, "tile")
        row.operator("spectral_tiles.generate_tile", text="", icon="ADD")
        _draw_tile_job(layout)
        if settings.tile == "FILE":
            layout.prop(settings, "tile_path")
        _draw_tile(layout, context)
        layout.prop(settings, "adaptive")
        if settings.adaptive == "THRESHOLD":
            layout.prop(settings, "adaptive_threshold")
        layout.prop(settings, "filter")
        if settings.filter != "AS_CYCLES":
            layout.prop(settings, "filter_width")
        if settings.filter == "MITCHELL_NETRAVALI":
            layout.prop(settings, "filter_b")
            layout.prop(settings, "filter_c")
        if settings.tile == "AUTO":
            row = layout.row()
            row.active = settings.samples <= MOST_SAMPLES or settings.filter != "AS_CYCLES"
            row.prop(settings, "control_variates")
        row = layout.row(align=True)
        row.prop(settings, "seed")
        row.prop(settings, "animated_seed", text="", icon="TIME")
        layout.prop(settings, "driver")
        _draw_forecast(layout, context)
        layout.operator("spectral_tiles.compare", icon="MOD_INSTANCE")


def _draw_tile_job(layout):
    """The tile that is being generated."""
    if tile_making.job is not None:
        row = layout.row(align=True)
        row.progress(factor=tile_making.job.fraction, text=f"Generating Tile {tile_making.job.fraction:.0%}")
        row.operator("spectral_tiles.cancel_tile", text="", icon="X")


def _draw_tile(layout, context):
    """Picture of the tile and its spectrum, and how well the last render could follow it."""
    scene, use = context.scene, forecast.scene_use(context.view_layer)
    if use is None:
        return
    try:
        tile = library.tile(scene.spectral_tiles, scene.library, use.dims)
    except Refused:
        return  # the forecast says why
    if tile is None:
        return
    row = layout.row()
    for icon, name in zip(tile_picture.icons(tile), (f"{tile.dims[0]}, {tile.size} px", "Spectrum"), strict=True):
        column = row.column()
        column.template_icon(icon, scale=6.0)
        line = column.row()
        line.alignment = "CENTER"
        line.label(text=name)
    plan = memory.latest()
    if plan is not None and plan.miss:
        _say(layout, context, f"Last render missed the tile by: {plan.miss}", "BLANK1")


def _draw_forecast(layout, context):
    """What the scene makes of the settings, and what stands in the way."""
    scene, layer = context.scene, context.view_layer
    column = layout.column(align=True)
    if uses := forecast.uses(scene, layer):
        _say(column, context, uses, "LIGHT")
    refusals = forecast.refusals(scene, layer)
    for message in refusals:
        _say(column, context, message, "ERROR")
    if not refusals:
        _say(column, context, forecast.render_calls(scene, layer), "RENDER_STILL")
        _say(column, context, forecast.overhead(scene, layer), "TIME")
    for message in forecast.ignored(scene, layer):
        _say(column, context, message, "INFO")


def _say(layout, context, text, icon):
    """A label that breaks into lines where the panel ends."""
    width = context.region.width / context.preferences.system.ui_scale
    for line in textwrap.wrap(text, max(16, int((width - 64) / 6))):
        layout.label(text=line, icon=icon)
        icon = "BLANK1"


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
