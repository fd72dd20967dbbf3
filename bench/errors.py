# SPDX-License-Identifier: GPL-3.0-or-later
"""Errors of engines on one scene: renders, compares with the reference, keeps one array of figures an engine."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from bench.jobs import AUTOMATIC, NATIVE, TABULATED, TILES, Settings, images, is_cached
from bench.metrics import MEASURES, SIGMAS, Ratio, Reference, mean_square_error, ratio
from bench.reference import reference
from bench.scene_files import SceneFile
from bench.table import Progress, table

#: First line of every table of errors.
HEADER = ["", *(f"sigma {sigma}" for sigma in SIGMAS)]

#: Mean square errors of one engine, shape (seeds, sigmas).
Errors = np.ndarray


def measure(
    scene: SceneFile,
    settings: Settings,
    engines: Sequence[str],
    seeds: Sequence[int],
    truth: Reference,
    progress: Progress,
    measures: Sequence[str] = ("luminance",),
    one_process_a_seed: bool = False,
) -> dict[tuple[str, str], Errors]:
    """Return the errors of several engines at equal settings.

    Parameters
    ----------
    scene : SceneFile
        What to render.
    settings : Settings
        Samples, size and bounces; the engine is replaced.
    engines : sequence of str
        Whom to measure.
    seeds : sequence of int
        One image each.
    truth : Reference
        At the same size and bounces.
    progress : Progress
        Told of each process.
    measures : sequence of str
        Of `metrics.MEASURES`.
    one_process_a_seed : bool
        Start a fresh process for each image, engines alternating, not one for all seeds of an engine.

    Returns
    -------
    dict
        Keys are (engine, measure).
    """
    batches = [[seed] for seed in seeds] if one_process_a_seed else [list(seeds)]
    errors = {(engine, kind): [] for engine in engines for kind in measures}
    for batch in batches:
        for engine in engines:
            own = replace(settings, engine=engine)
            known = all(is_cached(scene, own, seed) for seed in batch)
            progress.step(
                f"{scene.name}: {engine}, {settings.samples} spp, seeds {batch}{' (cached)' if known else ''}"
            )
            for image in images(scene, own, batch):
                for kind in measures:
                    errors[engine, kind].append([mean_square_error(image, truth, sigma, kind) for sigma in SIGMAS])
    return {key: np.array(rows) for key, rows in errors.items()}


def ratios(errors: dict[tuple[str, str], Errors], ours: str, theirs: str, kind: str = "luminance") -> list[Ratio]:
    """Return the ratio of two engines' errors at each sigma."""
    return [ratio(errors[ours, kind][:, i], errors[theirs, kind][:, i]) for i in range(len(SIGMAS))]


def rmse_cells(errors: Sequence[float]) -> list[str]:
    """Return root mean square errors times 1000, as tables show them.

    An unbiased estimate of a tiny mean square error can come out below zero, hence the absolute value.
    """
    return [f"{1000 * np.sqrt(abs(error)):.2f}" for error in errors]


def report(
    scene: SceneFile, settings: Settings, samples: Sequence[int], seeds: Sequence[int], reference_samples: int
) -> str:
    """Render one scene with every engine at several sample counts and return the tables of errors and ratios."""
    engines = (*NATIVE, TILES)
    progress = Progress(len(samples) * len(seeds) * len(engines))
    truth = reference(scene, settings, reference_samples, progress.say)
    found = {
        count: measure(
            scene, replace(settings, samples=count), engines, seeds, truth, progress, MEASURES, one_process_a_seed=True
        )
        for count in samples
    }
    parts = [f"{scene.name}, {settings.size[0]}x{settings.size[1]}, {len(seeds)} seeds, box filter of one pixel"]
    for kind in MEASURES:
        parts.append(_error_table(found, engines, kind, truth))
    parts.append(_ratio_table(found))
    return "\n\n".join(parts)


def _error_table(found: dict, engines: Sequence[str], kind: str, truth: Reference) -> str:
    """Return RMSE x 1000 of each engine and the noise that is left in the mean of the reference's halves."""
    rows = [
        [f"{engine} {count} spp", *rmse_cells(errors[engine, kind].mean(0))]
        for count, errors in found.items()
        for engine in engines
    ]
    noise = [truth.noise(sigma, kind) for sigma in SIGMAS]
    rows.append(["(reference)", *rmse_cells(noise)])
    return f"RMSE x 1000, {kind} of linear RGB; the reference's own noise is taken out\n" + table(HEADER, rows)


def _ratio_table(found: dict) -> str:
    """Return mean square errors of the tile over each native pattern's, and of the patterns over each other."""
    comparisons = [(kind, TILES, native) for kind in MEASURES for native in NATIVE]
    comparisons.append(("luminance", AUTOMATIC, TABULATED))
    rows = [
        [f"{count} spp, {kind}, {ours} over {theirs}", *map(str, ratios(errors, ours, theirs, kind))]
        for count, errors in found.items()
        for kind, ours, theirs in comparisons
    ]
    return "Mean square error, ratio of means over seeds ± its standard error\n" + table(HEADER, rows)
