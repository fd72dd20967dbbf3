# SPDX-License-Identifier: GPL-3.0-or-later
"""Presets of the advanced settings, kept as Blender keeps all presets; `preset_files/` come with the extension."""

import os

import bpy
from bl_operators.presets import AddPresetBase
from bl_ui.utils import PresetPanel

from ..settings import SpectralTilesSettings

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
    preset_values = [f"settings.{name}" for name in SpectralTilesSettings.__annotations__ if name != "enabled"]


_register_classes, _unregister_classes = bpy.utils.register_classes_factory(
    (SPECTRAL_TILES_PT_presets, SPECTRAL_TILES_OT_preset_add)
)


def register():
    bpy.utils.register_preset_path(_FOLDER)
    _register_classes()


def unregister():
    _unregister_classes()
    bpy.utils.unregister_preset_path(_FOLDER)
