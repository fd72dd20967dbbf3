# SPDX-License-Identifier: GPL-3.0-or-later
"""``python -m bench quality``: error ratios over all scenes."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from statistics import median

import numpy as np

from bench import timing
from bench.errors import HEADER, measure, ratios, rmse_cells
from bench.jobs import AUTOMATIC, NATIVE, TABULATED, TILES, Settings
from bench.metrics import SIGMAS
from bench.reference import reference
from bench.scene_files import SceneFile
from bench.table import Progress, table

#: Pairs of timed renders, and samples a pixel beyond which the ratio stays about the same.
_PAIRS, _MOST_TIMED = 3, 4


def report(
    scenes: Sequence[SceneFile],
    settings: Settings,
    samples: Sequence[int],
    seeds: Sequence[int],
    reference_samples: int,
    native_only: bool = False,
) -> str:
    """Return the tables of luminance error ratios of all scenes, with median and worst.

    Parameters
    ----------
    scenes : sequence of SceneFile
        What to render.
    settings : Settings
        Size and bounces; samples and engine are replaced.
    samples : sequence of int
        Samples a pixel, one block of tables each.
    seeds : sequence of int
        Of each render.
    reference_samples : int
        Samples a pixel of each half of the references.
    native_only : bool
        Compare only Cycles' own patterns with each other, without our engine.
    """
    pairs = [(AUTOMATIC, TABULATED)] if native_only else [(TILES, AUTOMATIC), (TILES, TABULATED)]
    engines = NATIVE if native_only else (*NATIVE, TILES)
    progress = Progress(len(scenes) * len(samples) * len(engines))
    found = {}
    for scene in scenes:
        truth = reference(scene, settings, reference_samples, progress.say)
        noise = [truth.noise(sigma) for sigma in SIGMAS]
        for count in samples:
            errors = measure(scene, replace(settings, samples=count), engines, seeds, truth, progress)
            share = max(noise[i] / errors[AUTOMATIC, "luminance"][:, i].mean() for i in range(len(SIGMAS)))
            progress.say(
                f"{scene.name}: the reference's noise is {100 * share:.1f} % of the error measured (taken out)"
            )
            found[scene.name, count] = errors
    bounces = "own bounces" if settings.bounces is None else f"{settings.bounces} bounces"
    title = f"Luminance MSE, {settings.size[0]}x{settings.size[1]}, {bounces}, {len(seeds)} seeds, ± standard error"
    blocks = [_block(found, [s.name for s in scenes], count, *pair) for count in samples for pair in pairs]
    if not native_only:
        timed = [count for count in samples if count <= _MOST_TIMED] or samples[:1]
        blocks.append(_wall_times(scenes, settings, timed, progress.say))
    return "\n\n".join((title, *blocks, _native_errors(found)))


def _block(found: dict, names: Sequence[str], count: int, ours: str, theirs: str) -> str:
    """Return one table: a row a scene, and the median and worst of them."""
    each = {name: ratios(found[name, count], ours, theirs) for name in names}
    values = np.array([[r.value for r in row] for row in each.values()])
    rows = [[name, *map(str, row)] for name, row in each.items()]
    rows.append(["median", *(f"{value:.3f}" for value in np.median(values, axis=0))])
    rows.append(["worst", *(f"{value:.3f}" for value in values.max(axis=0))])
    return f"{count} spp: {ours} over {theirs}\n" + table(HEADER, rows)


def _wall_times(scenes: Sequence[SceneFile], settings: Settings, samples: Sequence[int], say: Callable) -> str:
    """Return the ratios of wall times, our plan once made: median over pairs, lowest and highest."""
    rows = []
    for scene in scenes:
        say(f"{scene.name}: wall times")
        of_scene = [timing.ratios(scene, replace(settings, samples=count), _PAIRS) for count in samples]
        rows.append([scene.name, *(f"{median(each):.2f} ({min(each):.2f}-{max(each):.2f})" for each in of_scene)])
    header = ["", *(f"{count} spp" for count in samples)]
    return f"Wall time over {AUTOMATIC}, median of {_PAIRS} pairs (spread)\n" + table(header, rows)


def _native_errors(found: dict) -> str:
    """Return native Cycles' absolute errors, which say what the ratios are ratios of."""
    rows = [
        [f"{name}, {count} spp", *rmse_cells(errors[AUTOMATIC, "luminance"].mean(0))]
        for (name, count), errors in found.items()
    ]
    return f"RMSE x 1000 of {AUTOMATIC}\n" + table(HEADER, rows)
