# SPDX-License-Identifier: GPL-3.0-or-later
"""The automatic plan: Cycles' own samples, arranged for what the scene uses."""

import concurrent.futures

import numpy as np

from . import cycles_random, modes
from .arrangement import ALIGNMENT, arrange
from .plan import Plan, memory

# Blocks of the sequence are arranged within windows of this many pixels a side, a multiple of `ALIGNMENT`.  Windows
# that are worked at take about 120 bytes a pixel, so only one in `_SPREAD` is at a time.
_WINDOW, _SPREAD = 384, 7

# Modes of the error that are weighed, and pixels that tell which these are.
_MODES, _TRIAL = 16, 4096

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
    width = region.size[0]
    film = np.arange(region.pixels, dtype=np.int32)
    if not chosen:
        return Plan(seed, width, film)
    dims = sorted({name for group, _ in chosen for name in group})

    def numbers(ranks):
        index = ranks * np.uint32(samples) + np.arange(samples, dtype=np.uint32).reshape(-1, *(1,) * ranks.ndim)
        return cycles_random.leading_bytes(index, dims)

    candidates = modes.variances(chosen)
    error_modes = modes.strongest(candidates, numbers(np.arange(_TRIAL, dtype=np.uint32)), _MODES)

    def fill(window):
        y, x = (_aligned(part, start) for part, start in zip(window, region.corner[::-1], strict=True))
        y, x = y[:, None], x[None, :]
        ranks = cycles_random.pixel_ranks(x, y, seed)
        inside = region.holds(x, y)
        order = arrange(modes.features(error_modes, numbers(ranks)), len(error_modes), ranks, inside)
        place = (y - region.corner[1]) * width + (x - region.corner[0])
        film[place.ravel()[order[inside]]] = place[inside]

    windows = region.windows(_WINDOW)
    with concurrent.futures.ThreadPoolExecutor(max(1, len(windows) // _SPREAD)) as threads:
        list(threads.map(fill, windows))
    return Plan(seed, width, film)


def _aligned(part, start):
    """Absolute coordinates of a part of the region that starts at `start`, out to the next multiples of `ALIGNMENT`."""
    first, last = part.start + start, part.stop + start
    return np.arange(first - first % ALIGNMENT, last + -last % ALIGNMENT)
