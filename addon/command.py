# SPDX-License-Identifier: GPL-3.0-or-later
"""The command line: ``blender --command spectral_tiles …``, or ``spectral-tiles …`` with Blender's Python module.

Progress goes to standard output as Open Job Description has it, so that its runners show it and a farm's pattern finds
it: ``openjd_progress: 42`` in percent, ``openjd_status: frame 3, 2 of 10``.  Errors are one line on standard error.
"""

import argparse
import json
import os
import sys
import time

import bpy

from . import comparison, layers, still
from .failure import Refused

try:  # as an extension, where the generator is a package beside this one
    from ..generator import cli as generator
except ImportError:  # from a checkout, where `addon` and `generator` are top-level packages
    from generator import cli as generator

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
    try:
        if arguments[:1] == ["tile"]:
            return generator.main(arguments[1:], f"{program} tile")
        options = _parser(program).parse_args(arguments)
    except SystemExit as stop:
        return stop.code
    start = time.perf_counter()
    code, summary = DONE, {"command": options.command, "blender": bpy.app.version_string}
    try:
        summary |= options.run(options)
    except (Refused, OSError) as error:
        code, summary["error"] = FAILED, str(error)
        print(f"{_NAME}: {error}", file=sys.stderr)
    except KeyboardInterrupt:
        code, summary["error"] = INTERRUPTED, "interrupted"
        print(f"{_NAME}: interrupted", file=sys.stderr)
    summary["seconds"] = round(time.perf_counter() - start, 3)
    if options.json == "-":
        print(json.dumps(summary), flush=True)
    elif options.json:
        try:
            with open(options.json, "w", encoding="utf-8") as file:
                json.dump(summary, file)
        except OSError as error:
            code = FAILED
            print(f"{_NAME}: {error}", file=sys.stderr)
    return code


def main():
    """The command ``spectral-tiles``, where Blender is a module of Python and the add-on is not registered yet."""
    from . import register

    register()
    sys.exit(run(sys.argv[1:], "spectral-tiles"))


# Commands


def _render(options):
    scene = _open(options)
    settings = scene.spectral_tiles
    if options.layer:
        _take_layer(scene, *options.layer)
    frames = _frames(options.frames, scene)
    first, count = layers.subset(scene.cycles, settings.samples)
    rendered = []
    with _Progress(len(frames)) as progress:
        for frame in frames:
            progress.begin(f"frame {frame}")
            start = time.perf_counter()
            scene.frame_set(frame)
            path = _picture_path(scene, frame, len(frames) == 1, options)
            files = still.render(scene, path)
            rendered.append({"frame": frame, "files": files, "seconds": round(time.perf_counter() - start, 3)})
    return {
        "samples": settings.samples,
        "first_sample": first,
        "samples_taken": count,
        "files": [file for frame in rendered for file in frame["files"]],
        "frames": rendered,
    }


def _compare(options):
    scene = _open(options)
    if options.frame is not None:
        scene.frame_set(options.frame)
    samples = scene.spectral_tiles.samples
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
    files = options.layers or layers.files_of(options.picture)
    samples, exact = layers.merge(files, options.picture)
    if not exact:
        print(
            f"{_NAME}: the layers' sample plans differ, as those of unlike machines may; "
            "the picture is sound, but not exactly that of one render",
            file=sys.stderr,
        )
    return {"samples": samples, "layers": files, "files": [os.path.abspath(options.picture)], "exact": exact}


# What a scene is told


def _open(options):
    scene = still.open_scene(options.scene_file, options.scene)
    scene.render.engine = "SPECTRAL_TILES"
    settings = scene.spectral_tiles
    for name in ("samples", "seed"):
        if getattr(options, name) is not None:
            setattr(settings, name, getattr(options, name))
    if options.percentage is not None:
        scene.render.resolution_percentage = options.percentage
    if options.tile is not None:
        shipped = settings.bl_rna.properties["tile"].enum_items.keys()
        named = options.tile.upper() in shipped
        settings.tile = options.tile.upper() if named else "FILE"
        settings.tile_path = "" if named else os.path.abspath(options.tile)
    return scene


def _take_layer(scene, layer, count):
    """Make the scene's render one layer of the frame: linear light, as it left Cycles."""
    if count > scene.spectral_tiles.samples:
        raise Refused(f"{scene.spectral_tiles.samples} samples a pixel cannot be split into {count} layers")
    cycles = scene.cycles
    cycles.use_sample_subset = True
    cycles.sample_offset, cycles.sample_subset_length = layers.part(scene.spectral_tiles.samples, layer, count)
    cycles.use_denoising = False
    scene.render.use_compositing = scene.render.use_sequencer = False
    image = scene.render.image_settings
    image.media_type, image.file_format, image.color_depth = "MULTI_LAYER_IMAGE", "OPEN_EXR_MULTILAYER", "32"


def _picture_path(scene, frame, only, options):
    path = still.path_of(scene, frame, options.output)
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


class _Progress:
    """Lines for a farm about pictures that take equally long."""

    def __init__(self, pictures):
        self._pictures = pictures
        self._begun = 0
        self._percent = -1
        self._reading = still.sample_progress(self._tell)

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
        percent = int(100 * (self._begun - 1 + part) / self._pictures)
        if percent > self._percent:
            self._percent = percent
            print(f"openjd_progress: {percent}", flush=True)


def _parser(program):
    parser = argparse.ArgumentParser(
        prog=program,
        description="Render with Cycles Spectral Tiles.",
        epilog="Exit codes: 0 done, 1 the render was refused or failed, 2 wrong use.",
    )
    commands = parser.add_subparsers(dest="command", metavar="COMMAND", required=True)

    summary = argparse.ArgumentParser(add_help=False)
    summary.add_argument("--json", metavar="FILE", help="write a summary there when done; - is standard output")
    scene = argparse.ArgumentParser(add_help=False, parents=[summary])
    scene.add_argument("scene_file", metavar="FILE.blend", type=_existing, help="the scene; it is not changed")
    scene.add_argument("--scene", metavar="NAME", help="which scene of the file, by default the active one")
    scene.add_argument("--samples", type=_positive, metavar="N", help="samples a pixel, by default the scene's")
    scene.add_argument("--seed", type=_natural, metavar="N", help="by default the scene's")
    scene.add_argument("--tile", metavar="TILE", help="'auto', a shipped tile's name or a tile file")
    scene.add_argument("--percentage", type=_positive, metavar="N", help="size in percent of the scene's")

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
    compare.add_argument("--frame", type=int, metavar="N", help="by default the current one")
    compare.add_argument(
        "--reference-samples",
        type=_positive,
        default=64,
        metavar="N",
        help="samples a pixel of each half of the converged picture (default %(default)s)",
    )
    compare.set_defaults(run=_compare)

    merge = commands.add_parser("merge", parents=[summary], help="merge a frame's layers exactly")
    merge.add_argument("picture", metavar="PATH.exr", help="the frame, as if it had been rendered at once")
    merge.add_argument(
        "layers", nargs="*", metavar="LAYER", help="by default all PATH_layerIofK.exr, which must be there"
    )
    merge.set_defaults(run=_merge)

    commands.add_parser("tile", help="make, judge and draw tiles: `tile --help`")
    return parser


def _existing(path):
    if not os.path.isfile(path):
        raise argparse.ArgumentTypeError(f"no such file: {path}")
    return path


def _positive(text):
    number = int(text)
    if number < 1:
        raise argparse.ArgumentTypeError(f"expected 1 or more, got {text}")
    return number


def _natural(text):
    number = int(text)
    if number < 0:
        raise argparse.ArgumentTypeError(f"expected 0 or more, got {text}")
    return number


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
            frames += range(int(first), int(last if dash else first) + 1)
    except ValueError:
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
