# SPDX-License-Identifier: GPL-3.0-or-later
"""What the user can set, `scene.spectral_tiles`."""

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty, PointerProperty, StringProperty

from . import library, reconstruction

_FILTERS = (
    ("AS_CYCLES", "As Cycles", "Cycles' own pixel filter, in one render; the best choice for narrow filters"),
    ("BOX", "Box", "Mean over a square"),
    ("TENT", "Tent", "Weights fall linearly to zero"),
    ("GAUSSIAN", "Gaussian", "Weights fall like a bell, over six standard deviations"),
    ("BLACKMAN_HARRIS", "Blackman-Harris", "A window close to a Gaussian that ends smoothly"),
    ("MITCHELL_NETRAVALI", "Mitchell-Netravali", "Cubic between blur and ringing, set by B and C"),
    ("LANCZOS", "Lanczos", "Windowed sinc, the sharpest; rings at edges"),
)


# Blender 5.2 makes no library overrides of scenes; whatever it lets one override, these settings may be.
_OVERRIDABLE = {"LIBRARY_OVERRIDABLE"}


def _set_customary_width(settings, _context):
    settings.filter_width = reconstruction.CUSTOMARY_WIDTHS.get(settings.filter, settings.filter_width)


class SpectralTilesSettings(bpy.types.PropertyGroup):
    samples: IntProperty(
        name="Samples",
        description="Samples a pixel",
        default=1,
        min=1,
        max=4096,
        soft_max=64,
        override=_OVERRIDABLE,
    )
    tile: EnumProperty(
        name="Tile",
        description="Pattern of sample parameters that is repeated over the image",
        items=library.ITEMS,
        options=set(),
        override=_OVERRIDABLE,
    )
    tile_path: StringProperty(
        name="Tile File",
        description="Tile made by the generator (.npz), or an image with one channel a dimension (.exr)",
        subtype="FILE_PATH",
        options={"PATH_SUPPORTS_BLEND_RELATIVE"},
        override=_OVERRIDABLE,
    )
    seed: IntProperty(
        name="Seed",
        description="Another seed gives another pattern of the same quality",
        default=0,
        min=0,
        max=2**31 - 1,
        override=_OVERRIDABLE,
    )
    animated_seed: BoolProperty(
        name="Animated Seed",
        description="Another pattern in every frame of an animation; those of consecutive frames complement each other",
        default=True,
        override=_OVERRIDABLE,
    )
    control_variates: BoolProperty(
        name="Control Variates",
        description="Subtract the noise that the random numbers explain, up to 16 samples a pixel; adds no bias",
        default=True,
        override=_OVERRIDABLE,
    )
    filter: EnumProperty(
        name="Filter",
        description="How samples become pixels; any but Cycles' own needs one render for each sample a pixel",
        items=_FILTERS,
        default="AS_CYCLES",
        update=_set_customary_width,
        options=set(),
        override=_OVERRIDABLE,
    )
    filter_width: FloatProperty(
        name="Width",
        description="Full width of the filter, in pixels",
        default=2.0,
        min=1.0,
        max=16.0,
        subtype="PIXEL",
        override=_OVERRIDABLE,
    )
    filter_b: FloatProperty(
        name="B",
        description="Blur of the Mitchell-Netravali filter",
        default=1 / 3,
        min=0,
        max=1,
        override=_OVERRIDABLE,
    )
    filter_c: FloatProperty(
        name="C",
        description="Ringing of the Mitchell-Netravali filter",
        default=1 / 3,
        min=0,
        max=1,
        override=_OVERRIDABLE,
    )
    adaptive: EnumProperty(
        name="Adaptive",
        description="Where a picture needs more samples than elsewhere",
        items=(
            ("OFF", "Off", "The same number of samples everywhere"),
            ("BUDGET", "Budget", "Spread the samples over the picture so that its error is smallest at the same cost"),
            ("THRESHOLD", "Threshold", "Five times the samples where neighbouring pixels contrast"),
        ),
        default="OFF",
        options=set(),
        override=_OVERRIDABLE,
    )
    adaptive_threshold: FloatProperty(
        name="Threshold",
        description="Contrast that asks for more samples, times 0.4 in red, 0.3 in green, 0.6 in blue (Mitchell 1987)",
        default=1.0,
        min=0.0,
        soft_max=2.0,
        override=_OVERRIDABLE,
    )
    driver: EnumProperty(
        name="Driver",
        description="How Cycles is made to take the samples",
        items=(
            ("AUTO", "Automatic", "Use the fastest driver that can render this scene here"),
            ("GATHER", "Gather", "One render whose pixels are put in order afterwards; needs Open Shading Language"),
            (
                "IN_PLACE",
                "In Place",
                "Cycles' own render, of which known noise is taken out; adds least time, for any camera and device",
            ),
            (
                "SUBRENDER",
                "Sub-renders",
                "Hundreds of small renders at exact moments; blurs animated lights too, but takes longer",
            ),
        ),
        default="AUTO",
        options=set(),
        override=_OVERRIDABLE,
    )


def register():
    bpy.utils.register_class(SpectralTilesSettings)
    bpy.types.Scene.spectral_tiles = PointerProperty(
        type=SpectralTilesSettings,
        name="Spectral Tiles",
        description="Settings of the Cycles Spectral Tiles render engine",
        override=_OVERRIDABLE,
    )


def unregister():
    del bpy.types.Scene.spectral_tiles
    bpy.utils.unregister_class(SpectralTilesSettings)
