# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures rendered to files from the command line, which appear complete or not at all."""

import contextlib
import math
import os
import re
import struct
import tempfile

import bpy

from ..blender import openimageio
from ..blender.refusal import Refused
from ..blender.region import Region
from ..farm import seal
from ..plan.patterns import atomic_file, messages

# Endings of pictures that Blender writes, and the settings that it does so by.
_FORMATS = {
    ".avif": "AVIF",
    ".bmp": "BMP",
    ".cin": "CINEON",
    ".dpx": "DPX",
    ".exr": "OPEN_EXR_MULTILAYER",
    ".hdr": "HDR",
    ".j2c": "JPEG2000",
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

# What finished files of some formats end with: neither Blender nor OpenImageIO misses it.
_LAST_BYTES = {
    ".j2c": b"\xff\xd9",
    ".jpeg": b"\xff\xd9",
    ".jpg": b"\xff\xd9",
    ".png": b"\0\0\0\0IEND\xaeB`\x82",
    ".tga": b"TRUEVISION-XFILE.\0",
}

#: Pixels, as Blender's own settings have it.
LONGEST_SIDE = 65536

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
    names = bpy.data.scenes.keys()
    if name not in names:
        raise Refused(f"{path} has no scene {messages.quoted(name)}, but {', '.join(names)}")
    return bpy.data.scenes[name]


def check_size(settings):
    """Raise `Refused` unless a picture is one that Blender makes and that fits into this machine's memory."""
    region, memory = Region.of_render(settings), math.inf
    if hasattr(os, "sysconf"):
        memory = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    if max(region.frame) > LONGEST_SIDE or 16 * region.pixels > memory:  # of four floats each
        size = "{} x {}".format(*region.frame)
        raise Refused(f"{size} pixels are too large a picture for Blender, or this machine's memory; see --percentage")


def check_output(path):
    """Raise ValueError if a path of the user's names no picture that Blender writes."""
    if not path:
        raise ValueError("expected a path")
    ending = _ENDING.search(path)
    stem = path[: ending.start()] if ending else path
    if "\0" in path or (not path.endswith(("/", os.sep)) and os.path.basename(stem) in {"", ".", ".."}):
        raise ValueError("expected the name of a picture, or a folder with a slash at its end")
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
        elif "#" not in os.path.basename(stem) and ending:
            stem += "####"  # or else Blender puts it behind the ending, and adds another one
        image, made = render.image_settings, _FORMATS.get(ending.lower())
        # An OpenEXR picture stays one, of one layer or of several.
        if made and image.file_format.removesuffix("_MULTILAYER") != made.removesuffix("_MULTILAYER"):
            image.media_type = "MULTI_LAYER_IMAGE" if "MULTILAYER" in made else "IMAGE"
            image.file_format = made
        if made == "JPEG2000":
            image.jpeg2k_codec = "J2K" if ending.lower() == ".j2c" else "JP2"
        render.filepath = stem + ending
    if render.is_movie_format:
        raise Refused("The scene writes a movie, but frames are rendered one by one: choose an image format")
    try:
        path = bpy.path.abspath(render.frame_path(frame=frame))
    except RuntimeError as error:
        reason = " ".join(line.removeprefix("- ") for line in str(error).strip().splitlines()[1:])
        raise Refused(f"Cannot use the path {output or render.filepath}: {reason}") from error
    if only and output and "#" not in os.path.basename(output) and not output.endswith(("/", os.sep)):
        # As it was asked for, but for fields, which Blender has put in before the number.
        stem, found = os.path.splitext(path)
        return stem.removesuffix(f"-{-frame:04d}" if frame < 0 else f"{frame:04d}") + (ending or found)
    return path


def files_of(settings, path):
    """Where the picture of a path may go: there, and where each view has a file to it with the view's suffix."""
    stem, ending = os.path.splitext(path)
    views = settings.views if settings.use_multiview and settings.image_settings.views_format == "INDIVIDUAL" else ()
    return [*(f"{stem}{view.file_suffix}{ending}" for view in views if view.use), path]


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
        The folder cannot be made or written to, which is said before anything is rendered.
    """
    folder, name = os.path.split(path)
    os.makedirs(folder, exist_ok=True)
    for file in files_of(scene.render, path):
        atomic_file.check_writable(file)
    with atomic_file.unfinished_folder(folder) as unfinished:
        render_into(scene, os.path.join(unfinished, name))
        return put(unfinished, folder)


def render_into(scene, path):
    """Render the scene's current frame into an unfinished folder; raises `Refused` unless all of it is there."""
    # Blender has put in what the braces of a path mean; those that are left are to stay.
    *views, given = (file.replace("{", "{{").replace("}", "}}") for file in files_of(scene.render, path))
    # While Blender puts together a view's name it needs more room, and cuts off whatever is too long.
    for longest in (*(view + 16 * "_" for view in views), given):
        scene.render.filepath = longest
        if scene.render.filepath != longest:
            raise Refused(f"Blender takes no path of {len(os.fsencode(longest))} bytes such as {path}")
    if scene.render.image_settings.file_format == "WEBP":
        _check_room(os.path.dirname(path), 4 * Region.of_render(scene.render).pixels)
    try:
        bpy.ops.render.render(write_still=True, scene=scene.name)
    except RuntimeError as error:
        raise Refused(_one_line(error)) from error
    folder, name = os.path.split(path)
    stem = os.path.splitext(name)[0]
    files = [file for file in os.listdir(folder) if file.startswith(stem)] if os.path.isdir(folder) else []
    if not files:
        raise Refused(f"Blender wrote no picture {name}")
    for file in files:
        check(os.path.join(folder, file), scene.render)
        if file.lower().endswith(".exr"):
            seal.seal(os.path.join(folder, file))


def _check_room(folder, size):
    """Raise OSError if there is no room for so many bytes: Blender's writer of WebP never ends on a full disk."""
    if hasattr(os, "posix_fallocate"):
        try:
            with tempfile.TemporaryFile(dir=folder) as file:
                os.posix_fallocate(file.fileno(), 0, size)
        except OSError as error:
            raise OSError(f"There is no room for a picture: {error.strerror}") from error


def put(unfinished, folder):
    """Move all files of a folder, which are whole, into another one, over what is there; return where they are."""
    files = []
    with contextlib.ExitStack() as blocks:  # none takes its name before all could
        for name in sorted(os.listdir(unfinished)):
            files.append(os.path.join(folder, name))
            temporary = blocks.enter_context(atomic_file.written_whole(files[-1]))
            os.replace(os.path.join(unfinished, name), temporary)
    return files


def check(path, settings):
    """Raise `Refused` unless a picture can be read to its end: of a full disk Blender tells but for some formats.

    Parameters
    ----------
    path : str
    settings : bpy.types.RenderSettings
        By which it was rendered.
    """
    unfinished = f"Blender could not write all of {os.path.basename(path)}; is the disk full?"
    if not _can_be_read(path):  # of which Blender's own reader would say more in lines of its own
        raise Refused(unfinished)
    try:
        image = bpy.data.images.load(path, check_existing=False)
    except RuntimeError as error:
        raise Refused(unfinished) from error
    try:
        size = tuple(image.size)
        is_whole = image.type == "MULTILAYER" or len(image.pixels) > 0
    finally:
        bpy.data.images.remove(image)
    region = Region.of_render(settings)
    # A picture for two eyes may be wider, and of several layers Blender tells no size.
    has_size = settings.use_multiview or size in {(0, 0), region.frame, region.size}
    if not (is_whole and has_size and _has_its_end(path)):
        raise Refused(unfinished)


def _has_its_end(path):
    with open(path, "rb") as file:
        head = file.read(20)
        length = file.seek(0, os.SEEK_END)
        last = _LAST_BYTES.get(os.path.splitext(path)[1].lower(), b"")
        file.seek(max(0, length - len(last)))
        if file.read() != last:
            return False
        if head[:4] == b"II*\0":
            return _tiff_length(file) <= length
    if head[:4] in (b"XPDS", b"SDPX"):  # a DPX picture tells its own length
        return int.from_bytes(head[16:20], "little" if head[:1] == b"X" else "big") <= length
    return True


def _tiff_length(file):
    """Where the last of what a TIFF file's directory lists ends: strips of pixels, and their description."""
    file.seek(4)
    file.seek(int.from_bytes(file.read(4), "little"))
    ends, strips = [0], {}
    for _ in range(int.from_bytes(file.read(2), "little")):
        entry = file.tell()
        tag, kind, count = struct.unpack("<HHI", file.read(8).ljust(8, b"\xff"))
        width = {1: 1, 2: 1, 3: 2, 4: 4, 5: 8, 7: 1, 12: 8}.get(kind, 4)
        if width * count > 4:
            file.seek(int.from_bytes(file.read(4), "little"))
            ends.append(file.tell() + width * count)
        if tag in (273, 279):  # where strips begin, and how long they are
            values = file.read(min(width * count, 2**24))
            strips[tag] = [int.from_bytes(values[k : k + width], "little") for k in range(0, len(values), width)]
        file.seek(entry + 12)
    return max([*ends, *map(sum, zip(strips.get(273, ()), strips.get(279, ()), strict=False))])


def _can_be_read(path):
    """Whether OpenImageIO reads all rows of the formats of which Blender misses some without a word."""
    if not path.lower().endswith((".exr", ".tif", ".tiff")):
        return True
    try:
        openimageio.check(path)
    except Refused:
        pass  # nobody here can tell
    except ValueError:
        return False
    return True


def _one_line(error):
    """The first of the reports that an operator's error is made of; an engine's error is reported twice."""
    return str(error).strip().splitlines()[0].removeprefix("Error: ")
