# SPDX-License-Identifier: GPL-3.0-or-later
"""What a person touches: panel, presets, operators, the command line."""

from . import command_line, forecast, panel, pattern_icons, pattern_making, presets, slot_comparison

__all__ = ["command_line", "comparison", "forecast", "panel", "pattern_icons", "pattern_making", "picture_files"]

#: Those that Blender is to know, in order.
REGISTERED = (forecast, pattern_icons, presets, pattern_making, slot_comparison, panel, command_line)
