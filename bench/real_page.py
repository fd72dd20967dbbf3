# SPDX-License-Identifier: GPL-3.0-or-later
"""The page of real files: time to equal error, pictures at equal time, and the tables."""

import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from scipy.ndimage import gaussian_filter

from bench.crops import EDGE, write_crop
from bench.document import DPI, Heading, Part, Pictures, Plot, page
from bench.jobs import RenderFailed
from bench.metrics import SIGMAS
from bench.real_figures import Measurements, curves, error_maps, seen
from bench.real_measuring import Effort, Outcome
from bench.real_renders import DENOISED, EVEN, NATIVE, OURS, RAW, THRESHOLD, Render, Result, rendered
from bench.real_tables import MAIN, Told
from bench.scene_files import SceneFile

#: The setting of ours that is shown in each mode, as near as it was measured; Cycles takes the same time.
_SETTINGS = {RAW: (EVEN, 64.0), DENOISED: (THRESHOLD, 0.1)}

#: Thresholds between which the one of equal time is looked for.
_THRESHOLDS = (0.003, 1.0)

#: By which power of its time Cycles' threshold falls, if that is not known yet; and what is believed of two renders.
_SLOPE, _SLOPES = -1.3, (-6.0, -0.5)

_NAMES = {
    (NATIVE, EVEN): "Cycles, even samples",
    (NATIVE, THRESHOLD): "Cycles, noise threshold",
    (OURS, EVEN): "Spectral Tiles, samples",
    (OURS, THRESHOLD): "Spectral Tiles, noise threshold",
}


@dataclass(frozen=True)
class Shown:
    """A picture of the page: its label, its render, and its error at each pixel as `bench.real_figures.seen`."""

    label: str
    result: Result
    error: np.ndarray


def write(
    folder: Path,
    files: Sequence[SceneFile],
    outcome: Outcome,
    effort: Effort,
    told: Told,
    experiments: Callable[[Path], Sequence[Part]],
) -> Path:
    """Write the page and return its path; what Cycles takes in our time is rendered for it.

    Parameters
    ----------
    folder : Path
        Receives ``report.html``, and the pictures, which are in the page, too.
    files : sequence of SceneFile
    outcome : Outcome
    effort : Effort
        The outcome's.
    told : Told
        What the outcome tells.
    experiments : callable
        From a folder for their pictures to the parts that stand before the tables.
    """
    folder.mkdir(parents=True, exist_ok=True)
    pictures: list[Part] = [
        Heading(
            "Pictures at equal time",
            "Enlarged where errors differ most between ours and Cycles by its better way, whoever is better there. "
            "Seconds are the processor's; errors are the whole picture's mean squares.",
        )
    ]
    measured = [file for file in files if file.name in outcome.figures]
    for file in measured:
        for mode in (DENOISED, RAW):
            print(f"page: {file.name}, {mode}", file=sys.stderr, flush=True)
            try:
                pictures.append(_crops(file, mode, outcome, effort, folder))
            except RenderFailed as failure:
                pictures.append(Heading(f"{file.name}, {mode}", f"No pictures: {failure}"))
    plots = [_convergence(outcome.found, *measure, folder) for measure in MAIN]
    parts = [
        *told.time,
        *plots,
        *pictures,
        *experiments(folder),
        *told.tables,
        Heading("How it was measured", told.how),
    ]
    path = folder / "report.html"
    path.write_text(page("Spectral Tiles against Cycles", told.summary, parts), encoding="utf-8")
    return path


def _convergence(found: dict[str, Measurements], mode: str, sigma: int, folder: Path) -> Plot:
    """Draw error over time, a small diagram a file."""
    columns = min(3, len(found))
    rows = -(-len(found) // columns)
    figure = Figure(figsize=(3.6 * columns, 2.7 * rows + 0.4), layout="constrained")
    axes = figure.subplots(rows, columns, squeeze=False).ravel()
    lines = {}
    for axis, (name, measured) in zip(axes, found.items(), strict=False):
        for (engine, rule), label in _NAMES.items():
            if curve := curves(measured, engine, mode, sigma).get(rule):
                style = {"color": f"C{engine == OURS:d}", "linestyle": "-" if rule == EVEN else "--", "marker": "."}
                lines[label] = axis.plot(*zip(*curve.points, strict=True), **style)[0]
        axis.set(title=name, xscale="log", yscale="log")
    for axis in axes[len(found) :]:
        axis.remove()
    figure.legend(lines.values(), lines, loc="outside upper center", ncols=len(lines) if columns > 2 else 1)
    path = folder / f"convergence-{mode}.png"
    figure.savefig(path, dpi=DPI)
    return Plot(
        f"Mean square error over processor seconds, {mode}, sigma {SIGMAS[sigma]}; lower and further left is better. "
        "Renders that took longer than others and were no better are left out",
        path,
    )


def _crops(file: SceneFile, mode: str, outcome: Outcome, effort: Effort, folder: Path) -> Pictures:
    """Return crops of a file in one mode: Cycles by both ways, ours, reference."""
    halves = [seen(result.pixels()) for result in outcome.references[file.name]]
    shown = _contenders(file, mode, outcome, effort, halves)
    *rivals, subject = shown
    rival = min(rivals, key=lambda each: each.error.mean())
    middle, gain = spot(rival.error - subject.error)
    pictures = [*((each.label, each.result) for each in shown), ("Converged", outcome.references[file.name][0])]
    row = []
    for number, (label, result) in enumerate(pictures):
        crop = folder / "crops" / f"{file.name.replace('/', '+')}-{mode}-{number}.png"
        row.append((label, write_crop(result.png, middle, crop)))
    where = f"{subject.label.split(',')[0]} is {'better' if gain > 0 else 'worse'} here"
    return Pictures(f"{file.name}, {mode}: {where}", [row])


def _contenders(
    file: SceneFile, mode: str, outcome: Outcome, effort: Effort, halves: Sequence[np.ndarray]
) -> list[Shown]:
    """Return Cycles by its two ways and ours, all in about the same time; without ours, Cycles' ways."""
    found = outcome.found[file.name]
    denoise = mode == DENOISED
    engine = OURS if any(of == OURS and in_mode == mode for of, in_mode, _ in found) else NATIVE
    rule, value = _SETTINGS[mode] if effort.thresholds else _SETTINGS[RAW]
    measured = effort.samples if rule == EVEN else effort.thresholds
    value = min(measured, key=lambda each: abs(np.log(each / value)))
    wanted = f"{rule} {value:g}"
    time = found[engine, mode, wanted].processor
    renders = {EVEN: Render(NATIVE, EVEN, samples_in(found, mode, time), denoise, beside=effort.beside)}
    if effort.thresholds:
        threshold = threshold_in(_native(found, mode, THRESHOLD), time)
        renders[THRESHOLD] = Render(NATIVE, THRESHOLD, threshold, denoise, beside=effort.beside)
    shown = [_shown(render, rendered(file, effort.width, render), halves) for render in renders.values()]
    if engine == OURS:
        ours, result = next(
            (render, result)
            for render, result in outcome.results[file.name]
            if (render.engine, render.mode, render.setting, render.repeat) == (OURS, mode, wanted, 0)
        )
        shown.append(_shown(ours, result, halves))
    return shown


def _shown(render: Render, result: Result, halves: Sequence[np.ndarray]) -> Shown:
    error = error_maps(seen(result.pixels()), halves)[0]
    name = f"{_NAMES[render.engine, render.rule]} {render.value:g}"
    return Shown(f"{name}: {result.processor:.1f} s, error {error.mean():.1e}", result, error)


def samples_in(found: Measurements, mode: str, time: float) -> int:
    """Return how many even samples Cycles takes in a processor time, which grows in proportion to them."""
    known = _native(found, mode, EVEN)
    times, counts = [each for _, each in known], [count for count, _ in known]
    if len(known) == 1:
        return max(1, round(counts[0] * time / times[0]))
    slope, start = np.polyfit(counts, times, 1, w=1.0 / np.array(times))
    return max(1, round((time - start) / slope)) if slope > 0.0 else counts[-1]


def threshold_in(known: Sequence[tuple[float, float]], time: float) -> float:
    """Return the threshold with which Cycles takes about a processor time, by thresholds and times that are known.

    The straight line through the two that are nearest, in the logarithms of both, is followed.
    """
    nearest = sorted(known, key=lambda each: abs(np.log(each[1] / time)))[:2]
    thresholds, times = np.log(np.array(nearest)).T
    slope = _SLOPE
    if len(nearest) > 1 and times[0] != times[1]:
        slope = np.clip((thresholds[0] - thresholds[1]) / (times[0] - times[1]), *_SLOPES)
    wanted = np.exp(thresholds[0] + slope * (np.log(time) - times[0]))
    return float(f"{np.clip(wanted, *_THRESHOLDS):.3g}")


def _native(found: Measurements, mode: str, rule: str) -> list[tuple[float, float]]:
    """Return values and processor times of Cycles' settings by one rule, sorted by value."""
    settings = (
        (float(setting.split()[1]), each.processor)
        for (engine, in_mode, setting), each in found.items()
        if engine == NATIVE and in_mode == mode and setting.startswith(rule)
    )
    return sorted(settings)


def spot(difference: np.ndarray, edge: int = EDGE) -> tuple[tuple[float, float], float]:
    """Return where a crop differs most, in parts from the upper left, and by how much; rows are from the bottom."""
    smooth = gaussian_filter(difference, edge / 4)
    row, column = np.unravel_index(np.argmax(np.abs(smooth)), smooth.shape)
    height, width = smooth.shape
    return ((column + 0.5) / width, 1.0 - (row + 0.5) / height), float(smooth[row, column])
