# SPDX-License-Identifier: GPL-3.0-or-later
"""Parts of pictures, pixel by pixel."""

from collections.abc import Sequence
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from generator.atomic_file import written_whole

#: Pixels a side of the crops of a report, or of whole pictures that are smaller.
EDGE = 128


def crop(picture: np.ndarray, middle: Sequence[float], edge: int) -> np.ndarray:
    """Return the square of `edge` pixels around a point, moved inside the picture where it would reach out.

    Parameters
    ----------
    picture : ndarray
        Rows from the top.
    middle : sequence of float
        x and y of the point in parts of the picture, from the upper left.
    edge : int
        At most the picture's shorter side.
    """
    height, width = picture.shape[:2]
    left = int(np.clip(middle[0] * width - edge / 2, 0, width - edge))
    top = int(np.clip(middle[1] * height - edge / 2, 0, height - edge))
    return picture[top : top + edge, left : left + edge]


def write_crop(source: Path, middle: Sequence[float], path: Path) -> Path:
    """Write a crop of `EDGE` pixels a side of one .png to another and return its path."""
    path.parent.mkdir(parents=True, exist_ok=True)
    whole = plt.imread(source)[..., :3]
    with written_whole(path) as temporary:
        plt.imsave(temporary, np.ascontiguousarray(crop(whole, middle, min(EDGE, *whole.shape[:2]))))
    return path
