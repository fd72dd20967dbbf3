# SPDX-License-Identifier: GPL-3.0-or-later
"""Wall time and memory of our engine against native Cycles."""

import json
import statistics
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from bench.document import Table
from bench.jobs import AUTOMATIC, TILES, Settings, result_path, run_worker
from bench.scene_files import SceneFile
from generator.atomic_file import written_whole

#: The second render of a process is the one that counts: by then our plan is cached and Cycles' kernels are loaded.
RENDERS = 2


@dataclass(frozen=True)
class Cost:
    """What one fresh process spent.

    Attributes
    ----------
    first, second : float
        Seconds of its first and second render.
    processor : float
        Processor seconds of its second render, on all cores together.
    peak : int
        Largest resident size in bytes.
    """

    first: float
    second: float
    processor: float
    peak: int


def cost(scene: SceneFile, settings: Settings) -> Cost:
    """Render twice in a fresh process."""
    result = run_worker(scene, [(settings, {"repeats": RENDERS})])
    (first, _), (second, processor) = result["seconds"][0]
    return Cost(first, second, processor, result["peak"])


def times(scenes: Sequence[SceneFile], settings: Settings, pairs: int, say: Callable[[str], None]) -> Table:
    """Time pairs of processes, native and ours in turn, and return the table.

    Parameters
    ----------
    scenes : sequence of SceneFile
        What to render.
    settings : Settings
        Samples, size and bounces; the engine is replaced.
    pairs : int
        Pairs of processes for each scene; the ratio is the median over pairs.
    say : callable
        Told of each process.
    """
    pixels = settings.size[0] * settings.size[1]
    rows = []
    for scene in scenes:
        costs = {AUTOMATIC: [], TILES: []}
        for pair in range(pairs):
            # Who goes first changes from pair to pair, so that a machine that slows down favours nobody.
            for engine in (AUTOMATIC, TILES) if pair % 2 == 0 else (TILES, AUTOMATIC):
                costs[engine].append(cost(scene, replace(settings, engine=engine)))
                say(f"{scene.name}: {engine} {costs[engine][-1].second:.2f} s")
        rows.append([scene.name, *_row(costs[AUTOMATIC], costs[TILES], pixels)])
    header = ["", "native s", "tiles s", "ratio", "spread", "processor ratio", "first ratio", "bytes/pixel over native"]
    size = f"{settings.size[0]}x{settings.size[1]}, {settings.samples} spp"
    return Table(
        f"Wall time of one frame, {size}, second render of a process, median of {pairs} alternating pairs (spread: "
        "lowest to highest); the processor's time counts all cores, and not what other processes take",
        header,
        rows,
    )


def ratios(scene: SceneFile, settings: Settings, pairs: int) -> list[float]:
    """Return our wall time over native, one a pair of renders that follow each other in one process; cached.

    Parameters
    ----------
    scene : SceneFile
        What to render.
    settings : Settings
        Samples, size and bounces; the engine is replaced.
    pairs : int
        Pairs of renders, after one that makes the plan and loads Cycles' kernels.
    """
    path = result_path(scene, replace(settings, engine=TILES), f"{pairs}_pairs.json")
    if not path.is_file():
        both = [(replace(settings, engine=engine), {"repeats": 1}) for engine in (AUTOMATIC, TILES)]
        seconds = [wall for ((wall, _),) in run_worker(scene, both * (1 + pairs))["seconds"]]
        path.parent.mkdir(parents=True, exist_ok=True)
        with written_whole(path) as temporary:
            told = [ours / native for native, ours in zip(seconds[2::2], seconds[3::2], strict=True)]
            temporary.write_text(json.dumps(told))
    return json.loads(path.read_text())


def _row(native: Sequence[Cost], tiles: Sequence[Cost], pixels: int) -> list[str]:
    """Return the figures of one scene."""
    ratios = [ours.second / theirs.second for ours, theirs in zip(tiles, native, strict=True)]
    first = statistics.median(ours.first / theirs.first for ours, theirs in zip(tiles, native, strict=True))
    processor = statistics.median(ours.processor / theirs.processor for ours, theirs in zip(tiles, native, strict=True))
    memory = statistics.median(c.peak for c in tiles) - statistics.median(c.peak for c in native)
    return [
        f"{statistics.median(c.second for c in native):.2f}",
        f"{statistics.median(c.second for c in tiles):.2f}",
        f"{statistics.median(ratios):.3f}",
        f"{min(ratios):.2f}-{max(ratios):.2f}",
        f"{processor:.3f}",
        f"{first:.3f}",
        f"{memory / pixels:.0f}",
    ]
