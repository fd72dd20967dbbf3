# SPDX-License-Identifier: GPL-3.0-or-later
"""Measuring real files: what is rendered, in which order, and what became of it."""

import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass, field

from bench.jobs import RenderFailed, engine_state
from bench.real_figures import Measurements, file_figures, measurements, noise_of, seen
from bench.real_renders import (
    EVEN,
    NATIVE,
    OURS,
    RAW,
    REFERENCE,
    REFERENCE_SEEDS,
    THRESHOLD,
    Render,
    Result,
    cached,
    rendered,
)
from bench.scene_files import SceneFile

#: A reference's half has this many samples a pixel, however long they take, unless fewer are asked for.
FEWEST = 128


@dataclass(frozen=True)
class Effort:
    """How much is rendered.

    Attributes
    ----------
    width : int
        Of the pictures; their height follows from the file.
    samples, thresholds : sequence
        Settings of both renderers: samples a pixel, and noise thresholds.
    seeds, repeats : int
        Pictures at each setting, and times that each is rendered, for its time.
    reference_samples, reference_seconds : int
        Largest samples a pixel of each half of a reference, and the processor time that it should not exceed by much.
    native_only : bool
        Leave ours out.
    options : tuple of (str, str)
        Settings of ours by name.
    """

    width: int = 640
    samples: Sequence[int] = (1, 4, 16, 64)
    thresholds: Sequence[float] = (0.1, 0.03)
    seeds: int = 1
    repeats: int = 1
    reference_samples: int = 1024
    reference_seconds: int = 60
    native_only: bool = False
    options: tuple[tuple[str, str], ...] = ()

    @property
    def beside(self) -> str:
        """What of ours native renders are timed beside, empty for none."""
        if self.native_only:
            return ""
        return "_".join((engine_state(), *(f"{name}_{value}" for name, value in self.options)))

    def renders(self) -> list[Render]:
        """Return the measured renders of a file, native and ours in turn; who goes first changes from pair to pair."""
        settings = [(EVEN, count) for count in self.samples] + [(THRESHOLD, each) for each in self.thresholds]
        found = []
        for repeat in range(self.repeats):
            for seed in range(1, self.seeds + 1):
                for denoise in (False, True):
                    for rule, value in settings:
                        what = (rule, value, denoise, seed, repeat)
                        pair = [
                            Render(NATIVE, *what, beside=self.beside),
                            Render(OURS, *what, options=self.options),
                        ]
                        found += pair if len(found) // 2 % 2 == 0 else pair[::-1]
        return [render for render in found if not (self.native_only and render.engine == OURS)]

    def references(self, samples: int) -> list[Render]:
        """Return a reference's halves with some samples a pixel."""
        return [Render(NATIVE, REFERENCE, samples, seed=seed) for seed in REFERENCE_SEEDS]

    def samples_of_reference(self, file: SceneFile, seconds_per_sample: float) -> int:
        """Return how many samples a pixel the halves of a file's reference have.

        Parameters
        ----------
        file : SceneFile
        seconds_per_sample : float
            Processor time of a sample in every pixel. It varies from run to run, so halves that are there count if they
            have at least a quarter of the samples that it allows.
        """
        counts = self.counts_of_references()
        allowed = next((count for count in counts if count * seconds_per_sample <= self.reference_seconds), counts[-1])
        there = (
            count
            for count in counts
            if count >= allowed // 4 and all(cached(file, self.width, half) for half in self.references(count))
        )
        return next(there, allowed)

    def counts_of_references(self) -> list[int]:
        """Return the samples a pixel that a reference's halves may have, the most first."""
        counts = [self.reference_samples]
        while counts[-1] // 2 >= FEWEST:
            counts.append(counts[-1] // 2)
        return counts

    def missing(self, file: SceneFile) -> list[Render]:
        """Return what is still to be rendered of a file; of a reference, whose samples are not known yet, something."""
        possible = [self.references(count) for count in self.counts_of_references()]
        there = any(all(cached(file, self.width, half) for half in halves) for halves in possible)
        wanted = self.renders() + ([] if there else possible[0])
        return [render for render in wanted if not cached(file, self.width, render)]


@dataclass
class Outcome:
    """What became of the files.

    Attributes
    ----------
    figures : dict
        Name to `bench.real_figures.file_figures`.
    left_out : dict
        Name to why Cycles cannot render it.
    faults : list of str
        Renders of ours that failed, and values that are not finite.
    results : dict
        Name to renders and their results.
    references : dict
        Name to the results of the reference's halves.
    found : dict
        Name to `bench.real_figures.Measurements`.
    """

    figures: dict[str, dict] = field(default_factory=dict)
    left_out: dict[str, str] = field(default_factory=dict)
    faults: list[str] = field(default_factory=list)
    results: dict[str, list[tuple[Render, Result]]] = field(default_factory=dict)
    references: dict[str, list[Result]] = field(default_factory=dict)
    found: dict[str, Measurements] = field(default_factory=dict)


class Progress:
    """Progress lines on the error stream, with the time that remains: so much a process, and so much a sample.

    Parameters
    ----------
    waiting : sequence of Render
        All that is to be rendered.
    """

    def __init__(self, waiting: Sequence[Render]):
        self._count, self._left = len(waiting), sum(map(_samples, waiting))
        self._taken, self._seconds = 0.0, []

    def step(self, name: str, render: Render, seconds: float) -> None:
        """Tell of a render and the seconds that its process took."""
        self._seconds.append(seconds)
        self._taken += _samples(render)
        self._left -= _samples(render)
        done, start = len(self._seconds), min(self._seconds)
        per_sample = (sum(self._seconds) - done * start) / self._taken
        minutes = ((self._count - done) * start + self._left * per_sample) / 60
        what = f"{name}: {render.engine} {render.setting} {render.mode}, {seconds:.1f} s"
        print(f"{done}/{self._count}, {minutes:.0f} min left  {what}", file=sys.stderr, flush=True)

    def skip(self, renders: Sequence[Render]) -> None:
        """Leave out renders that will not be done."""
        self._count -= len(renders)
        self._left -= sum(map(_samples, renders))


def _samples(render: Render) -> float:
    """Return how many samples a pixel a render takes: a guess for thresholds and references."""
    if render.rule == REFERENCE:
        return 2 * FEWEST
    return 6.0 / render.value if render.rule == THRESHOLD else render.value


def measure(files: Sequence[SceneFile], effort: Effort) -> Outcome:
    """Render what is not cached and return all figures.

    Raises
    ------
    NoSwitch
        Ours is asked for and cannot be switched on.
    """
    outcome = Outcome()
    progress = Progress([render for file in files for render in effort.missing(file)])
    for file in files:
        try:
            _measure_file(file, effort, progress, outcome)
        except RenderFailed as failure:
            outcome.left_out[file.name] = str(failure)
            progress.skip(effort.missing(file))
            print(f"{file.name} is left out: {failure}", file=sys.stderr, flush=True)
    return outcome


def _measure_file(file: SceneFile, effort: Effort, progress: Progress, outcome: Outcome) -> None:
    """Render one file's missing pictures and add its figures to the outcome."""

    def done(render: Render) -> Result:
        if known := cached(file, effort.width, render):
            return known
        start = time.monotonic()
        try:
            return rendered(file, effort.width, render)
        finally:
            progress.step(file.name, render, time.monotonic() - start)

    results = []
    for render in effort.renders():
        try:
            results.append((render, done(render)))
        except RenderFailed as failure:
            if render.engine == NATIVE:
                raise
            outcome.faults.append(f"{file.name}, {render.setting}, {render.mode}: {failure}")
    raw = [pair for pair in results if (pair[0].engine, pair[0].rule, pair[0].mode) == (NATIVE, EVEN, RAW)]
    longest, result = max(raw, key=lambda pair: pair[0].value)
    samples = effort.samples_of_reference(file, result.processor / longest.value)
    references = [done(render) for render in effort.references(samples)]
    halves = [seen(result.pixels()) for result in references]
    if not all(half.any() for half in halves):
        raise RenderFailed("its picture is black")
    found = measurements(results, halves)
    for (engine, mode, setting), each in found.items():
        if engine == OURS and each.broken:
            outcome.faults.append(f"{file.name}, {setting}, {mode}: {each.broken} values are not finite")
    width, height = references[0].size
    outcome.found[file.name], outcome.results[file.name] = found, results
    outcome.references[file.name] = references
    outcome.figures[file.name] = file_figures(found, width * height, noise_of(halves))
