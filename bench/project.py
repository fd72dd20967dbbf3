# SPDX-License-Identifier: GPL-3.0-or-later
"""Commands of the bench that are about the project itself: its picture, archive, release, limits, and what it tells."""

import argparse
import sys
from pathlib import Path


def add_commands(commands: argparse._SubParsersAction) -> None:
    """Add them to the bench's."""
    house = commands.add_parser("house", help="the picture of the add-on's wings, drawn from its imports")
    house.add_argument("--out", type=Path, default=Path("docs/house.png"), metavar="FILE", help="docs/house.png")
    house.set_defaults(run=_house)

    for name, run, about in (
        ("archive", _archive, "the extension's archive"),
        ("release", _release, "the archive, tried in Blender's module and in a window, and the release's notes"),
    ):
        made = commands.add_parser(name, help=about)
        made.add_argument("--out", type=Path, default=Path("dist"), metavar="FOLDER", help="where to, dist if not told")
        made.set_defaults(run=run)

    known = commands.add_parser("limits", help="how near rates come to those by known variance, on real .blend files")
    known.add_argument("folder", type=Path, metavar="FOLDER", help="with .blend files, also in folders inside")
    known.add_argument("--files", nargs="+", default=(), metavar="NAME", help="of those in the folder, all if not told")
    known.add_argument("--width", type=int, default=320, metavar="N", help="of the pictures in pixels")
    known.add_argument("--samples", type=int, default=16, help="mean samples of a pixel, a power of two")
    known.add_argument("--reference-samples", type=int, default=256, metavar="N", help="of each reference half")
    known.set_defaults(run=_limits)

    verified = commands.add_parser("verify", help="whether the figures that README and docs/ tell still hold")
    verified.add_argument("names", nargs="*", metavar="NAME", help="of docs/measurements.toml, all if not told")
    verified.add_argument("--quote", action="store_true", help="only put the numbers told into README and docs/")
    verified.set_defaults(run=_verify)


# Each imports what it needs when it is run: Blender's module takes seconds, and others leave it to their workers.


def _house(options: argparse.Namespace) -> str:
    from bench import house

    return house.draw(options.out)


def _archive(options: argparse.Namespace) -> str:
    from bench import archive

    return str(archive.build(options.out))


def _release(options: argparse.Namespace) -> str:
    from bench import release

    return release.make(options.out)


def _limits(options: argparse.Namespace) -> str:
    from bench import limits

    return limits.report(options.folder, options.files, options.width, options.samples, options.reference_samples)


def _verify(options: argparse.Namespace) -> str:
    from bench import verify

    if options.quote:
        verify.quote(verify.figures(), verify.documents())
        return "quoted"
    return verify.report(options.names, lambda quick: print(f"python -m {quick}", file=sys.stderr, flush=True))
