# SPDX-License-Identifier: GPL-3.0-or-later
"""``python -m bench adaptive``: adaptive sampling against the same number of samples everywhere."""

from collections.abc import Sequence
from dataclasses import replace

from bench.errors import HEADER, measure
from bench.jobs import AUTOMATIC, TILES, Settings
from bench.metrics import SIGMAS, ratio
from bench.reference import reference
from bench.scene_files import SceneFile
from bench.table import Progress, table
from bench.timing import times

#: Pairs of timed processes.
_PAIRS = 3


def report(
    scenes: Sequence[SceneFile],
    settings: Settings,
    samples: Sequence[int],
    seeds: Sequence[int],
    reference_samples: int,
) -> str:
    """Return the ratios of luminance errors at equal mean numbers of samples, and of wall times in the first scene.

    Parameters
    ----------
    scenes : sequence of SceneFile
        What to render.
    settings : Settings
        Size; samples, engine and adaptivity are replaced.
    samples, seeds : sequence of int
        Mean samples a pixel; of each render.
    reference_samples : int
        Samples a pixel of each half of the references.
    """
    progress = Progress(3 * len(scenes) * len(samples))
    rows = {TILES: [], AUTOMATIC: []}
    for scene in scenes:
        truth = reference(scene, settings, reference_samples, progress.say)
        for count in samples:
            even = replace(settings, samples=count)
            others = measure(scene, even, (TILES, AUTOMATIC), seeds, truth, progress)
            ours = measure(scene, replace(even, budget=True), (TILES,), seeds, truth, progress)[TILES, "luminance"]
            for engine, lines in rows.items():
                errors = others[engine, "luminance"]
                cells = [str(ratio(ours[:, i], errors[:, i])) for i in range(len(SIGMAS))]
                lines.append([f"{scene.name}, {count} spp", *cells])
    title = f"Luminance MSE of adaptive sampling, {settings.size[0]}x{settings.size[1]}, {len(seeds)} seeds"
    blocks = [
        f"over {'the same rate everywhere' if engine == TILES else engine}\n{table(HEADER, lines)}"
        for engine, lines in rows.items()
    ]
    timed = replace(settings, samples=samples[0], size=(1920, 1080), budget=True)
    return "\n\n".join((title, *blocks, str(times(scenes[:1], timed, _PAIRS, progress.say))))
