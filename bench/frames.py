# SPDX-License-Identifier: GPL-3.0-or-later
"""``python -m bench frames``: error of the mean of consecutive frames of scenes at rest, with an animated seed."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from bench.errors import HEADER
from bench.jobs import AUTOMATIC, TILES, Settings, images
from bench.metrics import SIGMAS, mean_square_error
from bench.reference import reference
from bench.scene_files import SceneFile
from bench.table import Progress, table

#: Frames that are rendered, and how many consecutive ones are averaged.
FRAMES = range(1, 17)
COUNTS = (1, 4, 16)


def report(scenes: Sequence[SceneFile], settings: Settings, reference_samples: int) -> str:
    """Return tables of luminance error ratios, our engine over Cycles' automatic pattern.

    Parameters
    ----------
    scenes : sequence of SceneFile
        What to render.
    settings : Settings
        Samples, size, bounces and Gaussian of still scenes; the engine is replaced.
    reference_samples : int
        Samples a pixel of each half of the references.
    """
    progress = Progress(2 * len(scenes))
    found = {count: {} for count in COUNTS}
    for scene in scenes:
        truth = reference(scene, settings, reference_samples, progress.say)
        pictures = {}
        for engine in (TILES, AUTOMATIC):
            progress.step(f"{scene.name}: {engine}, {len(FRAMES)} frames")
            pictures[engine] = images(scene, replace(settings, engine=engine), FRAMES)
        for count in COUNTS:
            ours, theirs = (_errors(pictures[engine], count, truth) for engine in (TILES, AUTOMATIC))
            found[count][scene.name] = ours / theirs
    size = f"{settings.size[0]}x{settings.size[1]}"
    pixels = f", Gaussian of {settings.gaussian} pixels" if settings.gaussian else ""
    title = f"Luminance MSE, {settings.samples} spp, {size}{pixels}, animated seed: {TILES} over {AUTOMATIC}"
    return "\n\n".join((title, *(_block(count, ratios) for count, ratios in found.items())))


def _errors(pictures: Sequence[np.ndarray], count: int, truth) -> np.ndarray:
    """Return the error of the mean of `count` consecutive frames, at each sigma, averaged over all first frames."""
    means = [np.mean(pictures[first : first + count], axis=0) for first in range(len(pictures) - count + 1)]
    return np.mean([[mean_square_error(mean, truth, sigma) for sigma in SIGMAS] for mean in means], axis=0)


def _block(count: int, ratios: dict[str, np.ndarray]) -> str:
    rows = [[name, *(f"{value:.3f}" for value in row)] for name, row in ratios.items()]
    rows.append(["median", *(f"{value:.3f}" for value in np.median(list(ratios.values()), axis=0))])
    what = "one frame" if count == 1 else f"mean of {count} consecutive frames"
    return f"{what}\n{table(HEADER, rows)}"
