# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures rendered to files from the command line, which appear complete or not at all."""

import contextlib
import os
import re

import bpy

from ..blender import interruption
from ..blender.refusal import Refused

# Endings of pictures, and the settings that write them.
_FORMATS = {
    ".exr": ("MULTI_LAYER_IMAGE", "OPEN_EXR_MULTILAYER"),
    ".jpg": ("IMAGE", "JPEG"),
    ".png": ("IMAGE", "PNG"),
    ".tif": ("IMAGE", "TIFF"),
}


def open_scene(path, name=None):
    """Load a .blend file and return one of its scenes, by default the active one; raises `Refused`."""
    try:
        bpy.ops.wm.open_mainfile(filepath=os.path.abspath(path), load_ui=False)
    except RuntimeError as error:
        raise Refused(f"Cannot open {path}: {_one_line(error)}") from error
    if name is None:
        return bpy.context.scene
    if name not in bpy.data.scenes:
        raise Refused(f'{path} has no scene "{name}", but {", ".join(bpy.data.scenes.keys())}')
    return bpy.data.scenes[name]


def path_of(scene, frame, output=None):
    """Where the picture of a frame goes, by Blender's rules: ``####`` is the frame's number, by default at the end.

    Parameters
    ----------
    scene : bpy.types.Scene
    frame : int
    output : str, optional
        Instead of the scene's own path; its ending, if it has one, sets the scene's format.

    Raises
    ------
    Refused
        The scene's format is a movie.
    """
    render = scene.render
    if output is not None:
        stem, ending = os.path.splitext(os.path.abspath(output))
        if ending.lower() in _FORMATS:
            if "#" not in stem:
                stem += "####"  # or else Blender puts it behind the ending, and adds another one
            if ending.lower() != render.file_extension:
                render.image_settings.media_type, render.image_settings.file_format = _FORMATS[ending.lower()]
        render.filepath = stem + ending
    if render.is_movie_format:
        raise Refused("The scene writes a movie, but frames are rendered one by one: choose an image format")
    return bpy.path.abspath(render.frame_path(frame=frame))


def render(scene, path):
    """Render the scene's current frame.

    Returns
    -------
    list of str
        The files written: `path`, or one for each view of a stereoscopic picture.

    Raises
    ------
    Refused
        The engine refused, or Blender wrote nothing.
    OSError
        The folder cannot be made or written to.
    """
    folder, name = os.path.split(path)
    os.makedirs(folder, exist_ok=True)
    with interruption.unfinished(folder) as unfinished:
        scene.render.filepath = os.path.join(unfinished, name)
        try:
            bpy.ops.render.render(write_still=True, scene=scene.name)
        except RuntimeError as error:
            raise Refused(_one_line(error)) from error
        files = sorted(os.listdir(unfinished))
        if not files:
            raise Refused(f"Blender wrote no picture to {path}")
        for file in files:
            os.replace(os.path.join(unfinished, file), os.path.join(folder, file))
    return [os.path.join(folder, file) for file in files]


@contextlib.contextmanager
def sample_progress(tell):
    """Call `tell` with the part of the current picture that is done, from 0 to 1, inside a `with` block."""

    def read(stats):
        match = re.search(r"Sample (\d+)/(\d+)|Sub-render (\d+) of (\d+)", stats)
        done, count = (int(number) for number in match.groups() if number) if match else (0, 0)
        # A picture of several Cycles renders counts each one's single sample.
        if count > 1:
            tell(done / count)

    bpy.app.handlers.render_stats.append(read)
    try:
        yield
    finally:
        bpy.app.handlers.render_stats.remove(read)


def _one_line(error):
    """The first of the reports that an operator's error is made of; an engine's error is reported twice."""
    return str(error).strip().splitlines()[0].removeprefix("Error: ")
