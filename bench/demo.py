# SPDX-License-Identifier: GPL-3.0-or-later
"""``python -m bench demo``: one scene natively and with the tile at equal samples, as pictures to look at."""

from dataclasses import replace
from pathlib import Path

import matplotlib
import matplotlib.pyplot as plt
import numpy as np

from bench.errors import HEADER, rmse_cells
from bench.jobs import AUTOMATIC, TILES, Settings, run_worker
from bench.metrics import SIGMAS, mean_square_error
from bench.reference import reference
from bench.scene_files import SceneFile
from bench.table import Progress, table

LABELS = {AUTOMATIC: "Cycles", TILES: "Cycles with Spectral Tiles"}
FILES = {AUTOMATIC: "native", TILES: "spectral_tiles"}

#: Where the zoomed crops are, as (x, y) of their centre in parts of the picture from the upper left.
CROPS = ((0.48, 0.30), (0.62, 0.62))
ZOOM = 4
MARGIN = 12
HEAD = 34
BACKGROUND = 0.11


def make(scene: SceneFile, settings: Settings, seed: int, reference_samples: int, folder: Path) -> str:
    """Write both pictures (EXR, PNG) and their comparison, and return the table of errors.

    Parameters
    ----------
    scene : SceneFile
        What to render.
    settings : Settings
        Samples, size and bounces; the engine is replaced.
    seed : int
        Of both renders.
    reference_samples : int
        Samples a pixel of each half of the reference.
    folder : Path
        Where to; made if missing.
    """
    folder.mkdir(parents=True, exist_ok=True)
    progress = Progress(len(FILES))
    pixels = {}
    for engine, name in FILES.items():
        progress.step(f"{scene.name}: {LABELS[engine]}, {settings.samples} spp")
        stem = (folder / name).resolve()
        run_worker(scene, [(replace(settings, engine=engine), {"pictures": [[seed, str(stem)]]})])
        linear = stem.with_suffix(".npy")
        pixels[engine] = np.load(linear)
        linear.unlink()
    truth = reference(scene, settings, reference_samples, progress.say)
    errors = {engine: [mean_square_error(image, truth, sigma) for sigma in SIGMAS] for engine, image in pixels.items()}
    comparison = folder / "side_by_side.png"
    _compare(folder, comparison, settings.samples)

    rows = [[LABELS[engine], *rmse_cells(row)] for engine, row in errors.items()]
    ratios = np.divide(errors[TILES], errors[AUTOMATIC])
    rows.append(["ratio of MSE", *(f"{value:.3f}" for value in ratios)])
    title = f"RMSE x 1000 of luminance, {settings.samples} spp, after a Gaussian of sigma pixels (one seed)"
    figures = table(HEADER, rows)
    return f"{title}\n{figures}\n\nPictures in {folder}, compared in {comparison.name}"


def _compare(folder: Path, path: Path, samples: int) -> None:
    """Write the pictures side by side with labels, zoomed crops under each, pixel by pixel."""
    columns = [_column(plt.imread(folder / f"{name}.png")[..., :3]) for name in FILES.values()]
    height, width = columns[0].shape[:2]
    sheet = np.full((HEAD + height + MARGIN, len(columns) * (width + MARGIN) + MARGIN, 3), BACKGROUND, np.float32)
    lefts = [MARGIN + i * (width + MARGIN) for i in range(len(columns))]
    for left, column in zip(lefts, columns, strict=True):
        sheet[HEAD : HEAD + height, left : left + width] = column

    matplotlib.use("Agg")
    dpi = 100
    figure = plt.figure(figsize=(sheet.shape[1] / dpi, sheet.shape[0] / dpi), dpi=dpi)
    figure.figimage(sheet)
    for left, label in zip(lefts, LABELS.values(), strict=True):
        text = f"{label}, {samples} {'sample' if samples == 1 else 'samples'} a pixel"
        figure.text(left / sheet.shape[1], 1 - HEAD / 2 / sheet.shape[0], text, color="white", va="center", fontsize=12)
    figure.savefig(path, dpi=dpi)
    plt.close(figure)


def _column(picture: np.ndarray) -> np.ndarray:
    """Return a picture over its zoomed crops, which share its width."""
    height, width = picture.shape[:2]
    edge = (width - (len(CROPS) - 1) * MARGIN) // len(CROPS) // ZOOM
    below = np.full((edge * ZOOM, width, 3), BACKGROUND, np.float32)
    for i, (x, y) in enumerate(CROPS):
        top = int(np.clip(y * height - edge / 2, 0, max(height - edge, 0)))
        start = int(np.clip(x * width - edge / 2, 0, width - edge))
        crop = picture[top : top + edge, start : start + edge].repeat(ZOOM, 0).repeat(ZOOM, 1)
        left = i * (edge * ZOOM + MARGIN)
        below[: len(crop), left : left + crop.shape[1]] = crop
    gap = np.full((MARGIN, width, 3), BACKGROUND, np.float32)
    return np.concatenate((picture, gap, below))
