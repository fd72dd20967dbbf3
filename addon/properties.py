# SPDX-License-Identifier: GPL-3.0-or-later
"""What the user can set, `scene.spectral_tiles`."""

import bpy
from bpy.props import EnumProperty, IntProperty, PointerProperty, StringProperty

from . import library


class SpectralTilesSettings(bpy.types.PropertyGroup):
    samples: IntProperty(
        name="Samples",
        description="Samples a pixel",
        default=1,
        min=1,
        max=4096,
        soft_max=64,
    )
    tile: EnumProperty(
        name="Tile",
        description="Pattern of sample parameters that is repeated over the image",
        items=library.ITEMS,
    )
    tile_path: StringProperty(
        name="Tile File",
        description="Tile made by the generator (.npz), or an image with one channel a dimension (.exr)",
        subtype="FILE_PATH",
    )
    seed: IntProperty(
        name="Seed",
        description="Another seed gives another pattern of the same quality",
        default=0,
        min=0,
        max=2**31 - 1,
    )
    driver: EnumProperty(
        name="Driver",
        description="How Cycles is made to take the samples",
        items=(
            ("AUTO", "Automatic", "Use the fastest driver that can render this scene here"),
            ("GATHER", "Gather", "One render whose pixels are put in order afterwards; needs Open Shading Language"),
            ("SUBRENDER", "Sub-renders", "One small render for each cell of the tile (not available yet)"),
        ),
        default="AUTO",
    )


def register():
    bpy.utils.register_class(SpectralTilesSettings)
    bpy.types.Scene.spectral_tiles = PointerProperty(
        type=SpectralTilesSettings,
        name="Spectral Tiles",
        description="Settings of the Cycles Spectral Tiles render engine",
    )


def unregister():
    del bpy.types.Scene.spectral_tiles
    bpy.utils.unregister_class(SpectralTilesSettings)
