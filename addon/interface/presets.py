# SPDX-License-Identifier: GPL-3.0-or-later
"""Presets of the advanced settings, kept as Blender keeps all presets; `preset_files/` come with the extension."""

import os

import bpy
from bl_operators.presets import AddPresetBase
from bl_ui.utils import PresetPanel

_SUBDIR = "spectral_tiles"
_FOLDER = os.path.join(os.path.dirname(__file__), "preset_files")


class SPECTRAL_TILES_PT_presets(PresetPanel, bpy.types.Panel):
    bl_label = "Spectral Tiles Presets"
    preset_subdir = _SUBDIR
    preset_operator = "script.execute_preset"
    preset_add_operator = "spectral_tiles.preset_add"
    COMPAT_ENGINES = {"CYCLES"}


class SPECTRAL_TILES_OT_preset_add(AddPresetBase, bpy.types.Operator):
    bl_idname = "spectral_tiles.preset_add"
    bl_label = "Add Spectral Tiles Preset"
    bl_description = "Add or remove a preset of the advanced settings"
    preset_menu = "SPECTRAL_TILES_PT_presets"
    preset_subdir = _SUBDIR
    preset_defines = ["settings = bpy.context.scene.spectral_tiles"]
    preset_values = [
        "settings.method",
        "settings.sub_frames",
        "settings.distribution",
        "settings.noise_reduction",
        "settings.pattern",
        "settings.pattern_path",
        "settings.filter",
        "settings.filter_width",
        "settings.filter_b",
        "settings.filter_c",
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
