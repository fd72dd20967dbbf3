# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures side by side, with parts of them enlarged below, and what is wrong with them."""

from collections.abc import Sequence
from pathlib import Path

import matplotlib
import matplotlib.pyplot as plt
import numpy as np

from bench.crops import crop
from bench.real_page import spot
from generator.atomic_file import written_whole

#: Crops below each picture: how many, how much enlarged, and what lies between them, in pixels.
_CROPS, _ZOOM, _MARGIN, _HEAD = 2, 4, 12, 48
_BACKGROUND = 0.11
_DPI = 100


#: Part of the pixels whose errors the scale reaches, and the colours of more and more of it.
_SHOWN_ERRORS, _COLOURS = 0.99, "inferno"


def write(
    path: Path,
    shown: Sequence[tuple[str, str, np.ndarray]],
    difference: np.ndarray,
    errors: Sequence[np.ndarray] | None = None,
) -> np.ndarray:
    """Write a .png and return its pixels, RGB in [0, 1], rows from the top.

    Parameters
    ----------
    path : Path
    shown : sequence of (str, str, ndarray)
        Title, caption and picture of each, RGB in [0, 1], all of one shape, rows from the top.
    difference : ndarray
        What differs at each pixel, rows from the bottom: parts where it is largest are enlarged.
    errors : sequence of ndarray, optional
        How wrong each pixel of each picture is, rows from the bottom, drawn below on one scale.
    """
    middles = _spots(difference)
    maps = [[]] * len(shown) if errors is None else [[each] for each in _coloured(errors)]
    columns = [_column(picture, middles, *below) for (_, _, picture), below in zip(shown, maps, strict=True)]
    height, width = columns[0].shape[:2]
    sheet = np.full((_HEAD + height + _MARGIN, len(columns) * (width + _MARGIN) + _MARGIN, 3), _BACKGROUND, np.float32)
    lefts = [_MARGIN + i * (width + _MARGIN) for i in range(len(columns))]
    for left, column in zip(lefts, columns, strict=True):
        sheet[_HEAD : _HEAD + height, left : left + width] = column

    matplotlib.use("Agg")
    size = (sheet.shape[1] / _DPI, sheet.shape[0] / _DPI)
    figure = plt.figure(figsize=size, dpi=_DPI, facecolor=(_BACKGROUND,) * 3)
    figure.figimage(sheet)
    for left, (title, caption, _) in zip(lefts, shown, strict=True):
        for text, size, line in ((title, 12, 15), (caption, 9, 35)):
            x, y = left / sheet.shape[1], 1 - line / sheet.shape[0]
            figure.text(x, y, text, color="white", va="center", fontsize=size)
        if errors is not None:
            x, y = (left + 6) / sheet.shape[1], (_MARGIN + 10) / sheet.shape[0]
            figure.text(x, y, "Error: the brighter, the more", color="white", va="center", fontsize=9)
    with written_whole(path) as temporary:
        figure.savefig(temporary, dpi=_DPI)
    plt.close(figure)
    return plt.imread(path)[..., :3]


def _coloured(errors: Sequence[np.ndarray]) -> list[np.ndarray]:
    """Return pictures of errors, RGB in [0, 1], rows from the top."""
    most = np.quantile(errors, _SHOWN_ERRORS)
    colours = matplotlib.colormaps[_COLOURS]
    return [colours(np.clip(each[::-1] / most, 0.0, 1.0))[..., :3].astype(np.float32) for each in errors]


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


def _column(picture: np.ndarray, middles: list[tuple[float, float]], *others: np.ndarray) -> np.ndarray:
    """Return a picture over its enlarged crops, which share its width, and over others of that width."""
    height, width = picture.shape[:2]
    edge = (width - (len(middles) - 1) * _MARGIN) // len(middles) // _ZOOM
    edge = min(edge, height)
    below = np.full((edge * _ZOOM, width, 3), _BACKGROUND, np.float32)
    for i, middle in enumerate(middles):
        left = i * (edge * _ZOOM + _MARGIN)
        below[:, left : left + edge * _ZOOM] = crop(picture, middle, edge).repeat(_ZOOM, 0).repeat(_ZOOM, 1)
    gap = np.full((_MARGIN, width, 3), _BACKGROUND, np.float32)
    return np.concatenate((picture, gap, below, *(part for other in others for part in (gap, other))))
