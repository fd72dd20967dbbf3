# SPDX-License-Identifier: GPL-3.0-or-later
"""The description of a frame: all that the settings and the evaluated scene say about how to render a view layer."""

from dataclasses import dataclass

import bpy

from ..blender.region import Region
from ..cycles import denoiser, passes
from ..cycles.sampling import Sampling
from ..cycles.scene_analysis import SceneUse, scene_use
from ..picture.reconstruction import Filter
from ..plan import patterns


@dataclass(frozen=True)
class Frame:
    """A view layer at a frame, as it is to be rendered.

    Attributes
    ----------
    number : int
        Of the frame.
    region : Region
    use : SceneUse
        What its noise comes from.
    sampling : Sampling
        Of Cycles.
    denoise : bool
    pattern : str
        Name of the pattern, as `scene.spectral_tiles.pattern` has it.
    tile : generator.Tile or None
        The pattern; None where Cycles' own samples are arranged, or stay as they are.
    filter : Filter or None
        What samples are spread by; None leaves that to Cycles.
    sub_frames : int
        Moments of the shutter that are rendered one by one; 1 where the scene is rendered at once.
    aovs : dict of str to str
        Types, COLOR or VALUE, of the view layer's AOVs by name.
    """

    number: int
    region: Region
    use: SceneUse
    sampling: Sampling
    denoise: bool
    pattern: str
    tile: object
    filter: Filter | None
    sub_frames: int
    aovs: dict

    @classmethod
    def of_depsgraph(cls, depsgraph):
        """Describe what Blender wants rendered; raises `Refused` if the pattern cannot be used."""
        scene, layer = depsgraph.scene_eval, depsgraph.view_layer_eval
        settings = scene.spectral_tiles
        use = scene_use(depsgraph)
        sampling = Sampling.of_layer(scene, layer)
        return cls(
            number=scene.frame_current,
            region=Region.of_render(scene.render),
            use=use,
            sampling=sampling,
            denoise=denoiser.wanted(scene, layer),
            pattern=settings.pattern,
            tile=pattern_tile(scene, use.dims),
            filter=None
            if settings.filter == "AS_CYCLES"
            else Filter(settings.filter, settings.filter_width, settings.filter_b, settings.filter_c),
            sub_frames=moments(scene, layer),
            aovs=passes.aov_types(layer),
        )


def moments(scene, layer):
    """Moments of the shutter that a view layer is rendered at one by one; 1 if it is rendered at once."""
    settings = scene.spectral_tiles
    moves = scene.render.use_motion_blur and layer.use_motion_blur
    return settings.sub_frames if settings.method == "SUB_FRAMES" and moves else 1


def pattern_tile(scene, dims=patterns.PROFILES["full"]):
    """The tile of a scene's pattern, as `patterns.tile`."""
    settings = scene.spectral_tiles
    path = settings.pattern_path and bpy.path.abspath(settings.pattern_path, library=scene.library)
    return patterns.tile(settings.pattern, path, dims)
