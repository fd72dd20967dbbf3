# SPDX-License-Identifier: GPL-3.0-or-later
"""One frame by Cycles and by Spectral Tiles at equal samples, and how far each is from the converged picture."""

import os

import bpy
import numpy as np

from ..blender.refusal import Refused
from ..plan.patterns import atomic_file
from . import forecast, picture_files

# Whether the switch is on, and the name of the pictures.
RENDERS = {False: "cycles", True: "spectral_tiles"}

# Widths in pixels of the Gaussians through which the error is looked at; 0 is none.
SIGMAS = (0, 1, 2)

# Seeds of the reference's halves, far from those that people choose.
_REFERENCE_SEEDS = (70001, 70002)

_LUMINANCE = np.array((0.2126, 0.7152, 0.0722))  # Rec. 709, the luminance of Blender's linear RGB


def compare(scene, samples, reference_samples, folder, tell):
    """Render the current frame both ways and measure.

    Parameters
    ----------
    scene : bpy.types.Scene
        Its settings are changed: neither denoising nor adaptive sampling, so that both take the same samples.
    samples : int
        Samples a pixel of both.
    reference_samples : int
        Samples a pixel of each of the reference's two halves.
    folder : str
        Receives ``cycles`` and ``spectral_tiles`` as .exr and .png.
    tell : callable
        Is given name and samples a pixel of each of the four renders before it starts.

    Returns
    -------
    files : list of str
    errors : dict
        sigma -> mean square error of each engine's luminance, and their ratio (None where Cycles has no error).

    Raises
    ------
    Refused
        A render was refused, or a picture could not be written.
    OSError
        The folder cannot be made or written to.
    """
    _equal_terms(scene)
    for layer in scene.view_layers:
        how = forecast.chosen(scene, layer)
        for message in how.refusals if how else ():
            raise Refused(message)  # before Cycles has rendered in vain
    os.makedirs(folder, exist_ok=True)
    for name in RENDERS.values():
        for ending in (".exr", ".png"):
            atomic_file.check_writable(os.path.join(folder, name + ending))
    seed = scene.cycles.seed
    pictures, halves = {}, []
    with atomic_file.unfinished_folder(folder) as unfinished:
        for enabled, name in RENDERS.items():
            tell(name, samples)
            pictures[name] = _render(scene, enabled, samples, seed, os.path.join(unfinished, name))
        for half, half_seed in enumerate(_REFERENCE_SEEDS):
            tell("reference", reference_samples)
            stem = os.path.join(unfinished, f"reference {half}")
            halves.append(_render(scene, False, reference_samples, half_seed, stem))
            for ending in (".exr", ".png"):
                os.unlink(stem + ending)
        errors = {sigma: _errors(pictures, halves, sigma) for sigma in SIGMAS}
        return picture_files.put(unfinished, folder), errors


def _equal_terms(scene):
    cycles = scene.cycles
    cycles.use_denoising = cycles.use_adaptive_sampling = cycles.use_sample_subset = False
    cycles.time_limit = 0.0
    cycles.use_layer_samples = "IGNORE"
    # With persistent data Cycles keeps the seed of the render before.
    scene.render.use_persistent_data = False
    scene.render.use_compositing = scene.render.use_sequencer = scene.render.use_multiview = False


def _render(scene, enabled, samples, seed, stem):
    """Render to float EXR and, through the scene's view, to PNG, and return the luminance."""
    scene.spectral_tiles.enabled = enabled
    scene.cycles.samples, scene.cycles.seed = samples, seed
    image = scene.render.image_settings
    image.media_type, image.file_format, image.color_mode, image.color_depth = "IMAGE", "OPEN_EXR", "RGB", "32"
    picture_files.render_into(scene, stem + ".exr")
    image.file_format, image.color_depth = "PNG", "8"
    try:
        bpy.data.images["Render Result"].save_render(stem + ".png", scene=scene)
    except RuntimeError as error:
        raise Refused(f"Blender could not write {os.path.basename(stem)}.png; is the disk full?") from error
    picture_files.check(stem + ".png", scene.render)
    return _luminance(stem + ".exr")


def _luminance(path):
    """Luminance of an EXR picture, (height, width), read by Blender itself: some builds have no OpenImageIO module."""
    image = bpy.data.images.load(path, check_existing=False)
    image.colorspace_settings.name = "Non-Color"  # as it was rendered
    width, height = image.size
    pixels = np.empty(width * height * 4, np.float32)
    image.pixels.foreach_get(pixels)
    bpy.data.images.remove(image)
    return pixels.reshape(height, width, 4)[..., :3] @ _LUMINANCE


def _errors(pictures, halves, sigma):
    """Mean square error of each picture, unbiased: the noises of the reference's halves are independent."""
    errors = {}
    for name, picture in pictures.items():
        first, second = (_low_passed(picture - half, sigma) for half in halves)
        errors[name] = float(np.mean(first * second))
    theirs, ours = (errors[name] for name in RENDERS.values())
    return errors | {"ratio": ours / theirs if theirs > 0.0 else None}


def _low_passed(picture, sigma):
    """The picture through a Gaussian of `sigma` pixels, mirrored at its edges."""
    if sigma == 0:
        return picture
    reach = 4 * sigma
    weights = np.exp(-0.5 * (np.arange(-reach, reach + 1) / sigma) ** 2)
    picture = np.pad(picture, reach, "symmetric")
    for axis in (0, 1):
        picture = np.apply_along_axis(np.convolve, axis, picture, weights / weights.sum(), "valid")
    return picture
