# SPDX-License-Identifier: GPL-3.0-or-later
"""``python -m bench shares``: which of Cycles' random numbers the noise of pictures comes from.

An analysis of variance: in blocks of a few pixels, whose integrands are alike, the radiance of many renders is
projected on the modes of the numbers that each sample drew.  `addon.plan.arranged_plan.SHARES` are rounded means of
what this prints.
"""

from collections.abc import Sequence

import numpy as np

from addon.cycles import random_numbers
from addon.plan import arranged_plan, modes
from bench.jobs import AUTOMATIC, Settings, images
from bench.metrics import LUMINANCE
from bench.scene_files import SceneFile
from bench.table import Progress, table

# Pixels a side whose integrands count as one.
_BLOCK = 4


def report(scenes: Sequence[SceneFile], lines: int, seeds: Sequence[int]) -> str:
    """Return a table of the terms of the variance of each scene, in percent of its luminance's.

    Parameters
    ----------
    scenes : sequence of SceneFile
        What to render, with one native sample a pixel.
    lines : int
        Width and height, a multiple of the blocks' size.
    seeds : sequence of int
        One render each.
    """
    progress = Progress(len(scenes))
    rows = []
    for scene in scenes:
        progress.step(scene.name)
        pictures = images(scene, Settings(engine=AUTOMATIC, size=(lines, lines)), seeds)
        noise = np.stack(pictures) @ LUMINANCE
        noise -= noise.mean(axis=0)
        y, x = np.mgrid[:lines, :lines]
        ranks = np.stack([random_numbers.pixel_ranks(x, y, seed) for seed in seeds])
        rows.append([scene.name, *(100.0 * _share(noise, ranks, groups) for groups in arranged_plan.SHARES)])
    names = [" x ".join("+".join(group) for group in groups) for groups in arranged_plan.SHARES]
    means = np.mean([row[1:] for row in rows], axis=0)
    lines_ = [[name, *(f"{row[i + 1]:.1f}" for row in rows), f"{means[i]:.1f}"] for i, name in enumerate(names)]
    return table(["% of the variance", *(row[0] for row in rows), "mean"], lines_)


def _share(noise: np.ndarray, ranks: np.ndarray, groups: tuple) -> float:
    """Return the part of the variance that lies in the modes of an interaction of groups of dimensions."""
    chosen = list(modes.variances([(groups, 1.0)]))
    found = 0.0
    for wave in modes.waves(chosen, arranged_plan.numbers(chosen, ranks, 1, 1)):
        wave /= np.sqrt(np.mean(wave**2))
        product = _in_blocks(noise * wave)
        # The square of a mean is too large by the mean's own variance.
        found += np.sum(product.mean(axis=0) ** 2 - product.var(axis=0, ddof=1) / len(product))
    return found / np.sum(np.mean(_in_blocks(noise) ** 2, axis=0))


def _in_blocks(stack: np.ndarray) -> np.ndarray:
    """Return (pictures, height, width) as (samples of a block, blocks)."""
    count, height, width = stack.shape
    blocks = stack.reshape(count, height // _BLOCK, _BLOCK, width // _BLOCK, _BLOCK).transpose(0, 2, 4, 1, 3)
    return blocks.reshape(count * _BLOCK**2, -1)
