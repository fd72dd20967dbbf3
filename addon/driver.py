# SPDX-License-Identifier: GPL-3.0-or-later
"""What the drivers have in common, and where GATHER can run."""

import bpy
from cycles import engine as cycles

from . import openimageio
from .failure import Refused
from .reconstruction import Filter


def check_build():
    """Raise `Refused` if this build of Blender cannot run the GATHER driver."""
    if not cycles.with_osl():
        raise Refused("This build of Blender has no Open Shading Language, which the driver Gather needs")
    openimageio.load()


def check_device(scene):
    """Raise `Refused` if the GATHER driver cannot run on the device that the scene is rendered on."""
    preferences = bpy.context.preferences.addons["cycles"].preferences
    kind = preferences.get_compute_device_type()
    if scene.cycles.device == "GPU" and kind not in {"NONE", "OPTIX"} and preferences.has_active_device():
        raise Refused(
            f"Cycles has no Open Shading Language on {kind} devices, which Spectral Tiles needs; "
            "set Device to CPU or use OptiX, or set Driver to Sub-renders or In Place"
        )


def seed_and_frame(scene):
    """Seed of the scene's pattern, and the frame that the pattern changes with; None if it does not."""
    settings = scene.spectral_tiles
    frame = scene.frame_current if settings.animated_seed else None
    return settings.seed + (frame or 0), frame


def set_samples(settings, samples):
    """Make Cycles take exactly this many samples in every pixel of every layer."""
    settings.samples = samples
    settings.use_adaptive_sampling = False
    settings.use_layer_samples = "IGNORE"
    settings.time_limit = 0.0


def takes_out_noise(settings):
    """Whether noise that is known is to be taken out of pictures."""
    # Whoever chose a tile wants to see what it does.
    return settings.control_variates and settings.tile == "AUTO"


def chosen_filter(settings):
    """What samples are spread by, or None if Cycles' own filter is wanted."""
    if settings.filter == "AS_CYCLES":
        return None
    return Filter(settings.filter, settings.filter_width, settings.filter_b, settings.filter_c)


def why_not_gather(scene):
    """Why the GATHER driver cannot run in this build of Blender and on the scene's device; None if it can."""
    try:
        check_build()
        check_device(scene)
    except Refused as refused:
        return str(refused)
    return None


def may_be_subrender(scene):
    """Whether the scene chose sub-renders, or leaves the choice to us and the GATHER driver does not run here."""
    if scene.spectral_tiles.driver != "AUTO":
        return scene.spectral_tiles.driver == "SUBRENDER"
    return why_not_gather(scene) is not None
