# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel in the render properties, beside Cycles' own sampling settings."""

import textwrap

import bpy
from cycles.ui import CyclesButtonsPanel

from ..blender.refusal import Refused
from ..drivers.frame import pattern_tile
from ..plan.sample_plan import memory
from . import forecast, pattern_icons, pattern_making
from .presets import SPECTRAL_TILES_PT_presets


class SPECTRAL_TILES_PT_sampling(CyclesButtonsPanel, bpy.types.Panel):
    bl_label = "Spectral Tiles"
    bl_parent_id = "CYCLES_RENDER_PT_sampling"
    bl_options = {"DEFAULT_CLOSED"}

    def draw_header(self, context):
        self.layout.prop(context.scene.spectral_tiles, "enabled", text="")

    def draw(self, context):
        scene, layer, layout = context.scene, context.view_layer, self.layout
        layout.active = scene.spectral_tiles.enabled
        if text := forecast.sentence(scene, layer):
            _say(layout, context, text, "NONE")
        if how := forecast.chosen(scene, layer):
            for message in how.refusals:
                _say(layout, context, message, "ERROR")
            for message in how.differences:
                _say(layout, context, message, "INFO")
        layout.operator("spectral_tiles.compare", icon="MOD_INSTANCE")


class SPECTRAL_TILES_PT_advanced(CyclesButtonsPanel, bpy.types.Panel):
    bl_label = "Advanced"
    bl_parent_id = "SPECTRAL_TILES_PT_sampling"
    bl_options = {"DEFAULT_CLOSED"}

    def draw_header_preset(self, context):
        SPECTRAL_TILES_PT_presets.draw_panel_header(self.layout)

    def draw(self, context):
        layout, settings = self.layout, context.scene.spectral_tiles
        layout.active = settings.enabled
        layout.use_property_split = True
        layout.use_property_decorate = False
        layout.prop(settings, "method")
        if settings.method == "SUB_FRAMES":
            layout.prop(settings, "sub_frames")
        layout.prop(settings, "distribution")
        layout.prop(settings, "noise_reduction")
        row = layout.row(align=True)
        row.prop(settings, "pattern")
        row.operator("spectral_tiles.generate_pattern", text="", icon="ADD")
        _draw_making(layout)
        if settings.pattern == "FILE":
            layout.prop(settings, "pattern_path")
        _draw_pattern(layout, context)
        layout.prop(settings, "filter")
        if settings.filter != "AS_CYCLES":
            layout.prop(settings, "filter_width")
        if settings.filter == "MITCHELL_NETRAVALI":
            layout.prop(settings, "filter_b")
            layout.prop(settings, "filter_c")


def _draw_making(layout):
    """The pattern that is being generated."""
    if pattern_making.job is not None:
        row = layout.row(align=True)
        row.progress(factor=pattern_making.job.fraction, text=f"Generating Pattern {pattern_making.job.fraction:.0%}")
        row.operator("spectral_tiles.cancel_pattern", text="", icon="X")


def _draw_pattern(layout, context):
    """Picture of the pattern and its spectrum, and how well the last render could follow it."""
    scene, use = context.scene, forecast.scene_use(context.view_layer)
    if use is None:
        return
    try:
        tile = pattern_tile(scene, use.dims)
    except Refused:
        return  # the panel above says why
    if tile is None:
        return
    row = layout.row()
    for icon, name in zip(pattern_icons.icons(tile), (f"{tile.dims[0]}, {tile.size} px", "Spectrum"), strict=True):
        column = row.column()
        column.template_icon(icon, scale=6.0)
        line = column.row()
        line.alignment = "CENTER"
        line.label(text=name)
    plan = memory.latest()
    if plan is not None and plan.miss:
        _say(layout, context, f"Last render missed the pattern by: {plan.miss}", "BLANK1")


def _say(layout, context, text, icon):
    """A label that breaks into lines where the panel ends."""
    width = context.region.width / context.preferences.system.ui_scale
    column = layout.column(align=True)
    for line in textwrap.wrap(text, max(16, int((width - 64) / 6))):
        column.label(text=line, icon=icon)
        icon = "NONE" if icon == "NONE" else "BLANK1"


_CLASSES = (SPECTRAL_TILES_PT_sampling, SPECTRAL_TILES_PT_advanced)


def register():
    for panel in _CLASSES:
        bpy.utils.register_class(panel)


def unregister():
    for panel in reversed(_CLASSES):
        bpy.utils.unregister_class(panel)
