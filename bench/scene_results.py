# SPDX-License-Identifier: GPL-3.0-or-later
"""What the report renders and measures of one scene."""

import statistics
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from bench import timing
from bench.crops import write_crop
from bench.document import Pictures
from bench.errors import Errors
from bench.jobs import AUTOMATIC, TABULATED, TILES, Settings, images, picture, render
from bench.metrics import SIGMAS, Ratio, Reference, flip_of_pictures, mean_square_error, ratio
from bench.reference import SEEDS as REFERENCE_SEEDS
from bench.reference import reference, reference_settings
from bench.scene_files import SceneFile, scene_file
from bench.table import Progress

LABELS = {AUTOMATIC: "Cycles", TABULATED: "Cycles, white noise", TILES: "Spectral Tiles"}

#: Scenes by name, and the middle of the crop that is shown, in parts of the picture from the upper left.
SCENES = {
    "wheels": (0.46, 0.40),
    "motion_blur": (0.46, 0.40),
    "moving_penumbra": (0.62, 0.35),
    "round_lens": (0.25, 0.35),
    "glossy_reflection": (0.55, 0.80),
    "interior": (0.45, 0.55),
    "windy_forest": (0.30, 0.55),
    "dandelion": (0.55, 0.35),
    "swinging_lamp": (0.45, 0.60),
}

#: Samples a pixel at which denoising and adaptive sampling are compared.
COMPARED = 4

#: The Gaussian by which scenes are judged, in pixels, and its place in errors.
SIGMA = 1
COLUMN = SIGMAS.index(SIGMA)

#: Steps of progress beside one for each number of samples.
_MORE_STEPS = 3


@dataclass(frozen=True)
class Effort:
    """How much to render.

    Attributes
    ----------
    scenes : sequence of str
        Of `SCENES`.
    lines : int
        Width and height of their pictures.
    samples : sequence of int
        Samples a pixel.
    seeds : sequence of int
        One image each.
    reference_samples : int
        Samples a pixel of each half of the references.
    timed_lines : int
        Width and height of the pictures whose wall time is measured for the comparison at equal time.
    large : tuple of int
        Pixels of the large frames whose wall time is measured.
    pairs : int
        Pairs of timed renders.
    """

    scenes: Sequence[str]
    lines: int
    samples: Sequence[int]
    seeds: Sequence[int]
    reference_samples: int
    timed_lines: int
    large: tuple[int, int]
    pairs: int

    @property
    def settings(self) -> Settings:
        """Size of the pictures, the scenes' own bounces."""
        return Settings(size=(self.lines, self.lines))

    @property
    def steps(self) -> int:
        """Steps of progress of all scenes."""
        return len(self.scenes) * (len(self.samples) + _MORE_STEPS)


@dataclass(frozen=True)
class Results:
    """What was measured on one scene.

    Attributes
    ----------
    scene : SceneFile
    truth : Reference
    errors : dict
        Mean square errors, shape (seeds, sigmas), by engine and samples a pixel.
    times : dict
        Our wall times over native, one a pair of renders, by samples a pixel, up to `COMPARED`.
    variants : dict
        Mean square errors by the name of a variant, at `COMPARED` samples.
    flips : dict
        FLIP of the variants' pictures, one a seed.
    pictures : Pictures
        Crops: a row for each number of samples, then the variants.
    """

    scene: SceneFile
    truth: Reference
    errors: dict[tuple[str, int], Errors]
    times: dict[int, list[float]]
    variants: dict[str, Errors]
    flips: dict[str, np.ndarray]
    pictures: Pictures

    @property
    def hero(self) -> list[tuple[str, Path]]:
        """Cycles, Spectral Tiles and the converged picture, at the fewest samples."""
        (cycles, _, ours, _), *_, (converged, *_) = self.pictures.rows
        return [cycles, ours, converged]

    def over(self, engine: str, samples: int) -> Ratio:
        """Return our error over another engine's at equal samples."""
        return ratio(self.errors[TILES, samples][:, COLUMN], self.errors[engine, samples][:, COLUMN])

    def at_equal_time(self, samples: int) -> Ratio:
        """Return our error over Cycles' with the samples that it takes in the same time, by its curve."""
        counts = [count for engine, count in self.errors if engine == AUTOMATIC]
        curve = np.array([self.errors[AUTOMATIC, count][:, COLUMN] for count in counts])
        theirs = errors_at(counts, curve, samples * _time(self.times, samples))
        return ratio(self.errors[TILES, samples][:, COLUMN], theirs)


def _times(scene: SceneFile, effort: Effort) -> dict[int, list[float]]:
    size = (effort.timed_lines, effort.timed_lines)
    counts = sorted({min(count, COMPARED) for count in effort.samples})
    return {count: timing.ratios(scene, Settings(samples=count, size=size), effort.pairs) for count in counts}


def _time(times: dict[int, list[float]], samples: int) -> float:
    """Return our wall time over native; that of more samples than were timed is taken as that of the most."""
    return statistics.median(times[min(samples, max(times))])


def errors_at(counts: Sequence[int], errors: np.ndarray, wanted: float) -> np.ndarray:
    """Return errors at a number of samples, on straight lines of log error over log samples through those measured.

    Parameters
    ----------
    counts : sequence of int
        Samples a pixel, rising.
    errors : ndarray, shape (counts, seeds)
        Mean square errors.
    wanted : float
        Samples a pixel; beyond the last of the counts the last line goes on. From a single count errors fall like
        those of independent samples.
    """
    if len(counts) == 1:
        return errors[0] * counts[0] / wanted
    after = int(np.clip(np.searchsorted(counts, wanted), 1, len(counts) - 1))
    share = np.log(wanted / counts[after - 1]) / np.log(counts[after] / counts[after - 1])
    nearest = int(share > 0.5)
    # The slope is that of the means: a single seed's error can come out below zero once the reference's noise is out.
    first, second = np.abs(errors[after - 1 : after + 1].mean(axis=1))
    return errors[after - 1 + nearest] * (second / first) ** (share - nearest)


def measured(scene: SceneFile, settings: Settings, seeds: Sequence[int], truth: Reference) -> Errors:
    """Return mean square errors of images, rendering those not cached."""
    found = images(scene, settings, seeds)
    return np.array([[mean_square_error(image, truth, sigma) for sigma in SIGMAS] for image in found])


def results(name: str, effort: Effort, folder: Path, progress: Progress) -> Results:
    """Render and measure one scene, and write its crops to a folder."""
    scene, base = scene_file(name), effort.settings
    progress.step(f"{name}: wall times")
    times = _times(scene, effort)
    progress.step(f"{name}: references")
    converged = reference_settings(base, effort.reference_samples)
    render(scene, [(converged, REFERENCE_SEEDS)])
    truth = reference(scene, base, effort.reference_samples, progress.say)

    def shown(settings: Settings, label: str, seed: int = effort.seeds[0]) -> Path:
        return write_crop(picture(scene, settings, seed), SCENES[name], folder / f"{name}-{label}.png")

    errors, rows = {}, []
    for count in effort.samples:
        progress.step(f"{name}: {count} {_noun(count)} a pixel")
        plain = {engine: replace(base, engine=engine, samples=count) for engine in LABELS}
        longer = max(1, round(count * _time(times, count)))
        longest = replace(base, samples=longer)
        render(scene, [*((settings, effort.seeds) for settings in plain.values()), (longest, effort.seeds[:1])])
        errors |= {(engine, count): measured(scene, plain[engine], effort.seeds, truth) for engine in LABELS}
        row = [
            (f"{label}, {count} {_noun(count)}", shown(plain[engine], f"{engine.lower()}-{count}"))
            for engine, label in LABELS.items()
        ]
        rows.append([*row, (f"Cycles at equal time, {longer} {_noun(longer)}", shown(longest, f"equal_time-{count}"))])

    progress.step(f"{name}: denoised, adaptive")
    native, ours = replace(base, samples=COMPARED), replace(base, samples=COMPARED, engine=TILES)
    variants = {
        "Cycles": native,
        "Spectral Tiles": ours,
        "Cycles, adaptive": replace(native, adaptive=True),
        "Cycles, denoised": replace(native, denoise=True),
        "Spectral Tiles, denoised": replace(ours, denoise=True),
    }
    render(scene, [(settings, effort.seeds) for settings in variants.values()])
    whole = picture(scene, converged, REFERENCE_SEEDS[0])
    rows.append(
        [
            (f"converged, {effort.reference_samples} samples", shown(converged, "converged", REFERENCE_SEEDS[0])),
            *(
                (f"{label}, {COMPARED} samples", shown(variants[label], f"variant-{number}"))
                for number, label in enumerate(list(variants)[2:])
            ),
        ]
    )
    return Results(
        scene,
        truth,
        errors,
        times,
        {label: measured(scene, settings, effort.seeds, truth) for label, settings in variants.items()},
        {
            label: np.array([flip_of_pictures(picture(scene, settings, seed), whole) for seed in effort.seeds])
            for label, settings in variants.items()
        },
        Pictures(name, rows),
    )


def _noun(count: int) -> str:
    return "sample" if count == 1 else "samples"
