# SPDX-License-Identifier: GPL-3.0-or-later
"""The command line: ``blender --command spectral_tiles …``, or ``spectral-tiles …`` with Blender's Python module.

Progress goes to standard output (`farm_progress`).  Errors are one line on standard error.
"""

import os
import signal
import sys
import threading
import time
import traceback

import bpy

from ..blender import failure, interruption
from ..blender.refusal import Refused
from ..cycles.sampling import Sampling
from ..farm import layers, merge
from ..plan.patterns import atomic_file, messages
from ..plan.patterns import generator_cli as generator
from . import arguments as given
from . import comparison, picture_files
from .farm_progress import RENDERED, Percent, Progress

DONE, FAILED, WRONG_USE, INTERRUPTED = 0, 1, given.WRONG_USE, 130

_NAME = "spectral_tiles"


def run(arguments, program=f"blender --command {_NAME}"):
    """Run a command line.

    Parameters
    ----------
    arguments : list of str
    program : str
        What the help calls it.

    Returns
    -------
    int
        Exit code: 0 done, 1 the render was refused or failed, if only a part of it such as the denoiser, 2 wrong use,
        130 after Ctrl-C.
    """
    if arguments[:1] == ["tile"]:
        return _tile(arguments[1:], f"{program} tile")
    try:
        options = given.parse(program, _COMMANDS, arguments)
    except SystemExit as stop:
        return stop.code
    failure.warnings.clear()
    start = time.perf_counter()
    summary = {"command": options.command, "blender": bpy.app.version_string}
    ending = threading.Lock()  # never released: there is one end

    def finish(code, error=None):
        if error is not None:
            summary["error"] = error
        summary["seconds"] = round(time.perf_counter() - start, 3)
        try:
            generator.write_summary(summary, options.json)
        except OSError as unwritten:
            # One line: what came first has priority.
            code, error = code or FAILED, error or _sentence(unwritten)
        if error is not None:
            print(f"{_NAME}: {error}", file=sys.stderr)
        return code

    def interrupted():
        if not ending.acquire(blocking=False):
            return None
        atomic_file.abandon()
        code = finish(INTERRUPTED, "interrupted")
        atomic_file.abandon()  # Blender may have written more meanwhile
        return code

    with interruption.ends_with(interrupted):
        code, error = DONE, None
        try:
            summary |= options.run(options)
        except Exception as raised:
            code, error = FAILED, _sentence(raised)
        else:
            if failure.warnings:
                code, error = FAILED, failure.warnings[0]
        ending.acquire()
        return finish(code, error)


def _tile(arguments, program):
    # Blender's own handler would wait for the end of a render, and there is none.
    before = {number: signal.signal(number, signal.default_int_handler) for number in interruption.SIGNALS}
    try:
        return generator.main(arguments, program, Percent().tell)
    except SystemExit as stop:
        return stop.code
    finally:
        for number, handler in before.items():
            signal.signal(number, signal.SIG_DFL if handler is None else handler)


def _sentence(error):
    """What went wrong, in one line."""
    if isinstance(error, OSError) and error.filename is not None:
        return messages.about(error.filename, error.strerror)
    if isinstance(error, Refused | OSError):
        return messages.one_line(error)
    if isinstance(error, MemoryError):
        return "Not enough memory"
    # A mistake of ours: the line tells where, for whoever is sent it.
    place = traceback.extract_tb(error.__traceback__)[-1]
    where = f"{os.path.basename(place.filename)}, line {place.lineno}"
    return messages.one_line(f"Spectral Tiles failed, please report this ({where}): {type(error).__name__}: {error}")


def main():
    """The command ``spectral-tiles``, where Blender is a module of Python and the add-on is not registered yet."""
    from .. import register

    register()
    sys.exit(generator.ended(run(sys.argv[1:], "spectral-tiles")))


# Commands


def _render(options):
    scene = _open(options)
    if options.layer:
        _take_layer(scene, *options.layer)
    frames = _frames(options.frames, scene)
    sampling = Sampling.of_layer(scene, scene.view_layers[0])
    if not sampling.count:
        raise Refused(f"The sample subset starts at sample {sampling.first}, but the frame has {sampling.samples}")
    rendered = []
    paths = [_path_of(scene, frame, options, len(frames) == 1) for frame in frames]
    with Progress(len(frames)) as progress:
        for frame, path in zip(frames, paths, strict=True):
            progress.begin(f"frame {frame}", sampling.count)
            start = time.perf_counter()
            scene.frame_set(frame)
            files = picture_files.render(scene, path)
            rendered.append({"frame": frame, "files": files, "seconds": round(time.perf_counter() - start, 3)})
    return {
        "samples": sampling.samples,
        "first_sample": sampling.first,
        "samples_taken": sampling.count,
        "files": [file for frame in rendered for file in frame["files"]],
        "frames": rendered,
    }


def _path_of(scene, frame, options, is_only):
    """Where a frame's picture goes; raises what forbids that, better before hours of rendering."""
    path = picture_files.path_of(scene, frame, options.output, is_only)
    if options.layer:
        path = layers.file_of(path, *options.layer)
    for file in picture_files.files_of(scene.render, path):
        if options.json != "-" and atomic_file.would_replace(options.json, file):
            options.json = None  # the picture that may be there stays
            raise Refused(f"--json names the picture {file}")
        if os.path.isdir(os.path.dirname(file)):
            atomic_file.check_writable(file)
    return path


def _compare(options):
    scene = _open(options)
    if options.frame is not None:
        scene.frame_set(options.frame)
    samples = scene.cycles.samples
    with Progress(4) as progress:
        files, errors = comparison.compare(
            scene, samples, options.reference_samples, os.path.abspath(options.out), progress.begin
        )
    print(f"Mean square error of luminance at {samples} samples a pixel, one seed, after a Gaussian of sigma pixels")
    for sigma, error in errors.items():
        ratio = "none" if error["ratio"] is None else f"{error['ratio']:.3f}"
        print(
            f"sigma {sigma}: Cycles {error['cycles']:.3g}, Spectral Tiles {error['spectral_tiles']:.3g}, ratio {ratio}"
        )
    return {"samples": samples, "files": files, "errors": {f"sigma {sigma}": error for sigma, error in errors.items()}}


def _merge(options):
    if not options.picture.lower().endswith(".exr"):
        raise Refused(f"Only OpenEXR pictures hold layers: {options.picture} does not end in .exr")
    files = options.layers or layers.files_of(options.picture)
    percent = Percent()
    samples, exact, sealed = merge.merge(files, options.picture, lambda part: percent.tell(RENDERED * part))
    percent.tell(1.0)
    if not exact:
        _warn(
            "the layers' sample plans differ, as of unlike machines; the picture is sound, but not that of one render"
        )
    if not sealed:
        _warn("layers without a digest, as Blender writes without this command line; damage in them is not found")
    picture = os.path.abspath(options.picture)
    return {"samples": samples, "layers": files, "files": [picture], "exact": exact, "sealed": sealed}


def _warn(text):
    print(f"{_NAME}: {text}", file=sys.stderr)


_COMMANDS = {"render": _render, "compare": _compare, "merge": _merge}


# What a scene is told


def _open(options):
    scene = picture_files.open_scene(options.scene_file, options.scene)
    scene.render.engine = "CYCLES"
    settings = scene.spectral_tiles
    settings.enabled = True
    for name in ("samples", "seed"):
        if getattr(options, name) is not None:
            setattr(scene.cycles, name, getattr(options, name))
    if options.percentage is not None:
        scene.render.resolution_percentage = options.percentage
    picture_files.check_size(scene.render)
    if options.pattern is not None:
        items = settings.bl_rna.properties["pattern"].enum_items
        shipped = [item.identifier for item in items if item.identifier != "FILE"]
        named = options.pattern.upper() in shipped
        if not named and not os.path.isfile(options.pattern):
            raise Refused(f"No pattern {options.pattern}: neither a file nor one of {', '.join(shipped).lower()}")
        settings.pattern = options.pattern.upper() if named else "FILE"
        settings.pattern_path = "" if named else os.path.abspath(options.pattern)
    return scene


def _take_layer(scene, layer, count):
    """Make the scene's render one layer of the frame: linear light, as it left Cycles."""
    cycles = scene.cycles
    if count > cycles.samples:
        raise Refused(f"{cycles.samples} samples a pixel cannot be split into {count} layers")
    cycles.use_sample_subset = True
    cycles.sample_offset, cycles.sample_subset_length = layers.part(cycles.samples, layer, count)
    # All layers of a frame take samples of the same pixels.
    cycles.use_denoising = cycles.use_adaptive_sampling = False
    cycles.time_limit, cycles.use_layer_samples = 0.0, "IGNORE"
    scene.render.use_compositing = scene.render.use_sequencer = False
    image = scene.render.image_settings
    image.media_type, image.file_format, image.color_depth = "MULTI_LAYER_IMAGE", "OPEN_EXR_MULTILAYER", "32"


def _frames(text, scene):
    """Numbers out of ``1,4-8`` or ``all``; by default the current frame."""
    if text is None:
        return [scene.frame_current]
    if text == "all":
        return list(range(scene.frame_start, scene.frame_end + 1, scene.frame_step))
    return text


_handle = None


def register():
    global _handle
    _handle = bpy.utils.register_cli_command(_NAME, run)


def unregister():
    bpy.utils.unregister_cli_command(_handle)
