# SPDX-License-Identifier: GPL-3.0-or-later
"""``python -m bench scenes``: what a sample costs native Cycles, or the scenes' files for ``bench real``."""

import shutil
from collections.abc import Sequence
from pathlib import Path

from bench.jobs import AUTOMATIC, Settings, run_worker
from bench.scene_files import SceneFile
from bench.table import Progress, table

#: Samples a pixel of the two timed renders, whose difference is free of all that a render does once.
FEW, MANY = 4, 36


def report(scenes: Sequence[SceneFile], width: int, out: Path | None) -> str:
    """Return a table of the scenes' costs, or copy their files.

    Parameters
    ----------
    scenes : sequence of SceneFile
    width : int
        Of the timed pictures, of 16:9.
    out : Path or None
        Folder that receives the .blend files instead.
    """
    if out is not None:
        out.mkdir(parents=True, exist_ok=True)
        for scene in scenes:
            shutil.copyfile(scene.path, out / f"{scene.name}.blend")
        return f"{len(scenes)} files in {out}, for: python -m bench real {out}"
    progress = Progress(len(scenes))
    size = (width, round(width * 9 / 16))
    rows = []
    for scene in scenes:
        progress.step(scene.name)
        rows.append([scene.name, *(f"{value:.1f}" for value in costs(scene, size))])
    title = f"Native Cycles, {size[0]}x{size[1]}: processor time, {FEW} to {MANY} samples a pixel"
    return f"{title}\n{table(['', 'µs a sample', 's a render besides'], rows)}"


def costs(scene: SceneFile, size: tuple[int, int]) -> tuple[float, float]:
    """Return the processor's microseconds for a sample, and its seconds for all that a render does beside."""
    # The process's first render loads Cycles' kernels, which counts for neither.
    tasks = [(Settings(AUTOMATIC, samples, size), {"repeats": repeats}) for samples, repeats in ((FEW, 2), (MANY, 1))]
    (_, (_, few)), ((_, many),) = run_worker(scene, tasks)["seconds"]
    sample = (many - few) / (MANY - FEW)
    return 1e6 * sample / (size[0] * size[1]), few - FEW * sample
