# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures rendered to files from the command line, which appear complete or not at all."""

import contextlib
import os
import re
import tempfile

import bpy

from ..blender import interruption, openimageio
from ..blender.refusal import Refused

# Endings of pictures that Blender writes, and the settings that it does so by.
_FORMATS = {
    ".avif": "AVIF",
    ".bmp": "BMP",
    ".cin": "CINEON",
    ".dpx": "DPX",
    ".exr": "OPEN_EXR_MULTILAYER",
    ".hdr": "HDR",
    ".jp2": "JPEG2000",
    ".jpeg": "JPEG",
    ".jpg": "JPEG",
    ".png": "PNG",
    ".rgb": "IRIS",
    ".tga": "TARGA",
    ".tif": "TIFF",
    ".tiff": "TIFF",
    ".webp": "WEBP",
}

#: Those, for a person.
ENDINGS = " ".join(_FORMATS)

# What is taken for an ending: letters behind a dot, perhaps with digits; neither `frame.0001` nor `v1.2_####`.
_ENDING = re.compile(r"\.[A-Za-z][A-Za-z0-9]{0,4}$")


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


def check_output(path):
    """Raise ValueError if a path of the user's names no picture that Blender writes."""
    if not path:
        raise ValueError("expected a path")
    ending = _ENDING.search(path)
    if ending and ending.group().lower() not in _FORMATS:
        raise ValueError(f"{ending.group()} is no ending of a picture that Blender writes; these are: {ENDINGS}")


def path_of(scene, frame, output=None, only=False):
    """Where the picture of a frame goes, by Blender's rules: ``####`` is the frame's number, by default at the end.

    Parameters
    ----------
    scene : bpy.types.Scene
    frame : int
    output : str, optional
        Instead of the scene's own path; its ending, if it has one, sets the scene's format.  A name that ends with a
        slash is a folder.
    only : bool
        Whether this is the only frame, so that `output` needs no number.

    Raises
    ------
    Refused
        The scene's format is a movie, or the path has fields in braces that Blender does not know.
    """
    render = scene.render
    stem = ending = ""
    if output is not None:
        found = _ENDING.search(output)
        ending = found.group() if found else ""
        stem = os.path.abspath(output[: len(output) - len(ending)])
        if output.endswith(("/", os.sep)):
            stem = os.path.join(stem, "####")
        elif "#" not in stem and ending:
            stem += "####"  # or else Blender puts it behind the ending, and adds another one
        if ending and not _writes(render, ending.lower()):
            made = _FORMATS[ending.lower()]
            render.image_settings.media_type = "MULTI_LAYER_IMAGE" if "MULTILAYER" in made else "IMAGE"
            render.image_settings.file_format = made
        render.filepath = stem + ending
    if render.is_movie_format:
        raise Refused("The scene writes a movie, but frames are rendered one by one: choose an image format")
    try:
        path = bpy.path.abspath(render.frame_path(frame=frame))
    except RuntimeError as error:
        reason = " ".join(line.removeprefix("- ") for line in str(error).strip().splitlines()[1:])
        raise Refused(f"Cannot use the path {output or render.filepath}: {reason}") from error
    if only and output and "#" not in output and not output.endswith(("/", os.sep)):
        # As it was asked for, but for fields, which Blender has put in before the number.
        return _without_number(path, frame, ending)
    return path


def _writes(render, ending):
    """Whether files of this ending are what the scene's settings write."""
    made = render.image_settings.file_format
    return _FORMATS[ending] == made or (ending == ".exr" and made == "OPEN_EXR")


def _without_number(path, frame, ending):
    number = f"-{-frame:04d}" if frame < 0 else f"{frame:04d}"
    stem, found = os.path.splitext(path)
    return stem.removesuffix(number) + (ending or found)


def render(scene, path):
    """Render the scene's current frame.

    Returns
    -------
    list of str
        The files written: `path`, or one for each view of a stereoscopic picture.

    Raises
    ------
    Refused
        The engine refused, or Blender wrote nothing, or not all of it.
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
            check(os.path.join(unfinished, file))
        return [put(os.path.join(unfinished, file), folder) for file in files]


def put(path, folder):
    """Move a finished file into its folder, over what is there; return where it is."""
    final = os.path.join(folder, os.path.basename(path))
    os.replace(path, final)
    return final


def check(path):
    """Raise `Refused` if a picture cannot be read to its end: of a full disk Blender tells but for some formats."""
    image = bpy.data.images.load(path, check_existing=False)
    try:
        is_whole = _is_whole_exr(path) if image.type == "MULTILAYER" else len(image.pixels) > 0
    finally:
        bpy.data.images.remove(image)
    if not is_whole:
        raise Refused(f"Blender could not write all of {os.path.basename(path)}; is the disk full?")


def _is_whole_exr(path):
    try:
        oiio = openimageio.load()
    except Refused:
        return True  # nobody here can tell
    file = oiio.ImageInput.open(path)
    if file is None:
        return False
    part = 0
    while file.seek_subimage(part, 0):
        height = file.spec().height
        if file.read_scanlines(height - 1, height, 0, 0, 1, oiio.UNKNOWN) is None:
            return False
        part += 1
    return part > 0


def try_writing(folder):
    """Raise OSError if no file can be made in a folder."""
    with tempfile.TemporaryFile(dir=folder, prefix=".spectral_tiles_"):
        pass


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
