# SPDX-License-Identifier: GPL-3.0-or-later
"""The command line: ``blender --command spectral_tiles …``, or ``spectral-tiles …`` with Blender's Python module.

Progress goes to standard output as Open Job Description has it, so that its runners show it and a farm's pattern finds
it: ``openjd_progress: 42`` in percent, ``openjd_status: frame 3, 2 of 10``.  Errors are one line on standard error.
"""

import argparse
import os
import signal
import sys
import time
import traceback

import bpy

from ..blender import interruption
from ..blender.refusal import Refused
from ..cycles.sampling import Sampling
from ..farm import layers, merge
from ..plan.patterns import generator_cli as generator
from . import comparison, picture_files

DONE, FAILED, WRONG_USE, INTERRUPTED = 0, 1, 2, 130

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
        Exit code: 0 done, 1 the render was refused or failed, 2 wrong use, 130 after Ctrl-C.
    """
    if arguments[:1] == ["tile"]:
        return _tile(arguments[1:], f"{program} tile")
    try:
        options = _parser(program).parse_args(arguments)
    except SystemExit as stop:
        return stop.code
    start = time.perf_counter()
    summary = {"command": options.command, "blender": bpy.app.version_string}

    def finish(code, error=None):
        if error is not None:
            summary["error"] = error
            print(f"{_NAME}: {error}", file=sys.stderr)
        summary["seconds"] = round(time.perf_counter() - start, 3)
        try:
            generator.write_summary(summary, options.json)
        except OSError as failure:
            code = FAILED
            print(f"{_NAME}: {_sentence(failure)}", file=sys.stderr)
        return code

    with interruption.ends_with(lambda: finish(INTERRUPTED, "interrupted")):
        try:
            summary |= options.run(options)
        except Exception as error:
            return finish(FAILED, _sentence(error))
        return finish(DONE)


def _tile(arguments, program):
    # Blender's own handler would wait for the end of a render, and there is none.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        return generator.main(arguments, program, _Percent().tell)
    except SystemExit as stop:
        return stop.code
    finally:
        signal.signal(signal.SIGINT, signal.SIG_DFL if before is None else before)


def _sentence(error):
    """What went wrong, in one line."""
    if isinstance(error, Refused):
        return str(error)
    if isinstance(error, OSError) and error.filename is not None:
        return f"{error.filename}: {error.strerror}"
    if isinstance(error, OSError):
        return " ".join(str(error).split())
    if isinstance(error, MemoryError):
        return "Not enough memory"
    # A mistake of ours: the line tells where, for whoever is sent it.
    place = traceback.extract_tb(error.__traceback__)[-1]
    where = f"{os.path.basename(place.filename)}, line {place.lineno}"
    return (
        f"Spectral Tiles failed, please report this: {type(error).__name__}: {' '.join(str(error).split())} ({where})"
    )


def main():
    """The command ``spectral-tiles``, where Blender is a module of Python and the add-on is not registered yet."""
    from .. import register

    register()
    sys.exit(run(sys.argv[1:], "spectral-tiles"))


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
    with _Progress(len(frames)) as progress:
        for frame in frames:
            progress.begin(f"frame {frame}")
            start = time.perf_counter()
            scene.frame_set(frame)
            path = _picture_path(scene, frame, len(frames) == 1, options)
            files = picture_files.render(scene, path)
            rendered.append({"frame": frame, "files": files, "seconds": round(time.perf_counter() - start, 3)})
    return {
        "samples": sampling.samples,
        "first_sample": sampling.first,
        "samples_taken": sampling.count,
        "files": [file for frame in rendered for file in frame["files"]],
        "frames": rendered,
    }


def _compare(options):
    scene = _open(options)
    if options.frame is not None:
        scene.frame_set(options.frame)
    samples = scene.cycles.samples
    with _Progress(4) as progress:
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
    samples, exact = merge.merge(files, options.picture)
    if not exact:
        print(
            f"{_NAME}: the layers' sample plans differ, as those of unlike machines may; "
            "the picture is sound, but not exactly that of one render",
            file=sys.stderr,
        )
    return {"samples": samples, "layers": files, "files": [os.path.abspath(options.picture)], "exact": exact}


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


def _picture_path(scene, frame, only, options):
    path = picture_files.path_of(scene, frame, options.output)
    if only and options.output and "#" not in options.output:
        path = os.path.abspath(options.output)
    return layers.file_of(path, *options.layer) if options.layer else path


def _frames(text, scene):
    """Numbers out of ``1,4-8`` or ``all``; by default the current frame."""
    if text is None:
        return [scene.frame_current]
    if text == "all":
        return list(range(scene.frame_start, scene.frame_end + 1, scene.frame_step))
    return text


# Progress and parsing


class _Percent:
    """Lines for a farm about how much is done, each number once."""

    def __init__(self):
        self._told = -1

    def tell(self, part):
        percent = int(100 * part)
        if percent > self._told:
            self._told = percent
            print(f"openjd_progress: {percent}", flush=True)


class _Progress:
    """Lines for a farm about pictures that take equally long."""

    def __init__(self, pictures):
        self._pictures = pictures
        self._begun = 0
        self._percent = _Percent()
        self._reading = picture_files.sample_progress(self._tell)

    def __enter__(self):
        self._reading.__enter__()
        return self

    def __exit__(self, *exception):
        self._reading.__exit__(*exception)
        if exception[0] is None:
            self._tell(1.0)

    def begin(self, name):
        """Start the next picture."""
        self._begun += 1
        print(f"openjd_status: {name}, {self._begun} of {self._pictures}", flush=True)
        self._tell(0.0)

    def _tell(self, part):
        self._percent.tell((self._begun - 1 + part) / self._pictures)


class _Parser(argparse.ArgumentParser):
    """A parser that says what is wrong in one line."""

    def error(self, message):
        self.exit(WRONG_USE, f"{_NAME}: {message}; see {self.prog} --help\n")


def _parser(program):
    settings, render = bpy.context.scene.cycles, bpy.context.scene.render
    parser = _Parser(
        prog=program,
        description="Render with Cycles and Spectral Tiles.",
        epilog="Exit codes: 0 done, 1 the render was refused or failed, 2 wrong use, 130 interrupted.",
    )
    commands = parser.add_subparsers(dest="command", metavar="COMMAND", required=True)

    summary = argparse.ArgumentParser(add_help=False)
    summary.add_argument("--json", metavar="FILE", help="write a summary there when done; - is standard output")
    scene = argparse.ArgumentParser(add_help=False, parents=[summary])
    scene.add_argument("scene_file", metavar="FILE.blend", type=_existing, help="the scene; it is not changed")
    scene.add_argument("--scene", metavar="NAME", help="which scene of the file, by default the active one")
    scene.add_argument(
        "--samples", type=_whole(settings, "samples"), metavar="N", help="samples a pixel, by default the scene's"
    )
    scene.add_argument("--seed", type=_whole(settings, "seed"), metavar="N", help="by default the scene's")
    scene.add_argument("--pattern", metavar="PATTERN", help="'auto', a shipped pattern's name or a tile file")
    scene.add_argument(
        "--percentage",
        type=_whole(render, "resolution_percentage"),
        metavar="N",
        help="size in percent of the scene's",
    )

    render = commands.add_parser("render", parents=[scene], help="render frames to files")
    render.add_argument(
        "--frames", type=_frame_numbers, metavar="LIST", help="1,4-8 or all; by default the current one"
    )
    render.add_argument(
        "--output",
        metavar="PATH",
        help="where to, #### is the frame's number, the ending (.exr .png .jpg .tif) sets the format; by default the "
        "scene's path",
    )
    render.add_argument(
        "--layer",
        type=_layer,
        metavar="I/K",
        help="take the I-th of K parts of the samples, into PATH_layerIofK.exr; `merge` puts them together",
    )
    render.set_defaults(run=_render)

    compare = commands.add_parser(
        "compare", parents=[scene], help="render one frame with Cycles and Spectral Tiles at equal samples"
    )
    compare.add_argument("--out", required=True, metavar="FOLDER", help="receives both pictures as EXR and PNG")
    compare.add_argument("--frame", type=_frame, metavar="N", help="by default the current one")
    compare.add_argument(
        "--reference-samples",
        type=_whole(bpy.context.scene.cycles, "samples"),
        default=64,
        metavar="N",
        help="samples a pixel of each half of the converged picture (default %(default)s)",
    )
    compare.set_defaults(run=_compare)

    merge = commands.add_parser("merge", parents=[summary], help="merge a frame's layers exactly")
    merge.add_argument("picture", metavar="PATH.exr", help="the frame, as if it had been rendered at once")
    merge.add_argument(
        "layers", nargs="*", default=[], metavar="LAYER", help="by default all PATH_layerIofK.exr, which must be there"
    )
    merge.set_defaults(run=_merge)

    commands.add_parser("tile", help="make, judge and draw tiles: `tile --help`")
    return parser


def _existing(path):
    if not os.path.isfile(path):
        raise argparse.ArgumentTypeError(f"no such file: {path}")
    return path


def _whole(owner, name):
    """Return a parser of whole numbers that a property takes."""
    limits = owner.bl_rna.properties[name]
    least, most = limits.hard_min, limits.hard_max

    def parse(text):
        try:
            number = int(text)
        except ValueError:
            number = None
        if number is None or not least <= number <= most:
            raise argparse.ArgumentTypeError(f"expected a whole number, {least} to {most}, got {text!r}")
        return number

    return parse


def _frame(text):
    return _whole(bpy.context.scene, "frame_current")(text)


def _layer(text):
    try:
        layer, count = map(int, text.split("/"))
    except ValueError:
        raise argparse.ArgumentTypeError(f"expected I/K such as 2/4, got {text!r}") from None
    if not 1 <= layer <= count:
        raise argparse.ArgumentTypeError(f"expected layer 1 to {count}, got {layer}")
    return layer, count


def _frame_numbers(text):
    if text == "all":
        return text
    frames = []
    try:
        for item in text.split(","):
            first, dash, last = item.partition("-")
            frames += range(_frame(first), _frame(last if dash else first) + 1)
    except argparse.ArgumentTypeError:
        raise argparse.ArgumentTypeError(f"expected frames such as 1,4-8, got {text!r}") from None
    if not frames:
        raise argparse.ArgumentTypeError(f"no frames in {text!r}")
    return frames


_handle = None


def register():
    global _handle
    _handle = bpy.utils.register_cli_command(_NAME, run)


def unregister():
    bpy.utils.unregister_cli_command(_handle)
