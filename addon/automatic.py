# SPDX-License-Identifier: GPL-3.0-or-later
"""The automatic plan: Cycles' own samples, arranged for what the scene uses."""

import concurrent.futures

import numpy as np

from . import cycles_random
from .arrangement import arrange, features, modes
from .plan import Plan, memory

# Blocks of the sequence are arranged within windows of this many pixels a side.
_WINDOW = 256

# Modes of the error that are weighed.  Three times as many gain about half a percent on the bench scenes.
_MODES = 24

# A region of more pixels than this has samples enough to be moved about for every seed and frame: its plan is made
# once.  A smaller one is cheap to arrange, and would show the same few samples again and again.
_LARGE = 256 * 256


def groups(use):
    """Dimensions that decide together about a sample's radiance, and how much each group counts.

    Parameters
    ----------
    use : analysis.SceneUse

    Returns
    -------
    list of (tuple of str, float)
    """
    light = ("light.u", "light.v")
    picked = (*light, "light.pick")
    scattered = ("bsdf.u", "bsdf.v")
    chosen = []
    if use.motion_blur:
        chosen.append((("t",), 1.0))
    if use.lens:
        chosen.append((("lens.u", "lens.v"), 1.0))
    if use.lights:
        chosen.append((light, 1.0))
    if use.lights > 1:
        chosen.append((picked, 1.0))
    if use.motion_blur and use.lights:
        chosen.append((("t", *light), 1.0))
    if use.bounces:
        chosen += [(scattered, 1.0), ((*scattered, "bsdf.pick"), 1.0)]
        if use.lights:
            chosen.append(((*scattered, "light2.u", "light2.v", "light2.pick"), 0.7))
    return chosen


def make(use, region, samples, seed):
    """Plan for a frame; remembered, so that other frames and seeds of a large region cost nothing.

    Parameters
    ----------
    use : analysis.SceneUse
    region : addon.region.Region
    samples : int
        Samples a pixel, all in one Cycles render.
    seed : int
        Another seed gives another, equally good plan.

    Returns
    -------
    plan.Plan
    """
    chosen = tuple(groups(use))

    def remembered(cycles_seed):
        key = (chosen, region, samples, cycles_seed)
        return memory.get(key, lambda: _arrange(*key))

    if region.pixels <= _LARGE:
        return remembered(seed)
    return remembered(0).moved(*np.random.default_rng(seed).integers(0, region.size))


def _arrange(chosen, region, samples, seed):
    width, height = region.size
    film = np.arange(region.pixels, dtype=np.int32).reshape(height, width)
    dims = sorted({name for group, _ in chosen for name in group})
    error_modes = modes([(tuple(map(dims.index, group)), share) for group, share in chosen], _MODES)

    def fill(window):
        y, x = np.mgrid[_whole_blocks(window, region.corner)]
        if not y.size:
            return
        ranks = cycles_random.pixel_ranks(x + region.corner[0], y + region.corner[1], seed)
        index = ranks.ravel()[:, None] * np.uint32(samples) + np.arange(samples, dtype=np.uint32)
        values = cycles_random.sequence_values(index, dims)
        here = arrange(features(values, error_modes).reshape(*y.shape, -1), ranks)
        place = (y * width + x).ravel()
        film.ravel()[place[here.ravel()]] = place

    with concurrent.futures.ThreadPoolExecutor() as threads:
        list(threads.map(fill, region.windows(_WINDOW)))
    return Plan(seed, width, film.ravel())


def _whole_blocks(window, corner):
    """The part of a window (rows, columns) that is made of whole 4 x 4 blocks of the full frame's grid."""

    def whole(part, start):
        first = part.start + -(part.start + start) % 4
        return slice(first, max(first, part.stop - (part.stop + start) % 4))

    return whole(window[0], corner[1]), whole(window[1], corner[0])
