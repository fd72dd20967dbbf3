# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel Render Properties > Sampling > Spectral Tiles: for artists, and closed in it what is rarely wanted."""

import blf
import bpy
from cycles.ui import CyclesButtonsPanel

from ..blender.refusal import Refused
from ..drivers.frame import pattern_tile
from . import forecast, pattern_icons, pattern_making
from .presets import SPECTRAL_TILES_PT_presets

# Side of a pattern's picture, in Blender's units of a line.
_PICTURE = 6.0

# Width of an icon with the panel's margins, in pixels of a window that is not scaled.
_MARGIN = 60


class SPECTRAL_TILES_PT_sampling(CyclesButtonsPanel, bpy.types.Panel):
    bl_label = "Spectral Tiles"
    bl_parent_id = "CYCLES_RENDER_PT_sampling"
    bl_options = {"DEFAULT_CLOSED"}

    def draw_header(self, context):
        self.layout.prop(context.scene.spectral_tiles, "enabled", text="")

    def draw(self, context):
        scene, layer = context.scene, context.view_layer
        column = self.layout.column()
        column.active = scene.spectral_tiles.enabled
        how = forecast.chosen(scene, layer)
        if how and how.refusals:
            for message in how.refusals:
                _say(column, context, message, "ERROR")
        elif how:
            _say(column, context, forecast.sentence(scene, layer), "NONE")
            for message in how.differences:
                _say(column, context, message, "INFO")
        self.layout.operator("spectral_tiles.compare")


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
        row = layout.row()
        row.active = settings.method in {"AUTO", "IN_PLACE"}
        row.prop(settings, "distribution")
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
    """Pictures of the pattern and its spectrum."""
    use = forecast.scene_use(context.view_layer)
    if use is None:
        return
    try:
        tile = pattern_tile(context.scene, use.dims)
    except Refused:
        return  # the panel above says why
    if tile is None:
        return
    row = layout.row()
    for icon, name in zip(pattern_icons.icons(tile), (f"{tile.size} px", "Spectrum"), strict=True):
        column = row.column()
        column.template_icon(icon, scale=_PICTURE)
        line = column.row()
        line.alignment = "CENTER"
        line.label(text=name)


def _say(layout, context, text, icon):
    """A label that breaks into lines where the panel ends."""
    scale = context.preferences.system.ui_scale
    blf.size(0, context.preferences.ui_styles[0].widget.points * scale)
    column = layout.column(align=True)
    for line in _lines(text, context.region.width - _MARGIN * scale):
        column.label(text=line, icon=icon)
        icon = "NONE" if icon == "NONE" else "BLANK1"


def _lines(text, width):
    """Break a text where its lines would be wider than `width` pixels, in the font that is set."""
    lines = []
    for word in text.split():
        longer = f"{lines[-1]} {word}" if lines else word
        if lines and blf.dimensions(0, longer)[0] <= width:
            lines[-1] = longer
        else:
            lines.append(word)
    return lines


_CLASSES = (SPECTRAL_TILES_PT_sampling, SPECTRAL_TILES_PT_advanced)

register, unregister = bpy.utils.register_classes_factory(_CLASSES)
