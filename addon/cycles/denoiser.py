# SPDX-License-Identifier: GPL-3.0-or-later
"""Cycles' own denoiser, run on pixels that are in order.

Cycles must not denoise while it renders, for it sees the pixels out of order then.  Its file denoiser does the same
afterwards, with the scene's denoiser, guiding passes, prefilter and quality (`session/denoising.cpp` of Cycles).
"""

import os
import tempfile
import time

import _cycles
import bpy
import numpy as np

from ..blender import openimageio
from ..blender.refusal import Refused
from .passes import ALBEDO, NOISY, NORMAL

# Sides of two squares that tell how long pictures take: what is the same for both is not the pixels'.
_TRIED = 64, 160

#: What it raises where it cannot do its work.
FAILURES = Refused, OSError, MemoryError

# What the square error of guides may be that need no prefilter, or which part of that of the light.  In 21 pictures of
# eight files the denoised error was 1.02 times that with the accurate prefilter then, at most 1.13, which takes two
# thirds of the denoiser's time; where guides are noisier, out of focus say, it was up to 4.3 times that.
_CLEAN, _CLEAN_PART = 2e-4, 0.1

# What the file denoiser looks for.  Motion vectors only serve sequences of frames.
_CHANNELS = [
    *(f"Image.Combined.{c}" for c in "RGB"),
    *(f"Image.{NORMAL}.{c}" for c in "XYZ"),
    *(f"Image.{ALBEDO}.{c}" for c in "RGB"),
    *(f"Image.Vector.{c}" for c in "XYZW"),
]


def wanted(scene, layer):
    """Whether the user asked for this view layer to be denoised."""
    return scene.cycles.use_denoising and layer.cycles.use_denoising


def check(scene, layer, use):
    """Raise `Refused` if denoising is wanted and cannot be done here, given the `SceneUse`."""
    if wanted(scene, layer):
        # Cycles would read a catcher's shadow and alpha from the Combined that it leaves empty for the noisy one.
        if use.shadow_catcher:
            raise Refused("A picture with a shadow catcher can only be denoised by Cycles itself")
        try:
            openimageio.load()
        except Refused as refused:
            raise Refused(
                "This build of Blender has no OpenImageIO module, which denoising needs; switch Denoise off"
            ) from refused


def add_guides(engine, layer_name):
    """Add the passes that guide the denoiser to a view layer's result."""
    engine.add_pass(ALBEDO, 3, "RGB", layer=layer_name)
    engine.add_pass(NORMAL, 3, "XYZ", layer=layer_name)


def prefilter(scene, guides, light):
    """The prefilter of the guides that a picture needs: none if the user's is accurate and they are clean without.

    Parameters
    ----------
    scene : bpy.types.Scene
    guides, light : float
        Mean square errors of the guides and of the light.

    Returns
    -------
    str
        As `scene.cycles.denoising_prefilter`.
    """
    wanted = scene.cycles.denoising_prefilter
    return "NONE" if wanted == "ACCURATE" and guides < max(_CLEAN, _CLEAN_PART * light) else wanted


def denoise(scene, layer, region, passes):
    """Denoise what Cycles would denoise.

    Parameters
    ----------
    scene : bpy.types.Scene
    layer : bpy.types.ViewLayer
        The *original* ones; the evaluated ones may be gone after a render.
    region : Region
    passes : dict
        As of `passes.read`, in order, with the noisy and the guiding passes.

    Returns
    -------
    dict
        The denoised passes.

    Raises
    ------
    Refused, OSError, MemoryError
        The denoiser fails (`FAILURES`).
    """
    denoised = {}
    for view in (view for name, view in passes if name == NOISY):
        clean = passes[NOISY, view].copy()
        clean[:, :3] = _denoise(scene, layer, region.size, clean[:, :3], passes[NORMAL, view], passes[ALBEDO, view])
        denoised["Combined", view] = clean
    return denoised


def seconds(scene, layer, pixels):
    """About how long it takes to denoise a view layer of so many pixels, as two small pictures tell.

    Parameters as of `denoise`.
    """
    found = []
    for side in _TRIED:
        grey = np.full((side**2, 3), 0.5, np.float32)
        begun = time.perf_counter()
        _denoise(scene, layer, (side, side), grey, grey, grey)
        found.append(time.perf_counter() - begun)
    small, large = (side**2 for side in _TRIED)
    one = found[1] + max(found[1] - found[0], 0.0) * max(pixels - large, 0) / (large - small)
    views = sum(view.use for view in scene.render.views) if scene.render.use_multiview else 1
    return one * views


def _denoise(scene, layer, size, color, normal, albedo):
    oiio = openimageio.load()
    with tempfile.TemporaryDirectory(prefix="spectral_tiles_", dir=bpy.app.tempdir) as folder:
        path = os.path.join(folder, "denoise.exr")
        # Written by a function of its own: the copy of all channels is gone while the denoiser takes its memory.
        _write(path, size, np.concatenate([color, normal, albedo, np.zeros((len(color), 4), np.float32)], axis=1))
        try:
            _cycles.denoise(
                bpy.context.preferences.as_pointer(),
                scene.as_pointer(),
                layer.as_pointer(),
                input=[path],
                output=[path],
            )
        except ValueError as error:
            raise Refused(str(error)) from error
        image = oiio.ImageBuf(path)
        red, green, blue = (image.spec().channelindex(name) for name in _CHANNELS[:3])
        return image.get_pixels(oiio.FLOAT)[..., [red, green, blue]].reshape(-1, 3)


def _write(path, size, pixels):
    # Rows stay bottom up, as Cycles' own denoising sees them: the denoiser is not quite symmetric.
    image = openimageio.load().ImageBuf(pixels.reshape(*size[::-1], len(_CHANNELS)))
    spec = image.specmod()
    spec.channelnames = _CHANNELS
    spec.attribute("compression", "none")
    spec.attribute("cycles.Image.samples", "1")
    if not image.write(path):
        raise Refused(f"{path} cannot be written: {image.geterror()}")
