# SPDX-License-Identifier: GPL-3.0-or-later
"""A page of real files: crops side by side at equal processor time, and the tables."""

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.ndimage import gaussian_filter

from bench.crops import EDGE, write_crop
from bench.document import Heading, Part, Pictures, page
from bench.jobs import RenderFailed
from bench.real_figures import Measurements, error_maps, seen
from bench.real_measuring import Effort, Outcome
from bench.real_renders import DENOISED, EVEN, NATIVE, OURS, RAW, THRESHOLD, Render, Result, rendered
from bench.scene_files import SceneFile

#: Samples at which ours is shown, as near as they were measured; Cycles takes the same time.
_SAMPLES = 64

#: Thresholds between which the one of equal time is looked for.
_THRESHOLDS = (0.003, 1.0)

#: By which power of its time Cycles' threshold falls, if that is not known yet; and what is believed of two renders.
_SLOPE, _SLOPES = -1.3, (-6.0, -0.5)

_NAMES = {EVEN: "Cycles, even samples", THRESHOLD: "Cycles, noise threshold"}


@dataclass(frozen=True)
class Shown:
    """A picture of the page: its label, its render, and its error at each pixel as `bench.real_figures.seen`."""

    label: str
    result: Result
    error: np.ndarray


def write(folder: Path, files: Sequence[SceneFile], outcome: Outcome, effort: Effort, about: str, tables: list) -> Path:
    """Write the page and return its path; what Cycles takes in our time is rendered for it.

    Parameters
    ----------
    folder : Path
        Receives ``real.html`` and the crops, which are in the page, too.
    files : sequence of SceneFile
    outcome : Outcome
    effort : Effort
        The outcome's.
    about : str
        How it was measured.
    tables : list of Part
    """
    pictures: list[Part] = [Heading("Pictures at equal time", "Where errors differ most, pixel by pixel.")]
    for file in files:
        if file.name not in outcome.figures:
            continue
        for mode in (RAW, DENOISED):
            print(f"page: {file.name}, {mode}", file=sys.stderr, flush=True)
            try:
                pictures.append(_crops(file, mode, outcome, effort, folder))
            except RenderFailed as failure:
                pictures.append(Heading(f"{file.name}, {mode}", f"No pictures: {failure}"))
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / "real.html"
    summary = [str(part.text) for part in tables[:1] if isinstance(part, Heading)]
    path.write_text(page("Real files", "\n".join([*summary, about]), [*pictures, *tables]), encoding="utf-8")
    return path


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
    where = f"{subject.label.split(':')[0]} is {'better' if gain > 0 else 'worse'} here"
    return Pictures(f"{file.name}, {mode}: {where}", [row])


def _contenders(
    file: SceneFile, mode: str, outcome: Outcome, effort: Effort, halves: Sequence[np.ndarray]
) -> list[Shown]:
    """Return Cycles by its two ways and ours, all in about the same time; without ours, Cycles' ways."""
    found = outcome.found[file.name]
    denoise = mode == DENOISED
    engine = OURS if any(of == OURS and in_mode == mode for of, in_mode, _ in found) else NATIVE
    samples = min(effort.samples, key=lambda count: abs(count - _SAMPLES))
    wanted = f"{EVEN} {samples:g}"
    time = found[engine, mode, wanted].processor
    renders = {EVEN: Render(NATIVE, EVEN, samples_in(found, mode, time), denoise, beside=effort.beside)}
    if effort.thresholds:
        threshold = threshold_in(_native(found, mode, THRESHOLD), time)
        renders[THRESHOLD] = Render(NATIVE, THRESHOLD, threshold, denoise, beside=effort.beside)
    shown = []
    for rule, render in renders.items():
        shown.append(_shown(f"{_NAMES[rule]} {render.value:g}", rendered(file, effort.width, render), halves))
    if engine == OURS:
        ours = next(
            result
            for render, result in outcome.results[file.name]
            if (render.engine, render.mode, render.setting, render.repeat) == (OURS, mode, wanted, 0)
        )
        shown.append(_shown(f"Ours at {wanted}", ours, halves))
    return shown


def _shown(name: str, result: Result, halves: Sequence[np.ndarray]) -> Shown:
    error = error_maps(seen(result.pixels()), halves)[0]
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
