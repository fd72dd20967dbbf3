# SPDX-License-Identifier: GPL-3.0-or-later
"""``python -m bench demo``: one scene by Cycles and by ours, denoised, in the same time, as pictures to look at."""

import shutil
from collections.abc import Callable
from pathlib import Path

import matplotlib
import matplotlib.pyplot as plt
import numpy as np

from bench.doc_parts import renew, write_picture
from bench.metrics import SIGMAS
from bench.real_figures import error_maps, seen
from bench.real_page import spot, threshold_in
from bench.real_renders import NATIVE, OURS, REFERENCE, REFERENCE_SEEDS, THRESHOLD, Render, Result, rendered
from bench.scene_files import ROOT, SceneFile
from bench.table import Progress, table

CYCLES, SAME_TIME, TILES = "Cycles", "Cycles in the same time", "Spectral Tiles"

#: Crops below each picture: how many, how much enlarged, and what lies between them, in pixels.
_CROPS, _ZOOM, _MARGIN, _HEAD = 2, 4, 12, 48
_BACKGROUND = 0.11

#: Processor times that differ by less count as the same at once; by less than the second, once the tries are used up.
_SAME, _NEAR = 0.05, 0.10

#: Renders that look for Cycles' threshold.
_TRIES = 3


def make(scene: SceneFile, width: int, threshold: float, reference_samples: int, folder: Path, docs: bool) -> str:
    """Write both pictures and their comparison, and return the table of times and errors.

    Parameters
    ----------
    scene : SceneFile
        What to render.
    width : int
        Of the pictures in pixels; the height follows from the scene.
    threshold : float
        Noise threshold of Cycles and of ours. The picture beside ours is Cycles' with the threshold that takes it as
        much of the processor's time, found by a few renders.
    reference_samples : int
        Samples a pixel of each half of the converged picture, which has no denoiser.
    folder : Path
        Where to; made if missing.
    docs : bool
        Whether the comparison becomes the picture of README, too.

    Raises
    ------
    ValueError
        No such threshold was found; the pictures are written, and the message holds the table.
    """
    folder.mkdir(parents=True, exist_ok=True)
    progress = Progress(4 + _TRIES)

    def picture(name: str, render: Render) -> Result:
        progress.step(f"{scene.name}: {name}, {render.setting}")
        return rendered(scene, width, render)

    def native(value: float) -> Result:
        return picture(CYCLES, Render(NATIVE, THRESHOLD, value, denoise=True))

    ours = picture(TILES, Render(OURS, THRESHOLD, threshold, denoise=True))
    first = native(threshold)
    other, same_time = _in_time(threshold, first, ours.processor, native)
    results = {CYCLES: first, SAME_TIME: same_time, TILES: ours}
    thresholds = {CYCLES: threshold, SAME_TIME: other, TILES: threshold}
    halves = [
        seen(picture("converged", Render(NATIVE, REFERENCE, reference_samples, seed=seed)).pixels())
        for seed in REFERENCE_SEEDS
    ]
    errors = {}
    for name, result in results.items():
        shutil.copy(result.png, folder / f"{_file(name)}.png")
        maps = error_maps(seen(result.pixels()), halves)
        errors[name] = [1000 * max(float(each.mean()), 0.0) ** 0.5 for each in maps]
    shown = {
        name: (results[which], f"noise threshold {thresholds[which]:g}, denoised: {results[which].processor:.0f} s")
        for name, which in ((CYCLES, SAME_TIME), (TILES, TILES))
    }
    sheet = _side_by_side(shown, halves, folder / "side_by_side.png")

    rows = [
        [
            f"{name}, threshold {thresholds[name]:g}",
            *(f"{seconds:.1f}" for seconds in (results[name].processor, results[name].wall)),
            *(f"{error:.2f}" for error in errors[name]),
        ]
        for name in results
    ]
    header = ["", "processor s", "wall s", *(f"RMSE x 1000, sigma {sigma}" for sigma in SIGMAS)]
    text = f"{scene.name}, {width} px wide, denoised\n{table(header, rows)}\n\nPictures in {folder}"
    if not _is_near(same_time, ours.processor, _NEAR):
        raise ValueError(f"{text}\nNo threshold was found with which Cycles takes as long as ours.")
    if docs:
        write_picture("demo", sheet)
        renew(ROOT / "README.md", "demo", _caption(scene, results, thresholds, errors))
    return f"{text}, compared in side_by_side.png"


def _in_time(threshold: float, result: Result, time: float, render: Callable) -> tuple[float, Result]:
    """Return the threshold, of a few tries, with which Cycles comes nearest to a processor time, and its picture.

    Parameters
    ----------
    threshold, result : float, Result
        What is known.
    time : float
        Seconds.
    render : callable
        From threshold to `Result`.
    """
    tried = {threshold: result}
    for _ in range(_TRIES):
        nearest = min(tried.items(), key=lambda each: abs(np.log(each[1].processor / time)))
        threshold = threshold_in([(value, each.processor) for value, each in tried.items()], time)
        if _is_near(nearest[1], time, _SAME) or threshold in tried:
            break
        tried[threshold] = render(threshold)
    return min(tried.items(), key=lambda each: abs(np.log(each[1].processor / time)))


def _is_near(result: Result, time: float, within: float) -> bool:
    return abs(result.processor / time - 1.0) <= within


def _caption(scene: SceneFile, results: dict, thresholds: dict, errors: dict) -> str:
    """Return README's picture with what it shows."""
    cycles, ours = (
        f"a noise threshold of {thresholds[name]:g}, {results[name].processor:.0f} s of the processor's time"
        for name in (SAME_TIME, TILES)
    )
    less = errors[TILES][0] / errors[SAME_TIME][0]
    alt = "The same scene by Cycles and by Spectral Tiles in the same time, with enlarged parts below"
    return (
        f"![{alt}](docs/demo.jpg)\n\n"
        f"Both denoised, in the same time. Left Cycles with {cycles}; right Spectral Tiles with {ours}, and "
        f"{less:.2f} of the error\n(root mean square; `python -m bench demo --scene {scene.name}`)."
    )


def _file(name: str) -> str:
    return name.lower().replace(" ", "_")


def _side_by_side(shown: dict[str, tuple[Result, str]], halves: list[np.ndarray], path: Path) -> np.ndarray:
    """Write pictures with their captions side by side, enlarged where their errors differ most; return the sheet."""
    maps = [error_maps(seen(result.pixels()), halves)[0] for result, _ in shown.values()]
    middles = _spots(maps[0] - maps[1])
    columns = [_column(plt.imread(result.png)[..., :3], middles) for result, _ in shown.values()]
    height, width = columns[0].shape[:2]
    sheet = np.full((_HEAD + height + _MARGIN, len(columns) * (width + _MARGIN) + _MARGIN, 3), _BACKGROUND, np.float32)
    lefts = [_MARGIN + i * (width + _MARGIN) for i in range(len(columns))]
    for left, column in zip(lefts, columns, strict=True):
        sheet[_HEAD : _HEAD + height, left : left + width] = column

    matplotlib.use("Agg")
    dpi = 100
    figure = plt.figure(figsize=(sheet.shape[1] / dpi, sheet.shape[0] / dpi), dpi=dpi)
    figure.figimage(sheet)
    for left, (name, (_, caption)) in zip(lefts, shown.items(), strict=True):
        for text, size, line in ((name, 12, 15), (caption, 9, 35)):
            x, y = left / sheet.shape[1], 1 - line / sheet.shape[0]
            figure.text(x, y, text, color="white", va="center", fontsize=size)
    figure.savefig(path, dpi=dpi)
    plt.close(figure)
    return plt.imread(path)[..., :3]


def _spots(difference: np.ndarray) -> list[tuple[float, float]]:
    """Return where errors differ most, in parts from the upper left: several places that lie apart."""
    left = np.array(difference)
    height, width = left.shape
    found = []
    for _ in range(_CROPS):
        apart = width // (_CROPS * _ZOOM)
        (x, y), _gain = spot(left, apart)
        found.append((x, y))
        row, column = round((1 - y) * height), round(x * width)
        left[max(0, row - apart) : row + apart, max(0, column - apart) : column + apart] = 0.0
    return found


def _column(picture: np.ndarray, middles: list[tuple[float, float]]) -> np.ndarray:
    """Return a picture over its enlarged crops, which share its width."""
    height, width = picture.shape[:2]
    edge = (width - (len(middles) - 1) * _MARGIN) // len(middles) // _ZOOM
    rows = min(edge, height)
    below = np.full((rows * _ZOOM, width, 3), _BACKGROUND, np.float32)
    for i, (x, y) in enumerate(middles):
        top = int(np.clip(y * height - rows / 2, 0, height - rows))
        start = int(np.clip(x * width - edge / 2, 0, width - edge))
        crop = picture[top : top + rows, start : start + edge].repeat(_ZOOM, 0).repeat(_ZOOM, 1)
        left = i * (edge * _ZOOM + _MARGIN)
        below[:, left : left + crop.shape[1]] = crop
    gap = np.full((_MARGIN, width, 3), _BACKGROUND, np.float32)
    return np.concatenate((picture, gap, below))
