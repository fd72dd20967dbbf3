# SPDX-License-Identifier: GPL-3.0-or-later
"""``python -m bench report``: where we stand against Cycles, on one page."""

import os
import platform
import statistics
from collections.abc import Callable, Sequence
from dataclasses import replace
from datetime import date
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure

from bench import doubts, paper
from bench.crops import crop
from bench.doc_parts import write_picture, write_table
from bench.document import DPI, Heading, Pictures, Plot, Table, page
from bench.jobs import AUTOMATIC, TABULATED, TILES, Settings, blender_version, engine_state, picture
from bench.metrics import Ratio
from bench.scene_files import ROOT, scene_file
from bench.scene_results import COLUMN, COMPARED, LABELS, SCENES, SIGMA, Effort, Results, results
from bench.table import Progress
from bench.timing import times

QUICK_SCENES = ("motion_blur", "moving_penumbra", "interior")


def make(effort: Effort, experiments: paper.Effort, folder: Path, docs: bool) -> Path:
    """Write the page and its pictures to a folder and return the page's path.

    Parameters
    ----------
    effort : Effort
        Of the scenes.
    experiments : bench.paper.Effort
        Of the paper's experiments.
    folder : Path
        Where to; made if missing.
    docs : bool
        Also renew the pictures and the table of docs/.
    """
    pictures = folder / "pictures"
    pictures.mkdir(parents=True, exist_ok=True)
    progress = Progress(effort.steps + paper.steps(experiments) + 2)
    found = [results(name, effort, pictures, progress) for name in effort.scenes]
    progress.step("where Cycles is better")
    worse = doubts.looked_at_again(found, effort.settings, effort.seeds, progress)
    progress.step("wall times of large frames")
    timed = times([scene_file("wheels")], Settings(size=effort.large), effort.pairs, progress.say)
    summary = _summary(found, effort)
    seeds = f"{len(effort.seeds)} seeds ± standard error"
    parts = [
        *_heroes(found, effort),
        Heading(
            "At equal samples",
            f"Mean square error of luminance after a Gaussian of {SIGMA} pixel, which stands for the eye, over that of "
            "Cycles' automatic pattern at the same number of samples. Below 1 is better. An exclamation mark: worse by "
            "more than two standard errors.",
        ),
        summary,
        _ratios(
            f"The same over Cycles' Tabulated Sobol, which is white noise over the image, {seeds}",
            "over white noise",
            found,
            effort,
            lambda one, count: one.over(TABULATED, count),
        ),
        *doubts.parts(worse),
        Heading(
            "At equal time",
            "Spectral Tiles takes longer for a sample. Cycles' error is read from its own curve of error over samples, "
            "between those measured, at the number that it renders while Spectral Tiles renders these. Wall times of "
            f"frames of {effort.timed_lines}x{effort.timed_lines} pixels, the plan being made already; what it takes "
            f"longer for weighs less in more samples, but from {COMPARED} spp on the ratio of {COMPARED} spp is taken.",
        ),
        _ratios(
            f"Mean square error at sigma {SIGMA} over Cycles' in equal time, {seeds} (of the errors)",
            "over Cycles",
            found,
            effort,
            Results.at_equal_time,
        ),
        _time_ratios(found, effort),
        timed,
        Heading("Convergence"),
        Plot(
            f"Root mean square error at sigma {SIGMA} over samples a pixel, both scales logarithmic, {seeds}",
            _convergence(found, effort, pictures),
        ),
        Heading(
            "Denoised, adaptive",
            f"At {COMPARED} samples a pixel, {seeds}. Cycles' adaptive sampling has that as its largest number and the "
            "scene's own threshold. It first looks at the noise after more samples than that, so that it changes "
            "nothing here.",
        ),
        *_variants(found),
        *paper.parts(experiments, pictures, progress),
        Heading("Tiles", "The step test; lower is better. From docs/tiles.md, made as generator/README.md says."),
        tiles_table(),
        Heading(
            "Scene by scene",
            "First seed, through each scene's own view, each pixel enlarged to a square. Pictures at equal time have "
            "the nearest whole number of samples.",
        ),
        *(one.pictures for one in found),
        Heading("How this was measured", _conditions(effort)),
    ]
    path = folder / "report.html"
    path.write_text(page("Spectral Tiles against Cycles", _lead(found, effort, worse), parts), encoding="utf-8")
    if docs:
        _write_docs(summary, effort)
    return path


# --- In a minute -----------------------------------------------------------------------------------------------------


def _lead(found: Sequence[Results], effort: Effort, worse: Sequence[doubts.Doubt]) -> str:
    """Return the page's summary."""
    counts = sorted({min(effort.samples), max(effort.samples)})

    def span(value: Callable[[Results, int], Ratio]) -> str:
        each = {count: [value(one, count).value for one in found] for count in counts}
        return ", ".join(
            f"{np.median(values):.2f} at {count} spp ({min(values):.2f} to {max(values):.2f})"
            for count, values in each.items()
        )

    confirmed = ", ".join(f"{doubt.name} at {doubt.samples} spp" for doubt in worse if doubt.is_confirmed)
    ratios = [one.over(AUTOMATIC, count) for one in found for count in effort.samples]
    undecided = sum(r.value > 1 and not doubts.is_worse(r) for r in ratios)
    return (
        "Noise that is left to the eye, over what Cycles' own blue noise leaves. With as many samples a pixel (spp): "
        f"{span(lambda one, count: one.over(AUTOMATIC, count))}. In the same time: {span(Results.at_equal_time)}. "
        f"Median and range of {len(found)} scenes, {len(effort.seeds)} seeds each.\n"
        f"More noise than Cycles with as many samples, beyond chance: {confirmed or 'nowhere measured'}. "
        f"{undecided} of {len(ratios)} figures are above 1 by less than two standard errors."
    )


def _heroes(found: Sequence[Results], effort: Effort) -> list[Pictures]:
    """Return the scenes where it surely helps most and least at the fewest samples, chosen by the figures."""
    least = min(effort.samples)

    def bound(one: Results, side: int) -> float:
        found = one.over(AUTOMATIC, least)
        return found.value + side * 2 * found.spread

    chosen = {"most": min(found, key=lambda one: bound(one, 1)), "least": max(found, key=lambda one: bound(one, -1))}
    return [
        Pictures(f"Helps {how}: {one.scene.name}, {one.over(AUTOMATIC, least)} of Cycles' error", [one.hero])
        for how, one in list(chosen.items())[: len(found)]
    ]


def _conditions(effort: Effort) -> str:
    return (
        f"Blender {blender_version()}, CPU: {_processor()}, {os.cpu_count()} threads, {platform.system()}, "
        f"engine state {engine_state()}, {date.today():%d %B %Y}.\n"
        f"{effort.lines}x{effort.lines} pixels, box filter of one pixel, the scenes' own bounces. References: two "
        f"halves of {effort.reference_samples} samples a pixel by native Cycles, whose own noise is taken out of the "
        "figures by multiplying the errors against one half and the other. Every engine renders the same files; "
        "nothing is tuned to a scene."
    )


def _processor() -> str:
    """Return the processor's name, where the system tells it."""
    info = Path("/proc/cpuinfo")
    lines = info.read_text().splitlines() if info.is_file() else []
    names = (line.partition(":")[2].strip() for line in lines if line.startswith("model name"))
    return next(names, platform.processor() or platform.machine())


# --- All scenes together ---------------------------------------------------------------------------------------------


def _ratios(
    caption: str, corner: str, found: Sequence[Results], effort: Effort, value: Callable[[Results, int], Ratio]
) -> Table:
    """Return a table of a ratio of each scene at each number of samples, and the median of the scenes."""
    each = [[value(one, count) for count in effort.samples] for one in found]
    rows = [
        [one.scene.name, *(f"{r}{' !' if doubts.is_worse(r) else ''}" for r in row)]
        for one, row in zip(found, each, strict=True)
    ]
    medians = np.median([[r.value for r in row] for row in each], axis=0)
    rows.append(["median", *(f"{median:.3f}" for median in medians)])
    return Table(caption, [corner, *(f"{count} spp" for count in effort.samples)], rows)


def _summary(found: Sequence[Results], effort: Effort) -> Table:
    caption = (
        f"Mean square error over that of Cycles' automatic pattern at equal samples after a Gaussian of {SIGMA} pixel, "
        f"{effort.lines}x{effort.lines}, {len(effort.seeds)} seeds ± standard error, engine state {engine_state()}"
    )
    return _ratios(caption, "over Cycles", found, effort, lambda one, count: one.over(AUTOMATIC, count))


def _time_ratios(found: Sequence[Results], effort: Effort) -> Table:
    def cell(each: Sequence[float]) -> str:
        return f"{statistics.median(each):.2f} ({min(each):.2f}-{max(each):.2f})"

    rows = [[one.scene.name, *map(cell, one.times.values())] for one in found]
    caption = f"Wall time over Cycles', median of {effort.pairs} pairs of renders (lowest to highest)"
    return Table(caption, ["", *(f"{count} spp" for count in found[0].times)], rows)


def _convergence(found: Sequence[Results], effort: Effort, folder: Path) -> Path:
    """Draw error over samples, a small diagram a scene."""
    columns = min(3, len(found))
    figure = Figure(figsize=(3.6 * columns, 2.9 * -(-len(found) // columns)), layout="constrained")
    axes = figure.subplots(-(-len(found) // columns), columns, squeeze=False).ravel()
    for axis, one in zip(axes, found, strict=False):
        for engine, label in LABELS.items():
            squares = np.array([one.errors[engine, count][:, COLUMN] for count in effort.samples])
            error = np.sqrt(abs(squares.mean(axis=1)))
            # Of the root of a mean, to first order.
            spread = squares.std(axis=1, ddof=1) / np.sqrt(len(effort.seeds)) / (2 * error)
            axis.errorbar(effort.samples, error, spread, label=label, marker=".")
        axis.set(title=one.scene.name, xscale="log", yscale="log")
        axis.set_xticks(effort.samples, map(str, effort.samples))
        axis.set_xticks([], minor=True)
    for axis in axes[len(found) :]:
        axis.remove()
    axes[0].legend(fontsize="small")
    path = folder / "convergence.png"
    figure.savefig(path, dpi=DPI)
    return path


def _variants(found: Sequence[Results]) -> list[Table]:
    """Return the variants' errors, and their FLIP."""
    header = ["", *found[0].variants]

    def cell(each: np.ndarray, digits: int) -> str:
        return f"{each.mean():.{digits}f}±{each.std(ddof=1) / np.sqrt(len(each)):.{digits}f}"

    def errors(one: Results) -> list[str]:
        roots = (np.sqrt(np.maximum(each[:, COLUMN], 0)) for each in one.variants.values())
        return [cell(1000 * root, 1) for root in roots]

    return [
        Table(
            f"Root mean square error x 1000 at sigma {SIGMA}", header, [[one.scene.name, *errors(one)] for one in found]
        ),
        Table(
            "FLIP, the difference that a viewer sees, of the pictures as the scenes' views show them",
            header,
            [[one.scene.name, *(cell(each, 4) for each in one.flips.values())] for one in found],
        ),
    ]


def tiles_table() -> Table:
    """Return the table of docs/tiles.md."""
    caption, _, *lines = (ROOT / "docs" / "tiles.md").read_text(encoding="utf-8").replace("*", "").splitlines()
    cells = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines if line.startswith("|")]
    return Table(caption.partition(";")[0] + "; white noise is 1", cells[0], cells[2:])


# --- docs ----------------------------------------------------------------------------------------------------------

#: Scenes of the pictures that the docs show, and how they are cut and enlarged.
SHOWN = ("motion_blur",)
DOCS_LINES, DOCS_CROP, ENLARGED, MARGIN = 512, 160, 3, 12


def _write_docs(summary: Table, effort: Effort) -> None:
    """Renew the docs' pictures and the table between its two marks."""
    for name in SHOWN:
        one = Settings(size=(DOCS_LINES, DOCS_LINES))
        shown = []
        for engine in (AUTOMATIC, TILES):
            whole = plt.imread(picture(scene_file(name), replace(one, engine=engine), effort.seeds[0]))[..., :3]
            shown.append(crop(whole, SCENES[name], DOCS_CROP).repeat(ENLARGED, 0).repeat(ENLARGED, 1))
        gap = np.ones((len(shown[0]), MARGIN, 3), np.float32)
        write_picture(name, np.concatenate((shown[0], gap, shown[1]), axis=1))
    write_table("report", summary)
