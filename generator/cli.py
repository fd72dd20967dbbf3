"""The command line: ``python -m generator make | info | test | compare | analyse | plot | library``."""

import argparse
import contextlib
import json
import os
import sys
import time
import traceback
from pathlib import Path

from .atomic_file import NotWritten, check_writable, would_replace, written_whole
from .dimensions import DIMENSIONS
from .library import make_library
from .messages import one_line, quoted
from .methods import LARGEST_SEED, METHODS, make_tile
from .plots import save_figures
from .progress import ProgressBar
from .scanning import MOST_CANDIDATES
from .spectral import LARGEST_SIGMA, LARGEST_WEIGHT, MOST_FRAMES, MOST_POINTS, MOST_SIDE_TIMES_FRAMES, MOST_STEPS
from .step_test import MOST_FUNCTIONS, SIGMAS
from .tables import analysis_lines, comparison_lines, step_test_lines
from .test_functions import KINDS
from .tile import GENERATOR_VERSION, LARGEST_SIDE, MOST_SAMPLES, MOST_VALUES
from .tile_file import check_path, load_array, load_tile, save_tile

EXIT_FAILED = 1
EXIT_BAD_INPUT = 2
EXIT_INTERRUPTED = 130

_MOST_COMPARED = 64  # tiles
_MOST_SIGMAS = 16


class _Parser(argparse.ArgumentParser):
    """A parser that says what is wrong in one line, without the usage."""

    def error(self, message):
        raise ValueError(message)


def _parser(program):
    parser = _Parser(
        prog=program,
        description="Makes and judges sample tiles.",
        epilog="Exit codes: 0 done, 1 not enough memory or a file could not be written, 2 bad input, 130 interrupted.",
    )
    parser.add_argument("--version", action="version", version=GENERATOR_VERSION)
    commands = parser.add_subparsers(dest="command", required=True)
    summary = argparse.ArgumentParser(add_help=False)
    summary.add_argument("--json", metavar="FILE", help="write a summary there when done; - is standard output")

    make = commands.add_parser(
        "make",
        parents=[summary],
        help="make a tile",
        epilog=f"Pixels, samples and dimensions together: at most {MOST_VALUES} numbers. The spectral method takes at "
        f"most {MOST_POINTS} pixels times samples or frames, and {MOST_SIDE_TIMES_FRAMES} pixels a side times frames.",
    )
    _add_whole(make, "--size", 1, LARGEST_SIDE, "side of the tile in pixels", 64)
    make.add_argument("--dims", default=",".join(DIMENSIONS[:5]), help="names, comma-separated (default %(default)s)")
    make.add_argument("--method", choices=METHODS, default="spectral", help="default %(default)s")
    _add_whole(make, "--samples", 1, MOST_SAMPLES, "samples of a pixel", 1)
    _add_whole(make, "--seed", 0, LARGEST_SEED, "another one makes another tile", 0)
    _add_whole(make, "--frames", 1, MOST_FRAMES, "frames of a looped animation (spectral only)")
    _add_whole(make, "--steps", 1, MOST_STEPS, "steps of the spectral optimiser")
    limit = f"0 to {LARGEST_WEIGHT:g}"
    make.add_argument("--weights", type=_pairs(str), help=f"of subsets, as in t=2,t+light=0.5, {limit} (spectral only)")
    make.add_argument(
        "--scales",
        type=_pairs(float),
        help=f"sigma=weight of the low-pass filters, sigma from 0 to {LARGEST_SIGMA:g}, weight {limit} (spectral only)",
    )
    _add_whole(make, "--candidates", 1, MOST_CANDIDATES, "tried for each sample (scanning methods, film-positions)")
    _add_whole(make, "--secondary", 1, MOST_CANDIDATES, "of the candidates, kept for the outer ring (scanning only)")
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
    compare.add_argument("file", nargs="+", help=f"tile, or NAME=tile; also .npy arrays; at most {_MOST_COMPARED}")
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


def _add_whole(parser, name, least, most, text, default=None):
    """Add an option that takes a whole number within bounds, which its help tells."""
    text += f", {least} to {most}" + (" (default %(default)s)" if default is not None else "")
    parser.add_argument(name, type=whole(least, most), default=default, metavar="N", help=text)


def _add_test_options(parser):
    _add_whole(parser, "--functions", 1, MOST_FUNCTIONS, "random functions a subset", 400)
    parser.add_argument("--kind", choices=KINDS, default="step", help="kind of functions (default %(default)s)")
    _add_whole(parser, "--seed", 0, LARGEST_SEED, "seed of the functions", 0)
    parser.add_argument(
        "--sigmas",
        type=_numbers(float),
        default=SIGMAS,
        help=f"of the filters, as in 0,1,2,4; 0 to {LARGEST_SIGMA:g}, at most {_MOST_SIGMAS}",
    )
    parser.add_argument("--layers", type=_numbers(int, 2), help="first and last one to look at, from 0, as in 0,3")


def whole(least, most):
    """Return a parser of whole numbers within bounds."""

    def parse(text):
        try:
            number = int(text)
        except ValueError:
            number = None
        if number is None or not least <= number <= most:
            raise argparse.ArgumentTypeError(f"expected a whole number from {least} to {most}, got {quoted(text)}")
        return number

    return parse


def _numbers(kind, count=None):
    """Return a parser of numbers separated by commas, as many as `count` if that is given."""

    def parse(text):
        try:
            numbers = tuple(map(kind, text.split(",", _MOST_SIGMAS)))
        except ValueError:
            numbers = ()
        if not numbers or count not in (None, len(numbers)):
            raise argparse.ArgumentTypeError(f"expected {count or 'some'} numbers such as 0,3, got {quoted(text)}")
        if len(numbers) > _MOST_SIGMAS:
            raise argparse.ArgumentTypeError(f"expected at most {_MOST_SIGMAS} numbers, got {quoted(text)}")
        return numbers

    return parse


def _pairs(key):
    """Return a parser of ``key=number,key=number`` into a dict."""

    def parse(text):
        try:
            return {key(name): float(number) for name, number in (part.split("=") for part in text.split(",", 1000))}
        except ValueError:
            raise argparse.ArgumentTypeError(f"expected key=number,key=number, got {quoted(text)}") from None

    return parse


def _names(text):
    """Return the names in a list separated by commas."""
    return text.split(",", 1000)


def _check_apart(option, file, *others):
    """Raise a ValueError if `file` is one of the other files, which it would overwrite; None is none."""
    if would_replace(file, *others):
        raise ValueError(f"{option}: expected another file than the tile's, got {quoted(str(file), 80)}")


def _check_summary(options):
    """Raise a ValueError or an OSError if there cannot be a summary, and let there be none."""
    path, options.json = getattr(options, "json", None), None
    if path not in (None, "-"):
        check_writable(path)
        _check_apart("--json", path, getattr(options, "file", None), getattr(options, "out", None))
    options.json = path


def _make(options, progress):
    names = ("frames", "steps", "weights", "scales", "candidates", "secondary")
    given = {name: getattr(options, name) for name in names}
    parameters = {name: value for name, value in given.items() if value is not None}
    check_path(options.out)
    dims = _names(options.dims)
    tile = make_tile(options.method, options.size, dims, options.seed, options.samples, progress, **parameters)
    save_tile(tile, options.out)
    return {"files": [options.out]}


def _info(options, progress):
    tile = load_tile(options.file)
    lines = [f"{tile.size} x {tile.size} pixels, {tile.samples} sample(s), dimensions {', '.join(tile.dims)}"]
    for key, value in sorted(tile.metadata.items()):
        text = value if isinstance(value, str) else json.dumps(value)
        lines.append(f"{one_line(key, 60)}: {one_line(text, 1000)}")
    _print(lines)
    return {"size": tile.size, "samples": tile.samples, "dims": tile.dims, "metadata": dict(tile.metadata)}


def _print(lines):
    """Print lines; raises NotWritten where standard output cannot take them."""
    try:
        print("\n".join(lines), flush=True)
    except OSError as error:
        raise NotWritten(f"standard output: not written ({error.strerror})") from error


def _looked_at(tile, options):
    return tile.layers(*options.layers) if options.layers else tile


def _test(options, progress):
    tile = _looked_at(load_tile(options.file), options)
    _print(step_test_lines(tile, options.sigmas, options.functions, options.seed, options.kind, progress))


def _compare(options, progress):
    if len(options.file) > _MOST_COMPARED:
        raise ValueError(f"file: expected at most {_MOST_COMPARED} tiles, got {len(options.file)}")
    if options.out is not None:
        check_writable(options.out)
    tiles = {}
    for argument in options.file:
        name, named, file = argument.partition("=")
        file = Path(file if named else argument)
        name = name if named else file.stem
        if name in tiles:
            raise ValueError(
                f"file: expected tiles of different names, got {quoted(name)} twice; NAME=tile gives another"
            )
        _check_apart("--out", options.out, file)
        tile = load_array(file, _names(options.dims)) if file.suffix == ".npy" else load_tile(file)
        tiles[name] = _looked_at(tile, options)
    lines = comparison_lines(tiles, options.sigmas, options.functions, options.seed, options.kind, progress)
    if options.out is None:
        _print(lines)
        return
    with written_whole(options.out) as temporary:
        temporary.write_text("\n".join(lines) + "\n", encoding="utf-8")


def _analyse(options, progress):
    _print(analysis_lines(load_tile(options.file)))


def _plot(options, progress):
    stem = options.out or Path(options.file).with_suffix("")
    files = [str(file) for file in save_figures(load_tile(options.file), stem, progress)]
    _print(files)
    return {"files": files}


def _library(options, progress):
    make_library(options.out, None if options.only is None else _names(options.only), progress)


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
        _print([json.dumps(summary)])
    elif path is not None:
        with written_whole(path) as temporary:
            temporary.write_text(json.dumps(summary), encoding="utf-8")


def _run(options, progress, summary):
    """Run a command, enter what it tells into the summary, and return the exit code."""
    try:
        _check_summary(options)
        summary |= options.run(options, progress) or {}
        progress.finish()
        return 0
    except (ValueError, OSError, MemoryError) as error:
        summary["error"] = one_line(error, _LONGEST) or "not enough memory"
        return EXIT_FAILED if isinstance(error, NotWritten | MemoryError) else EXIT_BAD_INPUT
    except KeyboardInterrupt:
        summary["error"] = f"interrupted {progress.reached()}, nothing half done is left"
        return EXIT_INTERRUPTED
    except Exception as error:  # a mistake of ours: the line tells where, for whoever is sent it
        place = traceback.extract_tb(error.__traceback__)[-1]
        where = f"{os.path.basename(place.filename)}, line {place.lineno}"
        summary["error"] = one_line(f"failed, please report this ({where}): {type(error).__name__}: {error}", _LONGEST)
        return EXIT_FAILED


_PREFIX = "generator: "
_LONGEST = 200 - len(_PREFIX)


def _complain(text):
    with contextlib.suppress(OSError):
        print(_PREFIX + one_line(text, _LONGEST), file=sys.stderr)


def ended(code):
    """Write what standard output still holds, and return a command's exit code: a failure if that fails."""
    try:
        sys.stdout.flush()
    except OSError:  # which would come a second time, as a warning, when Python ends
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return code or EXIT_FAILED
    return code


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
        0; 1 if a file could not be written or the memory does not suffice; 2 after bad input; 130 after Ctrl-C. All
        but 0 come with one line of at most 200 characters on standard error, and no file is half written.
    """
    try:
        return _main(arguments, program, ProgressBar(sys.stderr, tell=tell))
    except KeyboardInterrupt:  # before a command runs, or after it has
        _complain("interrupted, nothing half done is left")
        return EXIT_INTERRUPTED


def _main(arguments, program, progress):
    start = time.perf_counter()
    try:
        options = _parser(program).parse_args(arguments)
    except ValueError as error:
        _complain(error)
        return EXIT_BAD_INPUT
    summary = {"command": options.command}
    code = _run(options, progress, summary)
    if code:
        print(end="\n" * (code == EXIT_INTERRUPTED), file=sys.stderr)
        _complain(summary["error"])
    summary["seconds"] = round(time.perf_counter() - start, 3)
    try:
        write_summary(summary, options.json)
    except (ValueError, OSError) as error:
        if not code:
            _complain(error)
            code = EXIT_FAILED if isinstance(error, NotWritten) else EXIT_BAD_INPUT
    return code
