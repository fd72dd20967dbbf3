# SPDX-License-Identifier: GPL-3.0-or-later
"""The command line of the bench."""

import argparse
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from bench import (
    demo,
    errors,
    filters,
    flicker,
    frames,
    paper,
    project,
    quality,
    real,
    real_measuring,
    scene_costs,
    timing,
)
from bench.jobs import AUTOMATIC, RenderFailed, Settings
from bench.reference import QUICK_SAMPLES, SAMPLES
from bench.scene_files import scene_file
from bench.scenes import PRODUCTION, QUALITY
from bench.table import Progress
from demo_blend import PAPER

DEMO_SCENE = "wheels"
#: What the demo shows, how wide and at which noise threshold: noise in places, as in most frames.
SHOWN_SCENE, SHOWN_WIDTH, SHOWN_THRESHOLD = "round_lens", 400, 0.05
#: Timed by default: the demo, and a scene where a sample costs about three times as much.
TIMED, TIMED_SIZE = (DEMO_SCENE, "hazy_room"), (1920, 1080)
#: What Sub-Frames are for, and samples a pixel of their references, two of 256 moments each.
BLURRED, SUB_FRAMES_REFERENCE = tuple(f"demo_blend/{name}.blend" for name in ("swinging_lamp", "blinking_signs")), 256
#: The user guide's pictures of them.
SHOWN_SIZE, SHOWN_SAMPLES_AND_MOMENTS = (400, 225), (64, 32)
#: The demo and two scenes of other kinds.
FEW = (DEMO_SCENE, "metal", "still_life")
#: Small scenes and a production's, with and without volumes, hair and many lamps.
FLICKERING = ("room", "candles", "night_market", "creature")
#: What `report` measures if no files are named; and, with --quick, two kinds of noise.
DEMOS_FOLDER, QUICK_FILES, QUICK_WIDTH = Path("demo_blend"), ("interior", "round_lens"), 160
#: The paper's experiments as `report` has them; all but the scenes are told to `paper`.
EXPERIMENTS = paper.Effort(PAPER, 512, range(4), SAMPLES, (100,))
QUICK_EXPERIMENTS = paper.Effort(PAPER[:1], 128, range(2), 16, (32,))


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command and return the process's exit code."""
    options = _parser().parse_args(arguments)
    try:
        print(options.run(options))
    except (RenderFailed, ValueError) as error:
        print(f"bench: {error}", file=sys.stderr)
        return 1
    return 0


def _errors_and_times(options: argparse.Namespace) -> str:
    scene = scene_file(DEMO_SCENE)
    samples, seeds, pairs = ((1,), 2, 1) if options.quick else (options.samples, options.seeds, options.pairs)
    table = errors.report(scene, Settings(size=(512, 512)), samples, range(seeds), _reference_samples(options))
    return f"{table}\n\n{_timed(TIMED, Settings(size=TIMED_SIZE), pairs)}"


def _times(options: argparse.Namespace) -> str:
    settings = [
        Settings(samples=samples, size=tuple(options.size), method=options.method) for samples in options.samples
    ]
    return "\n\n".join(_timed(options.scenes, each, options.pairs) for each in settings)


def _timed(scenes: Sequence[str], settings: Settings, pairs: int) -> str:
    progress = Progress(2 * pairs * len(scenes))
    return str(timing.times([scene_file(name) for name in scenes], settings, pairs, progress.step))


def _quality(options: argparse.Namespace) -> str:
    size = (256, 256) if options.quick else (512, 512)
    settings = Settings(size=size, bounces=options.bounces, method=options.method)
    samples, seeds = ((1,), 2) if options.quick else (options.samples, options.seeds)
    scenes = [scene_file(name) for name in options.scenes]
    return quality.report(scenes, settings, samples, range(seeds), _reference_samples(options), options.native_only)


def _scenes(options: argparse.Namespace) -> str:
    return scene_costs.report([scene_file(name) for name in options.scenes], options.width, options.out)


def _flicker(options: argparse.Namespace) -> str:
    effort = flicker.Effort(
        options.samples,
        options.width,
        not options.fixed_seed,
        options.frames,
        options.reference_samples,
        options.seed,
        tuple(options.options),
    )
    return flicker.report([scene_file(name) for name in options.scenes], effort, options.json)


def _shares(options: argparse.Namespace) -> str:
    from bench import shares  # imports Blender, which the other commands leave to their workers

    return shares.report([scene_file(name) for name in options.scenes], options.size, range(options.seeds))


def _sub_frames(options: argparse.Namespace) -> str:
    from bench import sub_frames  # renders in this process

    scenes = [scene_file(name) for name in options.scenes]
    if options.docs:
        return sub_frames.write_pictures(scenes, SHOWN_SIZE, *SHOWN_SAMPLES_AND_MOMENTS)
    size, reference = tuple(options.size), options.reference_samples or SUB_FRAMES_REFERENCE
    return sub_frames.report(scenes, size, options.samples, options.moments, options.seeds, reference)


def _frames(options: argparse.Namespace) -> str:
    size = (256, 256) if options.quick else (512, 512)
    settings = Settings(samples=options.samples, size=size, still=True, gaussian=options.deviation)
    return frames.report([scene_file(name) for name in options.scenes], settings, _reference_samples(options))


def _filters(options: argparse.Namespace) -> str:
    settings = Settings(size=(options.size, options.size), gaussian=options.deviation)
    scenes = [scene_file(name) for name in options.scenes]
    return filters.report(scenes, settings, options.samples, range(options.seeds), _reference_samples(options))


def _demo(options: argparse.Namespace) -> str:
    scene = scene_file(options.scene)
    return demo.make(scene, options.width, options.threshold, options.reference_samples, options.out, options.docs)


def _paper(options: argparse.Namespace) -> str:
    if options.quick:
        effort = QUICK_EXPERIMENTS
    else:
        seeds, samples = range(options.seeds), options.reference_samples or SAMPLES
        effort = paper.Effort(options.experiments, options.lines, seeds, samples, options.spectrum)
    parts = paper.parts(effort, options.out, Progress(paper.steps(effort)))
    if options.docs:
        paper.write_docs(effort, parts)
    return "\n\n".join(map(str, parts))


def _real(options: argparse.Namespace) -> str:
    return real.report(options.folder, options.files, _real_effort(options), options.json, options.page)


def _report(options: argparse.Namespace) -> str:
    effort, experiments, names = _real_effort(options), EXPERIMENTS, options.files
    if options.quick:
        effort = replace(effort, width=options.width or QUICK_WIDTH, samples=(4, 16), thresholds=(0.1,))
        experiments = QUICK_EXPERIMENTS
        names = names or QUICK_FILES * (options.folder == DEMOS_FOLDER)
    if options.experiments is not None:
        experiments = replace(experiments, scenes=options.experiments)
    progress = Progress(paper.steps(experiments))
    return real.report(
        options.folder,
        names,
        effort,
        options.json,
        options.page,
        lambda folder: paper.parts(experiments, folder, progress),
    )


def _real_effort(options: argparse.Namespace) -> real_measuring.Effort:
    return real_measuring.Effort(
        options.width or (240 if options.quick else 640),
        options.samples,
        options.thresholds,
        options.seeds,
        options.repeats,
        options.reference_samples,
        20 if options.quick else options.reference_seconds,
        options.native_only,
        tuple(options.options),
    )


def _cycles_tile(options: argparse.Namespace) -> str:
    from bench import cycles_tile  # imports Blender, which the other commands leave to their workers

    return cycles_tile.write(options.out, options.size, options.dims.split(","), options.samples, options.seed)


def _reference_samples(options: argparse.Namespace) -> int:
    return options.reference_samples or (QUICK_SAMPLES if options.quick else SAMPLES)


def _counts(text: str) -> tuple[int, ...]:
    """Parse comma-separated positive numbers."""
    counts = tuple(int(part) for part in text.split(","))
    if min(counts) < 1:
        raise argparse.ArgumentTypeError("counts start at 1")
    return counts


def _thresholds(text: str) -> tuple[float, ...]:
    """Parse comma-separated noise thresholds."""
    thresholds = tuple(float(part) for part in text.split(","))
    if not all(0.0 < each <= 1.0 for each in thresholds):
        raise argparse.ArgumentTypeError("thresholds are above 0 and at most 1")
    return thresholds


def _option(text: str) -> tuple[str, str]:
    """Parse NAME=VALUE."""
    name, equals, value = text.partition("=")
    if not (name.isidentifier() and equals):
        raise argparse.ArgumentTypeError(f"not NAME=VALUE: {text}")
    return name, value


def _bounces(text: str) -> int | None:
    return None if text == "own" else int(text)


def _parser() -> argparse.ArgumentParser:
    quick = argparse.ArgumentParser(add_help=False)
    quick.add_argument("--quick", action="store_true", help="few seeds, rough references: minutes, not hours")
    quick.add_argument(
        "--reference-samples",
        type=int,
        metavar="N",
        help=f"samples a pixel of each reference half, {SAMPLES} if not told",
    )

    parser = argparse.ArgumentParser(
        prog="python -m bench",
        parents=[quick],
        description="Measure Spectral Tiles against Cycles; without a command, errors on the demo and wall times.",
    )
    parser.add_argument("--samples", type=_counts, default=(1, 2, 4), help="samples a pixel, as in 1,2,4")
    parser.add_argument("--seeds", type=int, default=4, help="images of each and sample count")
    parser.add_argument("--pairs", type=int, default=5, help="pairs of timed processes")
    parser.set_defaults(run=_errors_and_times)
    commands = parser.add_subparsers(title="commands", metavar="COMMAND")

    driven = argparse.ArgumentParser(add_help=False)
    driven.add_argument("--method", choices=("GATHER", "IN_PLACE"), default="GATHER", help="of ours")

    over_scenes = commands.add_parser("quality", parents=[quick, driven], help="error ratios over all scenes")
    over_scenes.add_argument("--scenes", nargs="+", default=QUALITY, metavar="SCENE", help="names or .blend files")
    over_scenes.add_argument("--samples", type=_counts, default=(1, 2, 4, 16), help="samples a pixel, as in 1,2,4,16")
    over_scenes.add_argument("--bounces", type=_bounces, default=None, help="'own' (the scene's) or a number")
    over_scenes.add_argument("--seeds", type=int, default=4, help="images of each and sample count")
    over_scenes.add_argument("--native-only", action="store_true", help=f"only {AUTOMATIC} against Tabulated Sobol")
    over_scenes.set_defaults(run=_quality)

    built = commands.add_parser("scenes", help="microseconds a sample of scenes, and their files for `real`")
    built.add_argument("--scenes", nargs="+", default=PRODUCTION, metavar="SCENE", help="names or .blend files")
    built.add_argument("--width", type=int, default=240, metavar="N", help="of the timed pictures in pixels")
    built.add_argument("--out", type=Path, metavar="DIR", help="write the .blend files there instead")
    built.set_defaults(run=_scenes)

    sources = commands.add_parser("shares", help="which random numbers the noise of scenes comes from")
    sources.add_argument("--scenes", nargs="+", default=QUALITY, metavar="SCENE", help="names or .blend files")
    sources.add_argument("--size", type=int, default=256, metavar="N", help="width and height in pixels")
    sources.add_argument("--seeds", type=int, default=64, help="renders of each scene")
    sources.set_defaults(run=_shares)

    few = argparse.ArgumentParser(add_help=False, parents=[quick])
    few.add_argument("--scenes", nargs="+", default=FEW, metavar="SCENE", help="names or .blend files")
    few.add_argument("--size", type=int, default=256, metavar="N", help="width and height in pixels")
    few.add_argument("--seeds", type=int, default=4, help="images of each and sample count")

    filtered = commands.add_parser("filters", parents=[few], help="samples shared by a filter's pixels against native")
    filtered.add_argument("--samples", type=_counts, default=(1, 2, 4), help="samples a pixel, as in 1,2,4")
    filtered.add_argument("--deviation", type=float, default=0.5, help="of the Gaussian, in pixels")
    filtered.set_defaults(run=_filters)

    times = commands.add_parser("times", help="wall time and memory against native")
    times.add_argument("--scenes", nargs="+", default=TIMED, metavar="SCENE", help="names or .blend files")
    times.add_argument("--pairs", type=int, default=5, help="pairs of timed processes")
    times.add_argument("--samples", type=_counts, default=(1,), help="samples a pixel, as in 1,4,16")
    times.add_argument("--size", type=int, nargs=2, default=TIMED_SIZE, metavar=("W", "H"), help="in pixels")
    times.add_argument("--method", default="GATHER", choices=("AUTO", "IN_PLACE", "GATHER"), help="of ours")
    times.set_defaults(run=_times)

    blurred = commands.add_parser("sub-frames", parents=[quick], help="Sub-Frames against renders averaged by hand")
    blurred.add_argument("--scenes", nargs="+", default=BLURRED, metavar="SCENE", help="names or .blend files")
    blurred.add_argument("--size", type=int, nargs=2, default=(640, 360), metavar=("W", "H"), help="in pixels")
    blurred.add_argument("--samples", type=int, default=16, help="samples a pixel, and renders by hand")
    blurred.add_argument("--moments", type=_counts, default=(8, 16, 32, 64), help="moments, as in 8,16,32,64")
    blurred.add_argument("--seeds", type=int, default=3, help="pictures of each")
    blurred.add_argument("--docs", action="store_true", help="only renew the user guide's pictures")
    blurred.set_defaults(run=_sub_frames)

    animation = commands.add_parser("frames", parents=[quick], help="error of the mean of frames of still scenes")
    animation.add_argument("--scenes", nargs="+", default=QUALITY, metavar="SCENE", help="names or .blend files")
    animation.add_argument("--samples", type=int, default=1, help="samples a pixel of each frame")
    animation.add_argument("--deviation", type=float, default=0.0, help="of a Gaussian in pixels, 0 for Cycles' box")
    animation.set_defaults(run=_frames)

    change = commands.add_parser("flicker", help="how errors change from frame to frame, denoised, in the same time")
    change.add_argument("--scenes", nargs="+", default=FLICKERING, metavar="SCENE", help="names or .blend files")
    change.add_argument("--samples", type=int, default=16, help="samples a pixel of each of Cycles' frames")
    change.add_argument("--frames", type=int, default=8, help="with a moving camera, and as many at rest")
    change.add_argument("--width", type=int, default=320, metavar="N", help="of the pictures in pixels")
    change.add_argument("--seed", type=int, default=0, help="of Cycles")
    change.add_argument("--fixed-seed", action="store_true", help="the same seed in all frames")
    change.add_argument("--reference-samples", type=int, default=256, metavar="N", help="of each reference half")
    change.add_argument("--json", type=Path, metavar="FILE", help="write all figures")
    change.add_argument(
        "--set", dest="options", nargs="+", type=_option, default=(), metavar="NAME=VALUE", help="settings of ours"
    )
    change.set_defaults(run=_flicker)

    pictures = commands.add_parser("demo", help="one scene by Cycles and by ours in the same time, as pictures")
    pictures.add_argument("--out", type=Path, required=True, metavar="DIR", help="folder of the pictures")
    pictures.add_argument("--scene", default=SHOWN_SCENE, help="name or .blend file")
    pictures.add_argument("--width", type=int, default=SHOWN_WIDTH, metavar="N", help="of the pictures in pixels, 400")
    pictures.add_argument("--threshold", type=float, default=SHOWN_THRESHOLD, help="noise threshold of both, .05")
    pictures.add_argument("--reference-samples", type=int, default=128, help="samples a pixel of each reference half")
    pictures.add_argument("--docs", action="store_true", help="renew README's picture, too")
    pictures.set_defaults(run=_demo)

    paper_figures = commands.add_parser("paper", parents=[quick], help="the paper's experiments, rendered by Cycles")
    paper_figures.add_argument(
        "--out", type=Path, default=Path("out/paper"), metavar="DIR", help="folder of the pictures"
    )
    paper_figures.add_argument(
        "--scenes", dest="experiments", nargs="+", choices=PAPER, default=PAPER, metavar="SCENE", help=", ".join(PAPER)
    )
    paper_figures.add_argument("--lines", type=int, default=512, help="width and height of the pictures, 512")
    paper_figures.add_argument("--seeds", type=int, default=4, help="images of each sampler")
    paper_figures.add_argument(
        "--spectrum", type=_counts, default=(100,), metavar="N", help="samples of the spectra's references, as 100,4096"
    )
    paper_figures.add_argument("--docs", action="store_true", help="renew the spectra and table of the docs too")
    paper_figures.set_defaults(run=_paper)

    files = argparse.ArgumentParser(add_help=False)
    files.add_argument("--files", nargs="+", default=(), metavar="NAME", help="of those in the folder, all if not told")
    files.add_argument("--quick", action="store_true", help="small pictures and rough references")
    files.add_argument("--width", type=int, metavar="N", help="of the pictures in pixels, 640 (240 with --quick)")
    files.add_argument("--samples", type=_counts, default=(1, 4, 16, 64), help="samples a pixel, as in 1,4,16,64")
    files.add_argument("--thresholds", type=_thresholds, default=(0.1, 0.03), help="noise thresholds, as in .1,.03")
    files.add_argument("--seeds", type=int, default=1, help="pictures at each setting")
    files.add_argument("--repeats", type=int, default=1, help="how often each picture is rendered, for its time")
    files.add_argument("--native-only", action="store_true", help="leave ours out")
    files.add_argument("--json", type=Path, metavar="FILE", help="write all figures")
    files.add_argument(
        "--reference-samples",
        type=int,
        default=real_measuring.Effort.reference_samples,
        metavar="N",
        help="largest samples a pixel of each half of a reference",
    )
    files.add_argument(
        "--reference-seconds",
        type=int,
        default=real_measuring.Effort.reference_seconds,
        metavar="S",
        help=f"processor time of each half of a reference, but at least {real_measuring.FEWEST} samples a pixel",
    )
    files.add_argument(
        "--set", dest="options", nargs="+", type=_option, default=(), metavar="NAME=VALUE", help="settings of ours"
    )

    measured = commands.add_parser("real", parents=[files], help="real .blend files: time to equal error")
    measured.add_argument("folder", type=Path, metavar="FOLDER", help="with .blend files, also in folders inside")
    measured.add_argument("--page", type=Path, metavar="DIR", help="write a page with crops at equal time")
    measured.set_defaults(run=_real)

    page = commands.add_parser("report", parents=[files], help="the same as one page, with the paper's experiments")
    page.add_argument("folder", type=Path, nargs="?", default=DEMOS_FOLDER, metavar="FOLDER", help=f"{DEMOS_FOLDER}")
    page.add_argument(
        "--out", dest="page", type=Path, default=Path("out/report"), metavar="DIR", help="folder of page and pictures"
    )
    page.add_argument("--experiments", nargs="*", choices=PAPER, metavar="SCENE", help="of the paper, all if not told")
    page.set_defaults(run=_report)

    cycles = commands.add_parser("cycles-tile", help="Cycles' own blue noise as a tile for `generator compare`")
    cycles.add_argument("--size", type=int, default=64, help="side in pixels")
    cycles.add_argument("--dims", default="t,lens.u,lens.v,light.u,light.v", help="names, comma-separated")
    cycles.add_argument("--samples", type=int, default=1, help="samples of a pixel")
    cycles.add_argument("--seed", type=int, default=0, help="Cycles' seed")
    cycles.add_argument("--out", required=True, help="tile to write, .npz or .exr")
    cycles.set_defaults(run=_cycles_tile)

    project.add_commands(commands)
    return parser


if __name__ == "__main__":
    sys.exit(main())
