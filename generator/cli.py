"""The command line: ``python -m generator make | info | test``."""

import argparse
import json
import sys

from .dimensions import DIMENSIONS
from .methods import METHODS, make_tile
from .progress import ProgressBar
from .step_test import SIGMAS, step_test
from .test_functions import KINDS
from .tile import GENERATOR_VERSION
from .tile_file import check_path, load_tile, save_tile

EXIT_BAD_INPUT = 2
EXIT_INTERRUPTED = 130


class _Parser(argparse.ArgumentParser):
    """A parser that says what is wrong in one line, without the usage."""

    def error(self, message):
        raise ValueError(message)


def _parser():
    parser = _Parser(prog="python -m generator", description="Makes and judges sample tiles.")
    parser.add_argument("--version", action="version", version=GENERATOR_VERSION)
    commands = parser.add_subparsers(dest="command", required=True)

    make = commands.add_parser("make", help="make a tile")
    make.add_argument("--size", type=int, default=64, help="side of the tile in pixels (default %(default)s)")
    make.add_argument("--dims", default=",".join(DIMENSIONS[:5]), help="names, comma-separated (default %(default)s)")
    make.add_argument("--method", choices=METHODS, default="spectral", help="default %(default)s")
    make.add_argument("--samples", type=int, default=1, help="samples of a pixel (default %(default)s)")
    make.add_argument("--seed", type=int, default=0, help="default %(default)s")
    make.add_argument("--frames", type=int, help="frames of a looped animation (spectral only)")
    make.add_argument("--steps", type=int, help="steps of the spectral optimiser")
    make.add_argument("--weights", type=_pairs(str), help="of subsets, such as t=2,t+light=0.5 (spectral only)")
    make.add_argument("--scales", type=_pairs(float), help="sigma=weight of the low-pass filters (spectral only)")
    make.add_argument("--out", required=True, help="file to write, .npz or .exr")
    make.set_defaults(run=_make)

    info = commands.add_parser("info", help="say what a tile holds and how it was made")
    info.add_argument("file")
    info.set_defaults(run=_info)

    test = commands.add_parser("test", help="print the step test's table; 1 is white noise, lower is better")
    test.add_argument("file")
    test.add_argument("--functions", type=int, default=400, help="random functions a subset (default %(default)s)")
    test.add_argument("--kind", choices=KINDS, default="step", help="kind of functions (default %(default)s)")
    test.add_argument("--seed", type=int, default=0, help="seed of the functions (default %(default)s)")
    test.set_defaults(run=_test)
    return parser


def _pairs(key):
    """Return a parser of ``key=number,key=number`` into a dict."""

    def parse(text):
        try:
            return {key(name): float(number) for name, number in (part.split("=") for part in text.split(","))}
        except ValueError:
            raise argparse.ArgumentTypeError(f"expected key=number,key=number, got {text!r}") from None

    return parse


def _make(options, progress):
    given = {name: getattr(options, name) for name in ("frames", "steps", "weights", "scales")}
    parameters = {name: value for name, value in given.items() if value is not None}
    dims = options.dims.split(",")
    check_path(options.out)
    tile = make_tile(options.method, options.size, dims, options.seed, options.samples, progress, **parameters)
    save_tile(tile, options.out)


def _info(options, progress):
    tile = load_tile(options.file)
    print(f"{tile.size} x {tile.size} pixels, {tile.samples} sample(s), dimensions {', '.join(tile.dims)}")
    for key, value in sorted(tile.metadata.items()):
        print(f"{key}: {value if isinstance(value, str) else json.dumps(value)}")


def _test(options, progress):
    table = step_test(load_tile(options.file), SIGMAS, options.functions, options.seed, options.kind)
    width = max(map(len, table))
    print(" " * width, *(f"sigma {sigma:g}" for sigma in SIGMAS), sep="  ")
    for label, errors in table.items():
        print(f"{label:{width}}", *(f"{error:7.3f}" for error in errors), sep="  ")


def main(arguments=None):
    """Run the command line and return its exit code.

    Parameters
    ----------
    arguments : sequence of str, optional
        Instead of ``sys.argv[1:]``.

    Returns
    -------
    int
        0, or 2 after bad input (one line on standard error), or 130 after Ctrl-C (nothing written).
    """
    progress = ProgressBar(sys.stderr)
    try:
        options = _parser().parse_args(arguments)
        options.run(options, progress)
    except (ValueError, OSError) as error:
        print(f"generator: {' '.join(str(error).split())}", file=sys.stderr)
        return EXIT_BAD_INPUT
    except KeyboardInterrupt:
        print(f"\ngenerator: interrupted {progress.reached()}, no file written", file=sys.stderr)
        return EXIT_INTERRUPTED
    return 0
