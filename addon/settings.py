# SPDX-License-Identifier: GPL-3.0-or-later
"""What the user can set, `scene.spectral_tiles`; everything else is Cycles' own settings."""

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty, PointerProperty, StringProperty

from .picture import reconstruction
from .plan import patterns

_METHODS = (
    ("AUTO", "Automatic", "Whatever suits this frame best, on any camera and device"),
    ("IN_PLACE", "In Place", "Cycles' own samples, each in its own pixel"),
    (
        "GATHER",
        "Gather",
        "Samples that are arranged or follow a pattern: one render whose pixels are put in order afterwards. "
        "Needs Open Shading Language",
    ),
    (
        "SUB_FRAMES",
        "Sub-Frames",
        "Render many moments of the shutter one by one, so that everything that is animated blurs: lights, materials, "
        "visibility, simulations",
    ),
)

_DISTRIBUTIONS = (
    ("BY_NOISE", "By Noise", "More samples where the picture is noisy, fewer where it is clean already"),
    ("EVEN", "Even", "The same number of samples everywhere"),
)

_FILTERS = (
    ("AS_CYCLES", "As Cycles", "Cycles' own pixel filter; the best choice for narrow filters, and with a denoiser"),
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
    enabled: BoolProperty(
        name="Spectral Tiles",
        description="Take samples where the picture needs them, and put the result together, in final renders",
        default=False,
        override=_OVERRIDABLE,
    )
    method: EnumProperty(
        name="Method",
        description="How Cycles is made to take the samples",
        items=_METHODS,
        default="AUTO",
        options=set(),
        override=_OVERRIDABLE,
    )
    distribution: EnumProperty(
        name="Distribution",
        description="How samples are spread over the picture",
        items=_DISTRIBUTIONS,
        default="BY_NOISE",
        options=set(),
        override=_OVERRIDABLE,
    )
    pattern: EnumProperty(
        name="Pattern",
        description="Pattern of sample parameters that is repeated over the image",
        items=patterns.ITEMS,
        options=set(),
        override=_OVERRIDABLE,
    )
    pattern_path: StringProperty(
        name="Pattern File",
        description="Tile made by the generator (.npz), or an image with one channel a dimension (.exr)",
        subtype="FILE_PATH",
        options={"PATH_SUPPORTS_BLEND_RELATIVE"},
        override=_OVERRIDABLE,
    )
    filter: EnumProperty(
        name="Filter",
        description="How samples become pixels; any but Cycles' own spreads each sample over all pixels around it",
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
    sub_frames: IntProperty(
        name="Sub-Frames",
        description="Moments of the shutter that are rendered one by one",
        default=16,
        min=8,
        max=256,
        override=_OVERRIDABLE,
    )


def register():
    bpy.utils.register_class(SpectralTilesSettings)
    bpy.types.Scene.spectral_tiles = PointerProperty(
        type=SpectralTilesSettings,
        name="Spectral Tiles",
        description="Settings of the Spectral Tiles extension for Cycles",
        override=_OVERRIDABLE,
    )


def unregister():
    del bpy.types.Scene.spectral_tiles
    bpy.utils.unregister_class(SpectralTilesSettings)
