# SPDX-License-Identifier: GPL-3.0-or-later
"""The page of real files: time to equal error, pictures at equal time, and the tables."""

import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullLocator
from scipy.ndimage import gaussian_filter

from bench.crops import EDGE, write_crop
from bench.document import DPI, Heading, Part, Pictures, Plot, page
from bench.equal_time import is_near, value_in_time
from bench.jobs import RenderFailed
from bench.metrics import SIGMAS
from bench.real_figures import Measurements, curves, error_maps, seen
from bench.real_measuring import Effort, Outcome
from bench.real_renders import DENOISED, EVEN, NATIVE, OURS, RAW, THRESHOLD, Render, Result, rendered
from bench.real_tables import MAIN, Told, in_words
from bench.scene_files import SceneFile
from generator.atomic_file import written_whole

#: The setting of ours that is shown in each mode, as near as it was measured; Cycles takes the same time.
_SETTINGS = {RAW: (EVEN, 64.0), DENOISED: (THRESHOLD, 0.1)}

#: Renders that look for Cycles' setting of equal time, and by how much its time may then differ: Cycles takes at least
#: some 32 samples a pixel at any threshold.
_TRIES, _NEAR = 2, 0.3

#: Where a decade of a diagram's axes has numbers, by how many decades there are at most.
_TICKS = ((1.5, (1.0, 1.5, 2.0, 3.0, 5.0, 7.0)), (3.0, (1.0, 2.0, 5.0)), (np.inf, (1.0,)))

_NAMES = {NATIVE: "Cycles", OURS: "Spectral Tiles"}


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
    with written_whole(path) as temporary:
        temporary.write_text(page("Spectral Tiles against Cycles", told.summary, parts), encoding="utf-8")
    return path


def _convergence(found: dict[str, Measurements], mode: str, sigma: int, folder: Path) -> Plot:
    """Draw error over time, a small diagram a file."""
    columns = min(3, len(found))
    rows = -(-len(found) // columns)
    figure = Figure(figsize=(3.6 * columns, 2.7 * rows + 0.4), layout="constrained")
    axes = figure.subplots(rows, columns, squeeze=False).ravel()
    lines = {}
    for axis, (name, measured) in zip(axes, found.items(), strict=False):
        for engine, label in _NAMES.items():
            for rule, curve in curves(measured, engine, mode, sigma).items():
                style = {"color": f"C{engine == OURS:d}", "linestyle": "-", "marker": "."}
                if rule == THRESHOLD:
                    style |= {"linestyle": "--", "marker": "x"}
                what = f"{label}, {'samples' if rule == EVEN else 'noise threshold'}"
                if curve.points:
                    lines[what] = axis.plot(*zip(*curve.points, strict=True), **style)[0]
        axis.set(title=name, xscale="log", yscale="log")
        for each in (axis.xaxis, axis.yaxis):
            decades = float(np.ptp(np.log10(each.get_view_interval())))
            each.set_major_locator(LogLocator(subs=next(ticks for most, ticks in _TICKS if decades <= most)))
            each.set_major_formatter("{x:.3g}")
            each.set_minor_locator(NullLocator())
    for axis in axes[len(found) :]:
        axis.remove()
    figure.legend(lines.values(), lines, loc="outside upper center", ncols=len(lines) if columns > 2 else 1)
    path = folder / f"convergence-{mode}.png"
    with written_whole(path) as temporary:
        figure.savefig(temporary, dpi=DPI)
    return Plot(
        f"Mean square error over processor seconds, {mode}, sigma {SIGMAS[sigma]}; lower and further left is better. "
        "Renders that took longer than others and were no better are left out",
        path,
    )


def _crops(file: SceneFile, mode: str, outcome: Outcome, effort: Effort, folder: Path) -> Pictures:
    """Return crops of a file in one mode: Cycles, ours, reference."""
    halves = [seen(result.pixels()) for result in outcome.references[file.name]]
    shown = _contenders(file, mode, outcome, effort, halves)
    *rivals, subject = shown
    rival = min(rivals, key=lambda each: each.error.mean(), default=subject)
    middle, gain = spot(rival.error - subject.error)
    pictures = [
        *((each.label, each.result) for each in shown),
        ("Reference, one of two halves", outcome.references[file.name][0]),
    ]
    row = []
    for number, (label, result) in enumerate(pictures):
        crop = folder / "crops" / f"{file.name.replace('/', '+')}-{mode}-{number}.png"
        row.append((label, write_crop(result.png, middle, crop)))
    where = f"{subject.label.split(',')[0]} is {'better' if gain > 0 else 'worse'} here"
    return Pictures(f"{file.name}, {mode}: {where}", [row])


def _contenders(
    file: SceneFile, mode: str, outcome: Outcome, effort: Effort, halves: Sequence[np.ndarray]
) -> list[Shown]:
    """Return Cycles by the ways that can take our time, and ours; without ours, Cycles' ways."""
    found = outcome.found[file.name]
    denoise = mode == DENOISED
    engine = OURS if any(of == OURS and in_mode == mode for of, in_mode, _ in found) else NATIVE
    rule, value = _SETTINGS[mode] if effort.thresholds else _SETTINGS[RAW]
    measured = effort.samples if rule == EVEN else effort.thresholds
    value = min(measured, key=lambda each: abs(np.log(each / value)))
    wanted = f"{rule} {value:g}"
    time = found[engine, mode, wanted].processor

    def native(rule: str, value: float) -> tuple[Render, Result]:
        render = Render(NATIVE, rule, value, denoise, beside=effort.beside)
        return render, rendered(file, effort.width, render)

    found_by = []
    for rule in (EVEN, THRESHOLD) if effort.thresholds else (EVEN,):
        known = _native(found, mode, rule)
        value = value_in_time(rule, known, time, lambda one, rule=rule: native(rule, one)[1].processor, _TRIES)
        found_by.append(native(rule, value))
    in_time = [pair for pair in found_by if is_near(pair[1].processor, time, _NEAR)]
    shown = [_shown(*pair, halves) for pair in in_time or found_by]
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
    name = f"{_NAMES[render.engine]}, {in_words(render.setting)}"
    # Lines may break after a hyphen, but not after a minus.
    mean = f"{error.mean():.1e}".replace("-", "\N{MINUS SIGN}")
    return Shown(f"{name}: {result.processor:.1f}\N{NO-BREAK SPACE}s, error {mean}", result, error)


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
