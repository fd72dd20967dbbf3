# SPDX-License-Identifier: GPL-3.0-or-later
"""What can be said on the command line, with its bounds, which are Blender's own."""

import argparse
import os
import re

import bpy

from ..plan.patterns import atomic_file, generator_cli, messages
from . import picture_files

WRONG_USE = 2

# More are no film: a day has two million.
_MOST_FRAMES = 2_097_152


class _Parser(argparse.ArgumentParser):
    """A parser that says what is wrong in one line."""

    def error(self, message):
        line, hint = f"spectral_tiles: {messages.one_line(message)}", f"; see {self.prog} --help"
        self.exit(WRONG_USE, f"{line}{hint if len(line + hint) <= 200 else ''}\n")


def parser(program, commands):
    """The parser of a command line.

    Parameters
    ----------
    program : str
        What the help calls it.
    commands : dict
        By the name of a command, what its options' `run` shall be.
    """
    cycles, scene, settings = bpy.context.scene.cycles, bpy.context.scene, bpy.context.scene.render
    made = _Parser(
        prog=program,
        description="Render with Cycles and Spectral Tiles.",
        epilog="Exit codes: 0 done, 1 the render was refused or failed, 2 wrong use, 130 interrupted.",
    )
    subparsers = made.add_subparsers(dest="command", metavar="COMMAND", required=True)

    summary = argparse.ArgumentParser(add_help=False)
    summary.add_argument(
        "--json",
        # Better known before hours of rendering.
        type=_checked(lambda path: path == "-" or atomic_file.check_writable(path)),
        metavar="FILE",
        help="write a summary there when done; - is standard output",
    )
    rendered = argparse.ArgumentParser(add_help=False, parents=[summary])
    rendered.add_argument("scene_file", metavar="FILE.blend", type=_existing, help="the scene; it is not changed")
    rendered.add_argument("--scene", metavar="NAME", help="which scene of the file, by default the active one")
    _add_whole(rendered, "--samples", cycles, "samples", "samples a pixel, the most with a noise threshold")
    _add_whole(rendered, "--seed", cycles, "seed", "seed of the noise")
    rendered.add_argument("--pattern", metavar="PATTERN", help="'auto', a shipped pattern's name or a pattern file")
    _add_whole(
        rendered, "--percentage", settings, "resolution_percentage", "size in percent, of at most 65536 pixels a side"
    )

    render = subparsers.add_parser("render", parents=[rendered], help="render frames to files")
    render.add_argument(
        "--frames",
        type=_frame_numbers,
        metavar="LIST",
        help=f"1,4-8 or all, {_bounds(scene, 'frame_current')}; write negative ones as --frames=-3--1; by default the "
        "current frame",
    )
    render.add_argument(
        "--output",
        type=_checked(picture_files.check_output),
        metavar="PATH",
        help=f"where to, #### is the frame's number; its ending sets the format ({picture_files.ENDINGS}), without one "
        "the scene's stays; by default the scene's path",
    )
    render.add_argument(
        "--layer",
        type=_layer,
        metavar="I/K",
        help="take the I-th of K parts of the samples, 1 to K, which is at most their number, into PATH_layerIofK.exr; "
        "`merge` puts them together",
    )
    render.set_defaults(run=commands["render"])

    compare = subparsers.add_parser(
        "compare", parents=[rendered], help="render one frame with Cycles and Spectral Tiles at equal samples"
    )
    folder = _checked(lambda path: picture_files.check_output(path and f"{path}/"))
    compare.add_argument("--out", type=folder, required=True, metavar="FOLDER", help="receives both as EXR and PNG")
    _add_whole(compare, "--frame", scene, "frame_current", "the frame")
    compare.add_argument(
        "--reference-samples",
        type=_whole(cycles, "samples"),
        default=64,
        metavar="N",
        help=f"samples a pixel of each half of the converged picture, {_bounds(cycles, 'samples')} "
        "(default %(default)s)",
    )
    compare.set_defaults(run=commands["compare"])

    merge = subparsers.add_parser("merge", parents=[summary], help="merge a frame's layers exactly")
    merge.add_argument("picture", metavar="PATH.exr", help="the frame, as if it had been rendered at once")
    merge.add_argument(
        "layers", nargs="*", default=[], metavar="LAYER", help="by default all PATH_layerIofK.exr, which must be there"
    )
    merge.set_defaults(run=commands["merge"])

    subparsers.add_parser("tile", help="make, judge and draw tiles: `tile --help`")
    return made


def parse(program, commands, arguments):
    """What a command line says; parameters of `parser`, and the words.  Raises SystemExit, like argparse."""
    made = parser(program, commands)
    options = made.parse_args(arguments)
    others = [getattr(options, name, None) for name in ("scene_file", "pattern", "output", "picture")]
    if options.json != "-" and atomic_file.would_replace(options.json, *others, *getattr(options, "layers", ())):
        made.error(f"--json: expected another file than the others, got {messages.quoted(options.json, 80)}")
    return options


def _add_whole(parser, option, owner, name, what):
    parser.add_argument(
        option, type=_whole(owner, name), metavar="N", help=f"{what}, {_bounds(owner, name)}; by default the scene's"
    )


def _bounds(owner, name):
    limits = owner.bl_rna.properties[name]
    return f"{limits.hard_min} to {limits.hard_max}"


def _existing(path):
    if not os.path.isfile(path):
        raise argparse.ArgumentTypeError(f"no such file: {path}")
    return path


def _checked(check):
    """Return a parser of texts of which `check` raises neither OSError nor ValueError."""

    def parse(text):
        try:
            check(text)
        except (OSError, ValueError) as error:
            raise argparse.ArgumentTypeError(str(error)) from None
        return text

    return parse


def _whole(owner, name):
    """Return a parser of whole numbers that a property takes."""
    limits = owner.bl_rna.properties[name]
    return generator_cli.whole(limits.hard_min, limits.hard_max)


def _layer(text):
    match = re.fullmatch(r"(\d{1,9})/(\d{1,9})", text)
    if match is None:
        raise argparse.ArgumentTypeError(f"expected I/K such as 2/4, got {messages.quoted(text)}")
    layer, count = map(int, match.groups())
    if not 1 <= layer <= count:
        raise argparse.ArgumentTypeError(f"expected layer 1 to {count}, got {layer}")
    return layer, count


def _frame_numbers(text):
    if text == "all":
        return text
    frame = _whole(bpy.context.scene, "frame_current")
    frames = []
    for item in text.split(","):
        match = re.fullmatch(r"\s*(-?\d+)(?:-(-?\d+))?\s*", item)
        if match is None:
            raise argparse.ArgumentTypeError(f"expected frames such as 1,4-8, got {messages.quoted(text)}")
        first, last = match.groups()
        further = range(frame(first), frame(last or first) + 1)
        if len(frames) + len(further) > _MOST_FRAMES:
            raise argparse.ArgumentTypeError(f"expected at most {_MOST_FRAMES} frames")
        frames += further
    if not frames:
        raise argparse.ArgumentTypeError(f"no frames in {messages.quoted(text)}")
    return frames
