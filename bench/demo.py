# SPDX-License-Identifier: GPL-3.0-or-later
"""``python -m bench demo``: one scene by Cycles and by ours, denoised, in the same time, as pictures to look at."""

import shutil
from pathlib import Path

import matplotlib
import matplotlib.pyplot as plt
import numpy as np

from bench.doc_parts import write_picture
from bench.metrics import SIGMAS
from bench.real_figures import error_maps, seen
from bench.real_page import spot
from bench.real_renders import NATIVE, OURS, REFERENCE, REFERENCE_SEEDS, THRESHOLD, Render, Result, rendered
from bench.scene_files import SceneFile
from bench.table import Progress, table

CYCLES, SAME_TIME, TILES = "Cycles", "Cycles in the same time", "Spectral Tiles"

#: Crops below each picture: how many, how much enlarged, and what lies between them, in pixels.
_CROPS, _ZOOM, _MARGIN, _HEAD = 2, 4, 12, 34
_BACKGROUND = 0.11

#: Wall times that differ by less count as the same.
_SAME = 0.05


def make(scene: SceneFile, width: int, threshold: float, reference_samples: int, folder: Path, docs: bool) -> str:
    """Write both pictures and their comparison, and return the table of times and errors.

    Parameters
    ----------
    scene : SceneFile
        What to render.
    width : int
        Of the pictures in pixels; the height follows from the scene.
    threshold : float
        Noise threshold of Cycles and of ours. A third picture is Cycles' with the threshold that takes it as long as
        ours, within what one try finds.
    reference_samples : int
        Samples a pixel of each half of the converged picture, which has no denoiser.
    folder : Path
        Where to; made if missing.
    docs : bool
        Whether the comparison becomes the picture of README, too.
    """
    folder.mkdir(parents=True, exist_ok=True)
    progress = Progress(5)

    def picture(name: str, render: Render) -> Result:
        progress.step(f"{scene.name}: {name}")
        return rendered(scene, width, render)

    results = {
        CYCLES: picture(CYCLES, Render(NATIVE, THRESHOLD, threshold, denoise=True)),
        TILES: picture(TILES, Render(OURS, THRESHOLD, threshold, denoise=True)),
    }
    other = round(threshold * (results[CYCLES].wall / results[TILES].wall) ** 0.5, 4)
    results[SAME_TIME] = results[CYCLES]
    if abs(results[CYCLES].wall / results[TILES].wall - 1.0) > _SAME:
        results[SAME_TIME] = picture(SAME_TIME, Render(NATIVE, THRESHOLD, other, denoise=True))
    halves = [
        seen(picture("converged", Render(NATIVE, REFERENCE, reference_samples, seed=seed)).pixels())
        for seed in REFERENCE_SEEDS
    ]
    for name, result in results.items():
        shutil.copy(result.png, folder / f"{_file(name)}.png")
    sheet = _side_by_side({name: results[name] for name in (SAME_TIME, TILES)}, halves, folder / "side_by_side.png")
    if docs:
        write_picture("demo", sheet)

    rows = []
    for name in (CYCLES, SAME_TIME, TILES):
        errors = [error.mean() for error in error_maps(seen(results[name].pixels()), halves)]
        cells = (f"{1000 * max(error, 0.0) ** 0.5:.2f}" for error in errors)
        rows.append([name, f"{results[name].wall:.1f}", f"{results[name].processor:.1f}", *cells])
    title = f"{scene.name}, {width} px wide, denoised, noise threshold {threshold:g}; Cycles in the same time {other:g}"
    header = ["", "seconds", "processor's", *(f"RMSE x 1000, sigma {sigma}" for sigma in SIGMAS)]
    return f"{title}\n{table(header, rows)}\n\nPictures in {folder}, compared in side_by_side.png"


def _file(name: str) -> str:
    return name.lower().replace(" ", "_")


def _side_by_side(results: dict[str, Result], halves: list[np.ndarray], path: Path) -> np.ndarray:
    """Write pictures side by side, with enlarged crops below where their errors differ most; return the sheet."""
    maps = [error_maps(seen(result.pixels()), halves)[0] for result in results.values()]
    middles = _spots(maps[0] - maps[1])
    columns = [_column(plt.imread(result.png)[..., :3], middles) for result in results.values()]
    height, width = columns[0].shape[:2]
    sheet = np.full((_HEAD + height + _MARGIN, len(columns) * (width + _MARGIN) + _MARGIN, 3), _BACKGROUND, np.float32)
    lefts = [_MARGIN + i * (width + _MARGIN) for i in range(len(columns))]
    for left, column in zip(lefts, columns, strict=True):
        sheet[_HEAD : _HEAD + height, left : left + width] = column

    matplotlib.use("Agg")
    dpi = 100
    figure = plt.figure(figsize=(sheet.shape[1] / dpi, sheet.shape[0] / dpi), dpi=dpi)
    figure.figimage(sheet)
    for left, (name, result) in zip(lefts, results.items(), strict=True):
        text = f"{name.split(' in ')[0]}, {result.wall:.1f} seconds"
        figure.text(
            left / sheet.shape[1], 1 - _HEAD / 2 / sheet.shape[0], text, color="white", va="center", fontsize=12
        )
    figure.savefig(path, dpi=dpi)
    plt.close(figure)
    return plt.imread(path)[..., :3]


def _spots(difference: np.ndarray) -> list[tuple[float, float]]:
    """Return where errors differ most, in parts from the upper left: several places that lie apart."""
    left = np.array(difference)
    height, width = left.shape
    found = []
    for _ in range(_CROPS):
        (x, y), _gain = spot(left)
        found.append((x, y))
        row, column, apart = round((1 - y) * height), round(x * width), width // (_CROPS * _ZOOM)
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
