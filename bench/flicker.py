# SPDX-License-Identifier: GPL-3.0-or-later
"""``python -m bench flicker``: how the error of denoised frames changes from each frame to the next, in the same time.

What viewers see flicker is the change of the error, not the error. A film with a moving camera is compared with its
converged frames; one of a scene at rest needs none, as all change is error.
"""

import json
import statistics
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from bench.equal_time import value_in_time
from bench.jobs import AUTOMATIC, FILM_SEED, TABULATED, TILES, Settings, engine_state, images, processor_seconds
from bench.metrics import Reference, mean_square_error
from bench.real_renders import EVEN
from bench.scene_files import SceneFile
from bench.table import Progress, table
from generator.atomic_file import written_whole

#: Standard deviations in pixels of the Gaussians after which changes are looked at.
SIGMAS = (1, 4)

FILMS = ("moving", "at_rest")

#: The first frame.
FIRST = 9

#: Seeds of the references' two halves, far from those of measured films.
REFERENCE_SEEDS = (70, 71)

# Renders that look for our samples of the same time.
_TRIES = 3


@dataclass(frozen=True)
class Effort:
    """How much is rendered, and how.

    Attributes
    ----------
    samples : int
        A pixel and frame, of Cycles; ours takes as many as it can in the same processor time.
    width : int
        Of the frames, of 16:9.
    animated_seed : bool
        Whether each frame has its own seed.
    frames : int
        Consecutive ones of each film.
    reference_samples : int
        Samples a pixel of each half of a converged frame.
    seed : int
        Of Cycles.
    options : tuple of (str, str)
        Settings of ours by name.
    """

    samples: int = 16
    width: int = 320
    animated_seed: bool = True
    frames: int = 8
    reference_samples: int = 256
    seed: int = 0
    options: tuple[tuple[str, str], ...] = ()

    def images(self, seed: int) -> list[int]:
        """Return the numbers of all frames' images with a seed of Cycles."""
        return [FILM_SEED * seed + frame for frame in range(FIRST, FIRST + self.frames)]

    def settings(self, film: str) -> Settings:
        """Return how ours renders a film: by default as users have it."""
        return Settings(
            engine=TILES,
            samples=self.samples,
            size=(self.width, round(self.width * 9 / 16)),
            method="AUTO",
            denoise=True,
            film=film,
            fixed_seed=not self.animated_seed,
            options=tuple(({"distribution": "BY_NOISE"} | dict(self.options)).items()),
        )


def flicker(frames: Sequence[np.ndarray], references: Sequence[Reference], sigma: float) -> float:
    """Return the mean square, over pixels and frames, of the error's change from a frame to the next.

    Parameters
    ----------
    frames : sequence of ndarray
        Linear RGB, shape (height, width, 3).
    references : sequence of Reference
        The converged halves of each frame, whose noise does not bias the result.
    sigma : float
        Of the Gaussian that changes are filtered by, in pixels.
    """
    steps = range(1, len(frames))
    changes = [
        mean_square_error(
            frames[i] - frames[i - 1],
            Reference(references[i].first - references[i - 1].first, references[i].second - references[i - 1].second),
            sigma,
        )
        for i in steps
    ]
    return float(np.mean(changes))


def report(scenes: Sequence[SceneFile], effort: Effort, json_file: Path | None) -> str:
    """Render both films of all scenes and return the table of ratios, ours over Cycles'.

    Parameters
    ----------
    scenes : sequence of SceneFile
    effort : Effort
    json_file : Path or None
        Receives all figures.
    """
    progress = Progress(len(scenes) * len(FILMS))
    found = {}
    for scene in scenes:
        for film in FILMS:
            progress.step(f"{scene.name}, {film}")
            found[f"{scene.name}, {film}"] = _measured(scene, film, effort)
    if json_file:
        json_file.parent.mkdir(parents=True, exist_ok=True)
        with written_whole(json_file) as temporary:
            temporary.write_text(json.dumps({"ours": engine_state(), "films": found}, indent=1))
    return _table(found, effort)


def _measured(scene: SceneFile, film: str, effort: Effort) -> dict:
    """Return the figures of one film."""
    ours = effort.settings(film)
    numbers = effort.images(effort.seed)
    native = replace(ours, engine=AUTOMATIC, method=Settings.method, options=())
    time = _seconds(scene, native, numbers)

    def seconds(samples: float) -> float:
        return _seconds(scene, replace(ours, samples=int(samples)), numbers)

    in_time = int(value_in_time(EVEN, [(ours.samples, seconds(ours.samples))], time, seconds, _TRIES))
    references = _references(scene, film, effort)
    ours = replace(ours, samples=in_time)
    engines = {"ours": images(scene, ours, numbers), "native": images(scene, native, numbers)}
    return {
        "samples": in_time,
        "time": seconds(in_time) / time,
        "flicker": {name: [flicker(frames, references, sigma) for sigma in SIGMAS] for name, frames in engines.items()},
        "error": {
            name: [
                float(np.mean([mean_square_error(*pair, sigma) for pair in zip(frames, references, strict=True)]))
                for sigma in SIGMAS
            ]
            for name, frames in engines.items()
        },
    }


def _seconds(scene: SceneFile, settings: Settings, numbers: Sequence[int]) -> float:
    """Return the processor time of a frame: the median, so that what only a process's first render does is left out."""
    return statistics.median(processor_seconds(scene, settings, numbers))


def _references(scene: SceneFile, film: str, effort: Effort) -> list[Reference]:
    """Return each frame's converged halves; at rest they are the same for all."""
    settings = Settings(engine=TABULATED, samples=effort.reference_samples, size=effort.settings(film).size, film=film)
    halves = [effort.images(seed) for seed in REFERENCE_SEEDS]
    if film == "at_rest":
        return [Reference(*(images(scene, settings, half[:1])[0] for half in halves))] * effort.frames
    first, second = (images(scene, settings, half) for half in halves)
    return [Reference(*both) for both in zip(first, second, strict=True)]


def _table(found: dict[str, dict], effort: Effort) -> str:
    """Return all ratios, and their medians over the scenes of each kind of film."""
    rows, ratios = [], {film: [] for film in FILMS}
    for name, figures in found.items():
        values = [
            _ratio(ours, theirs)
            for kind in ("flicker", "error")
            for ours, theirs in zip(figures[kind]["ours"], figures[kind]["native"], strict=True)
        ]
        ratios[name.split(", ")[1]].append(values)
        cells = [f"{figures['samples']}", f"{figures['time']:.2f}"]
        rows.append([name, *cells, *(f"{value:.2f}" for value in values)])
    for film, values in ratios.items():
        rows.append([f"median, {film}", "", "", *(f"{value:.2f}" for value in np.median(values, axis=0))])
    columns = [f"{kind}, sigma {sigma}" for kind in ("flicker", "error") for sigma in SIGMAS]
    how = "animated" if effort.animated_seed else "fixed"
    changed = "".join(f", {name}={value}" for name, value in effort.options)
    title = (
        f"Denoised, {effort.width} px wide, {effort.frames} frames, {effort.samples} samples a pixel of Cycles, {how} "
        f"seed{changed}, state {engine_state()}: mean square of the error's change to the next frame, and of the "
        "error, ours over Cycles', with as many samples as fit into the same processor time (time: what is left of "
        "the difference)"
    )
    return f"{title}\n{table(['', 'our samples', 'time', *columns], rows)}"


def _ratio(ours: float, theirs: float) -> float:
    """Return a ratio that is 1 where nothing changes in either."""
    return 1.0 if ours == theirs else ours / theirs if theirs else float("inf")
