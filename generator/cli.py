"""The command line: ``python -m generator make | info | test | compare | analyse | plot | library``."""

import argparse
import json
import sys
import time
from pathlib import Path

from .atomic_file import replacing
from .dimensions import DIMENSIONS
from .library import make_library
from .methods import METHODS, make_tile
from .plots import save_figures
from .progress import ProgressBar
from .step_test import SIGMAS
from .tables import analysis_lines, comparison_lines, step_test_lines
from .test_functions import KINDS
from .tile import GENERATOR_VERSION
from .tile_file import check_path, load_array, load_tile, save_tile

EXIT_BAD_INPUT = 2
EXIT_INTERRUPTED = 130


class _Parser(argparse.ArgumentParser):
    """A parser that says what is wrong in one line, without the usage."""

    def error(self, message):
        raise ValueError(message)


def _parser(program):
    parser = _Parser(prog=program, description="Makes and judges sample tiles.")
    parser.add_argument("--version", action="version", version=GENERATOR_VERSION)
    commands = parser.add_subparsers(dest="command", required=True)
    summary = argparse.ArgumentParser(add_help=False)
    summary.add_argument("--json", metavar="FILE", help="write a summary there when done; - is standard output")

    make = commands.add_parser("make", parents=[summary], help="make a tile")
    make.add_argument("--size", type=int, default=64, help="side of the tile in pixels (default %(default)s)")
    make.add_argument("--dims", default=",".join(DIMENSIONS[:5]), help="names, comma-separated (default %(default)s)")
    make.add_argument("--method", choices=METHODS, default="spectral", help="default %(default)s")
    make.add_argument("--samples", type=int, default=1, help="samples of a pixel (default %(default)s)")
    make.add_argument("--seed", type=int, default=0, help="default %(default)s")
    make.add_argument("--frames", type=int, help="frames of a looped animation (spectral only)")
    make.add_argument("--steps", type=int, help="steps of the spectral optimiser")
    make.add_argument("--weights", type=_pairs(str), help="of subsets, such as t=2,t+light=0.5 (spectral only)")
    make.add_argument("--scales", type=_pairs(float), help="sigma=weight of the low-pass filters (spectral only)")
    make.add_argument("--candidates", type=int, help="tried for each sample (scanning methods, film-positions)")
    make.add_argument("--secondary", type=int, help="of the candidates, kept for the outer ring (scanning only)")
    make.add_argument("--out", required=True, help="file to write, .npz or .exr")
    make.set_defaults(run=_make)

    info = commands.add_parser("info", parents=[summary], help="say what a tile holds and how it was made")
    info.add_argument("file")
    info.set_defaults(run=_info)

    test = commands.add_parser("test", help="print the step test's table; 1 is white noise, lower is better")
    test.add_argument("file")
    _add_test_options(test)
    test.set_defaults(run=_test)

    compare = commands.add_parser("compare", help="print the step tests of several tiles as a Markdown table")
    compare.add_argument("file", nargs="+", help="tile, or NAME=tile; also .npy arrays of other programs")
    compare.add_argument("--dims", default=",".join(DIMENSIONS[:5]), help="of .npy arrays (default %(default)s)")
    compare.add_argument("--out", help="Markdown file to write (default: print)")
    _add_test_options(compare)
    compare.set_defaults(run=_compare)

    analyse = commands.add_parser("analyse", help="print discrepancies, distances, correlations, cylinder power")
    analyse.add_argument("file")
    analyse.set_defaults(run=_analyse)

    plot = commands.add_parser(
        "plot", parents=[summary], help="draw a tile's values, spectra, marginals and neighbourhoods"
    )
    plot.add_argument("file")
    plot.add_argument("--out", help="beginning of the pictures' names (default: the tile's, without its ending)")
    plot.set_defaults(run=_plot)

    library = commands.add_parser("library", help="make the tiles that the add-on ships")
    library.add_argument("--out", required=True, help="folder; tiles that are there already are kept")
    library.add_argument("--only", help="names such as motion-1,full-1 (default: all)")
    library.set_defaults(run=_library)
    return parser


def _add_test_options(parser):
    parser.add_argument("--functions", type=int, default=400, help="random functions a subset (default %(default)s)")
    parser.add_argument("--kind", choices=KINDS, default="step", help="kind of functions (default %(default)s)")
    parser.add_argument("--seed", type=int, default=0, help="seed of the functions (default %(default)s)")
    parser.add_argument("--sigmas", type=_numbers(float), default=SIGMAS, help="of the filters, as in 0,1,2,4")
    parser.add_argument("--layers", type=_numbers(int, 2), help="first and last one to look at, from 0, as in 0,3")


def _numbers(kind, count=None):
    """Return a parser of numbers separated by commas, as many as `count` if that is given."""

    def parse(text):
        try:
            numbers = tuple(map(kind, text.split(",")))
        except ValueError:
            numbers = ()
        if not numbers or count not in (None, len(numbers)):
            raise argparse.ArgumentTypeError(f"expected {count or 'some'} numbers such as 0,3, got {text!r}")
        return numbers

    return parse


def _pairs(key):
    """Return a parser of ``key=number,key=number`` into a dict."""

    def parse(text):
        try:
            return {key(name): float(number) for name, number in (part.split("=") for part in text.split(","))}
        except ValueError:
            raise argparse.ArgumentTypeError(f"expected key=number,key=number, got {text!r}") from None

    return parse


def _make(options, progress):
    names = ("frames", "steps", "weights", "scales", "candidates", "secondary")
    given = {name: getattr(options, name) for name in names}
    parameters = {name: value for name, value in given.items() if value is not None}
    dims = options.dims.split(",")
    check_path(options.out)
    tile = make_tile(options.method, options.size, dims, options.seed, options.samples, progress, **parameters)
    save_tile(tile, options.out)
    return {"files": [options.out]}


def _info(options, progress):
    tile = load_tile(options.file)
    print(f"{tile.size} x {tile.size} pixels, {tile.samples} sample(s), dimensions {', '.join(tile.dims)}")
    for key, value in sorted(tile.metadata.items()):
        print(f"{key}: {value if isinstance(value, str) else json.dumps(value)}")
    return {"size": tile.size, "samples": tile.samples, "dims": tile.dims, "metadata": dict(tile.metadata)}


def _print(lines):
    print("\n".join(lines))


def _looked_at(tile, options):
    return tile.layers(*options.layers) if options.layers else tile


def _test(options, progress):
    tile = _looked_at(load_tile(options.file), options)
    _print(step_test_lines(tile, options.sigmas, options.functions, options.seed, options.kind))


def _compare(options, progress):
    tiles = {}
    for argument in options.file:
        name, named, file = argument.partition("=")
        file = Path(file if named else argument)
        tile = load_array(file, options.dims.split(",")) if file.suffix == ".npy" else load_tile(file)
        tiles[name if named else file.stem] = _looked_at(tile, options)
    lines = comparison_lines(tiles, options.sigmas, options.functions, options.seed, options.kind)
    if options.out is None:
        _print(lines)
        return
    with replacing(options.out) as temporary:
        temporary.write_text("\n".join(lines) + "\n", encoding="utf-8")


def _analyse(options, progress):
    _print(analysis_lines(load_tile(options.file)))


def _plot(options, progress):
    stem = options.out or Path(options.file).with_suffix("")
    files = [str(file) for file in save_figures(load_tile(options.file), stem)]
    _print(files)
    return {"files": files}


def _library(options, progress):
    make_library(options.out, options.only and options.only.split(","), progress)


def write_summary(summary, path):
    """Write a summary of a command as JSON.

    Parameters
    ----------
    summary : dict
    path : str or None
        "-" is standard output; None is nowhere.

    Raises
    ------
    OSError
        If the file cannot be written.
    """
    if path == "-":
        print(json.dumps(summary), flush=True)
    elif path is not None:
        Path(path).write_text(json.dumps(summary), encoding="utf-8")


def main(arguments=None, program="python -m generator", tell=None):
    """Run the command line and return its exit code.

    Parameters
    ----------
    arguments : sequence of str, optional
        Instead of ``sys.argv[1:]``.
    program : str
        What the help calls it.
    tell : callable, optional
        Is given the part of a tile that is made, 0 to 1.

    Returns
    -------
    int
        0, or 2 after bad input (one line on standard error), or 130 after Ctrl-C (no partial file).
    """
    start = time.perf_counter()
    progress = ProgressBar(sys.stderr, tell=tell)
    summary, target = {}, None
    try:
        options = _parser(program).parse_args(arguments)
        summary["command"], target = options.command, getattr(options, "json", None)
        summary |= options.run(options, progress) or {}
        code = 0
    except (ValueError, OSError, MemoryError) as error:
        summary["error"] = " ".join(str(error).split()) or "not enough memory"
        code = EXIT_BAD_INPUT
    except KeyboardInterrupt:
        summary["error"] = f"interrupted {progress.reached()}, nothing half done is left"
        code = EXIT_INTERRUPTED
    if code:
        print("\n" * (code == EXIT_INTERRUPTED) + f"generator: {summary['error']}", file=sys.stderr)
    summary["seconds"] = round(time.perf_counter() - start, 3)
    try:
        write_summary(summary, target)
    except OSError as error:
        print(f"generator: {error}", file=sys.stderr)
        code = EXIT_BAD_INPUT
    return code
