# SPDX-License-Identifier: GPL-3.0-or-later
"""``python -m bench filters``: samples shared by all pixels of a filter, against Cycles' own use of that filter."""

import time
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from addon.picture.reconstruction import Filter, Reconstruction
from bench.errors import HEADER, measure, ratios
from bench.jobs import AUTOMATIC, TILES, Settings
from bench.reference import reference
from bench.scene_files import SceneFile
from bench.table import Progress, table
from bench.timing import cost


def report(
    scenes: Sequence[SceneFile],
    settings: Settings,
    samples: Sequence[int],
    seeds: Sequence[int],
    reference_samples: int,
) -> str:
    """Return the ratios of luminance errors against the converged picture of the same Gaussian, and filtering's time.

    Parameters
    ----------
    scenes : sequence of SceneFile
        What to render.
    settings : Settings
        Size and Gaussian; samples and engine are replaced.
    samples, seeds : sequence of int
        Samples a pixel; of each render.
    reference_samples : int
        Samples a pixel of each half of the references, which Cycles renders with its own filter.
    """
    progress = Progress(2 * len(scenes) * len(samples))
    rows = []
    for scene in scenes:
        truth = reference(scene, settings, reference_samples, progress.say)
        for count in samples:
            errors = measure(scene, replace(settings, samples=count), (AUTOMATIC, TILES), seeds, truth, progress)
            rows.append([f"{scene.name}, {count} spp", *map(str, ratios(errors, TILES, AUTOMATIC))])
    title = (
        f"Luminance MSE over native, Gaussian of {settings.gaussian} pixels, {settings.size[0]}x{settings.size[1]}, "
    )
    return f"{title}{len(seeds)} seeds\n{table(HEADER, rows)}\n\n{_time(scenes[0], settings.gaussian)}"


def _time(scene: SceneFile, deviation: float) -> str:
    """Return how long filtering alone takes, beside the native render of the first scene."""
    width, height, samples = 1920, 1080, 4
    native = cost(scene, Settings(samples=samples, size=(width, height))).second
    generator = np.random.default_rng(0)
    picture = generator.random((4, height, width), np.float32)
    where = generator.integers(0, 65536, (2, height, width), np.uint16)
    sums = Reconstruction(Filter("GAUSSIAN", 6.0 * deviation), 4, height, width)
    start = time.perf_counter()
    for _ in range(samples):
        sums.add(picture, where)
    sums.pixels()
    seconds = time.perf_counter() - start
    return (
        f"Filtering {width}x{height}, {samples} spp, one pass: {seconds:.2f} s, "
        f"{seconds / native:.3f} of the {native:.1f} s that Cycles takes for {scene.name}"
    )
