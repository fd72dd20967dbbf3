# SPDX-License-Identifier: GPL-3.0-or-later
"""What stands in the way of a method; each check raises `Refused` with the reason and the way out."""

import bpy
from cycles import engine as cycles

from ..blender import openimageio
from ..blender.refusal import Refused
from ..cycles import denoiser as cycles_denoiser
from .frame import pattern_tile


def osl_build(scene, layer):
    """This build of Blender must have Open Shading Language, and OpenImageIO for the plan's image."""
    if not cycles.with_osl():
        raise Refused("This build of Blender has no Open Shading Language, which the method Gather needs")
    openimageio.load()


def osl_device(scene, layer):
    """The scene's device must have Open Shading Language."""
    preferences = bpy.context.preferences.addons["cycles"].preferences
    kind = preferences.get_compute_device_type()
    if scene.cycles.device == "GPU" and kind not in {"NONE", "OPTIX"} and preferences.has_active_device():
        raise Refused(
            f"Cycles has no Open Shading Language on {kind} devices, which the method Gather needs; "
            "set Device to CPU or use OptiX, or set Method to In Place"
        )


def pattern(scene, layer):
    """The scene's pattern must be usable."""
    pattern_tile(scene)


def denoiser(scene, layer):
    """Denoising after assembly needs OpenImageIO."""
    cycles_denoiser.check(scene, layer)


def messages(checks, scene, layer):
    """What checks say against a view layer: one message a reason."""
    found = []
    for check in checks:
        try:
            check(scene, layer)
        except Refused as refused:
            found.append(str(refused))
    return found
