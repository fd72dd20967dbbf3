# SPDX-License-Identifier: GPL-3.0-or-later
"""Presets of the panel, kept as Blender keeps all presets; those in `presets/` come with the extension."""

import os

import bpy
from bl_operators.presets import AddPresetBase
from bl_ui.utils import PresetPanel

from .engine import SpectralTilesRender

_SUBDIR = "spectral_tiles"
_FOLDER = os.path.dirname(__file__)


class SPECTRAL_TILES_PT_presets(PresetPanel, bpy.types.Panel):
    bl_label = "Spectral Tiles Presets"
    preset_subdir = _SUBDIR
    preset_operator = "script.execute_preset"
    preset_add_operator = "spectral_tiles.preset_add"
    COMPAT_ENGINES = {SpectralTilesRender.bl_idname}


class SPECTRAL_TILES_OT_preset_add(AddPresetBase, bpy.types.Operator):
    bl_idname = "spectral_tiles.preset_add"
    bl_label = "Add Spectral Tiles Preset"
    bl_description = "Add or remove a preset of samples, tile, control variates, filter, adaptive sampling and driver"
    preset_menu = "SPECTRAL_TILES_PT_presets"
    preset_subdir = _SUBDIR
    preset_defines = ["settings = bpy.context.scene.spectral_tiles"]
    preset_values = [
        "settings.samples",
        "settings.tile",
        "settings.tile_path",
        "settings.animated_seed",
        "settings.control_variates",
        "settings.filter",
        "settings.filter_width",
        "settings.filter_b",
        "settings.filter_c",
        "settings.adaptive",
        "settings.adaptive_threshold",
        "settings.driver",
    ]


_CLASSES = (SPECTRAL_TILES_PT_presets, SPECTRAL_TILES_OT_preset_add)


def register():
    bpy.utils.register_preset_path(_FOLDER)
    for cls in _CLASSES:
        bpy.utils.register_class(cls)


def unregister():
    for cls in reversed(_CLASSES):
        bpy.utils.unregister_class(cls)
    bpy.utils.unregister_preset_path(_FOLDER)
