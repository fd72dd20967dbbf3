# SPDX-License-Identifier: GPL-3.0-or-later
"""How near *By Noise* comes to whoever knew every square's variance, replayed on Cycles' own samples of real files.

Cycles renders each file by parts of the sequences that `addon.plan.rounds` asks for.  From these the pictures of the
same samples everywhere, of our rates, and of rates by known variance are put together, and their errors and times
compared without the machine's moods: times are sums of Cycles' *Render Time* pass.
"""

import json
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from addon.plan import rates, rounds
from addon.plan.costs import Counted
from bench.cache import CACHE
from bench.jobs import RenderFailed, blender_version
from bench.metrics import SIGMAS
from bench.real_figures import error_maps, seen
from bench.real_renders import NATIVE, REFERENCE, REFERENCE_SEEDS, Render, blend_files, rendered
from bench.scene_files import ROOT, SceneFile
from bench.table import Progress, table

#: Side of the squares whose variance is known.
_SIDE = 8


def report(folder: Path, names: Sequence[str], width: int, samples: int, reference_samples: int) -> str:
    """Return a table of errors and times over those of the same samples everywhere.

    Parameters
    ----------
    folder, names
        As of `bench.real.report`.
    width : int
        Of the pictures in pixels.
    samples : int
        Mean samples of a pixel, a power of two of at least 16.
    reference_samples : int
        Of each half of a reference.

    Raises
    ------
    ValueError
        There are no such files, or `samples` is no such number.
    RenderFailed
        Cycles cannot render a file.
    """
    if samples < 16 or samples & (samples - 1):
        raise ValueError("samples are a power of two, at least 16")
    files = blend_files(folder, names)
    progress = Progress(len(files))
    rows = []
    for file in files:
        progress.step(file.name)
        rows.append([file.name, *_figures(file, width, samples, reference_samples)])
    header = ["", "part of a sequence", "error, ours", "time, ours", "error, known", "time, known"]
    return (
        f"Over {samples} samples everywhere, at sigma 0 / 1, {width} px: mean square error of the first {samples} of a "
        f"sequence of {4 * samples}; error with rates of the same mean, and time to the same error, ours and by known "
        f"variance\n\n{table(header, rows)}"
    )


def _figures(file: SceneFile, width: int, samples: int, reference_samples: int) -> list[str]:
    halves = [
        seen(rendered(file, width, Render(NATIVE, REFERENCE, reference_samples, seed=seed)).pixels())
        for seed in REFERENCE_SEEDS
    ]
    record = _Record(file, width, samples)

    def errors(picture: np.ndarray) -> np.ndarray:
        return np.array([each.mean() for each in error_maps(seen(picture), halves)])[: SIGMAS.index(1) + 1]

    def even(count: int, length: int) -> np.ndarray:
        return errors(record.sums[length, count] / count)

    least = even(samples, samples)
    slope = np.log(4.0) / np.log(least / even(4 * samples, 4 * samples))
    cells = [_cell(even(samples, 4 * samples) / least)]
    for picture, time in (_ours(record, samples), _limit(record, samples, np.square(halves[0] - halves[1]))):
        error = errors(picture) / least
        cells += [_cell(error), _cell(time * error**slope)]
    return cells


def _cell(values: np.ndarray) -> str:
    return " / ".join(f"{value:.2f}" for value in values)


class _Record:
    """Sums of the first samples of sequences, by (length, count), and what a sample of each pixel costs."""

    def __init__(self, file: SceneFile, width: int, samples: int):
        eighth = samples // 8
        starts = [(samples, 0, eighth), *((samples, eighth << k, eighth << k) for k in range(3))]
        longer = [(4 * samples, 0, samples), (4 * samples, samples, 3 * samples)]
        parts = starts + longer + [(samples << k, 0, samples << k) for k in (1, 3, 4)]
        found = np.load(_recorded(file, width, parts))
        self.cost = found["cost"].astype(float)
        self.sums = {}
        for (length, first, count), picture in zip(parts, found["pictures"], strict=True):
            before = self.sums.get((length, first), np.float32(0.0))
            self.sums[length, first + count] = before + np.float32(count) * picture.astype(np.float32)


def _recorded(file: SceneFile, width: int, parts: list) -> Path:
    folder = CACHE / "limits" / blender_version() / f"{file.name.replace('/', '+')}-{file.key}"
    path = folder / f"{width}-{parts[0][0]}.npz"
    if not path.is_file():
        folder.mkdir(parents=True, exist_ok=True)
        order = {"blend": str(file.path), "width": width, "parts": parts, "record": str(path)}
        command = [sys.executable, "-m", "bench.limits_worker", json.dumps(order)]
        done = subprocess.run(command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, errors="replace")
        if done.returncode:
            raise RenderFailed(f"{file.name}: {done.stdout.strip().splitlines()[-1]}")
    return path


class _Replay:
    """A picture that grows by shots, as `addon.plan.rounds` wants to see it, out of a record."""

    def __init__(self, record: _Record, samples: int):
        self._record = record
        self.size = record.cost.shape[::-1]
        self.costs = Counted(self.size)
        base = rounds.Goal(samples).base(0.0)
        self.base = base
        self.half = record.sums[samples, base // 2] / (base // 2)
        self.mean = record.sums[samples, base] / base
        self.counted, self.time = base * record.cost.size, base * record.cost.sum()

    def shoot(self, shots: Sequence[rounds.Shot]) -> None:
        for (left, bottom, width, height), length, first, count in shots:
            part = slice(bottom, bottom + height), slice(left, left + width)
            self.mean[part] = self._record.sums[length, first + count][part] / (first + count)
            self.counted += count * self.costs.pixels[part].sum()
            self.time += count * self._record.cost[part].sum()


def _ours(record: _Record, samples: int) -> tuple[np.ndarray, float]:
    """Return the picture that our rates leave, and its time over that of the same samples everywhere."""
    replay = _Replay(record, samples)
    for shots in rounds.rounds(rounds.Goal(samples), replay.base, replay, replay.costs, lambda: replay.counted):
        replay.shoot(shots)
    return replay.mean, replay.time / (samples * record.cost.sum())


def _limit(record: _Record, samples: int, variance: np.ndarray) -> tuple[np.ndarray, float]:
    """Return the same for rates by a variance that other samples tell, and by true costs, in the same time."""
    replay = _Replay(record, samples)
    steps = rates.Rates(replay.base, samples, rounds.Goal(samples).most)
    squares = rates.Squares(record.cost.shape[::-1], _SIDE)
    prices = squares.sums(record.cost)
    wish = 0.5 * np.log2((squares.sums(variance) + 1e-12) / np.maximum(prices, 1e-12))
    levels = np.zeros(squares.areas.shape, int)
    seconds = (samples - steps.base) * record.cost.sum()
    wanted = rates.levels_in_time(wish, prices, levels, steps, steps.top, seconds)
    for level in range(1, wanted.max() + 1):
        first, count = (int(find(0, level)) for find in (steps.kept, steps.further))
        rectangles = squares.rectangles(wanted == level)
        replay.shoot([rounds.Shot(each, max(first + count, samples), first, count) for each in rectangles])
    return replay.mean, replay.time / (samples * record.cost.sum())
