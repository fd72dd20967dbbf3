# SPDX-License-Identifier: GPL-3.0-or-later
"""The automatic plan: Cycles' own samples, arranged for what the scene uses."""

import concurrent.futures
import functools

import numpy as np

from . import cycles_random, modes
from .arrangement import ALIGNMENT, arrange
from .failure import Cancelled
from .plan import LARGE, Plan, memory

# Blocks of the sequence are arranged within windows of this many pixels a side, a multiple of `ALIGNMENT`.  Windows
# that are worked at take 200 to 300 bytes a pixel, so only one in `_SPREAD` is at a time.
_WINDOW, _SPREAD = 384, 7

# Modes of the error that are weighed, and samples that tell which these are.
_MODES, _TRIAL = 24, 4096

# Frames of an animation are arranged in groups of this many that complement each other, each knowing those before it;
# the weight is what the group's mean counts beside the frame's own picture.
GROUP, WEIGHT = 4, 0.5


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


def place_in_group(seed, frame):
    """Which group of frames a frame belongs to.

    Parameters
    ----------
    seed : int
    frame : int or None
        None for a pattern that does not change with the frame.

    Returns
    -------
    group, first_seed, place : int
        The group's number, the Cycles seed of its first frame, and how many frames of it come before this one; each
        frame's Cycles seed is one more than that before it.
    """
    group, place = (0, 0) if frame is None else divmod(frame - 1, GROUP)
    return group, (seed + GROUP * group) % (2**31 - GROUP), place


def make(use, region, samples, seed, frame=None, sequence=None, is_cancelled=lambda: False):
    """Plan for a frame; remembered, so that other frames and seeds of a large region cost nothing.

    Parameters
    ----------
    use : analysis.SceneUse
    region : addon.region.Region
    samples : int
        Samples a pixel to arrange.
    seed : int
        Another seed gives another, equally good plan.
    frame : int, optional
        Of an animation whose pattern changes from frame to frame.  The first one costs as much as all of its group.
    sequence : int, optional
        Samples a pixel of Cycles' whole sequence, if those are only the first of it.
    is_cancelled : callable, optional
        Whether the user wants it no more; asked from several threads.

    Returns
    -------
    plan.Plan

    Raises
    ------
    Cancelled
    """
    chosen = tuple(groups(use))
    group, first_seed, place = place_in_group(seed, frame)
    is_large = region.pixels > LARGE
    frames = 1 if frame is None else GROUP
    key = (chosen, region, samples, sequence or samples, 0 if is_large else first_seed, frames)
    plan = memory.get(key, lambda: _arrange(*key, is_cancelled))[place]
    if not is_large:
        return plan
    return plan.moved(*np.random.default_rng((seed, group % 2**32)).integers(0, region.size))


def _arrange(chosen, region, samples, sequence, first_seed, frames, is_cancelled):
    """Plans of that many frames with consecutive seeds, each complementing those before it."""
    width = region.size[0]
    films = np.tile(np.arange(region.pixels, dtype=np.int32), (frames, 1))
    plans = [Plan(first_seed + place, width, film) for place, film in enumerate(films)]
    if not chosen:
        return plans
    error_modes = _error_modes(chosen, samples, sequence)

    def fill(window):
        y, x = (_aligned(part, start) for part, start in zip(window, region.corner[::-1], strict=True))
        y, x = y[:, None], x[None, :]
        inside = region.holds(x, y)
        place = (y - region.corner[1]) * width + (x - region.corner[0])
        before = None
        for plan in plans:
            if is_cancelled():
                raise Cancelled
            ranks = cycles_random.pixel_ranks(x, y, plan.seed)
            here = modes.features(error_modes, _numbers(error_modes, ranks, samples, sequence))
            is_last = plan is plans[-1]
            if not is_last:
                here = list(here)
            order = arrange(here, len(error_modes), ranks, inside, before)
            plan.film[place.ravel()[order[inside]]] = place[inside]
            if not is_last:
                seen = [np.float32(WEIGHT) * feature.ravel()[order] for feature in here]
                before = seen if before is None else [a + b for a, b in zip(before, seen, strict=True)]

    windows = region.windows(_WINDOW)
    with concurrent.futures.ThreadPoolExecutor(max(1, len(windows) // _SPREAD)) as threads:
        list(threads.map(fill, windows))
    return plans


@functools.cache
def _error_modes(chosen, samples, sequence):
    """The modes in which pixels with that many samples differ most."""
    total = modes.variances(chosen)
    ranks = np.arange(max(_TRIAL // samples, 256), dtype=np.uint32)
    return modes.strongest(total, _numbers(total, ranks, samples, sequence), _MODES)


def _numbers(error_modes, ranks, samples, sequence):
    """Leading bytes of what the modes depend on, at the first samples of each pixel's share of the sequence."""
    index = ranks * np.uint32(sequence) + np.arange(samples, dtype=np.uint32).reshape(-1, *(1,) * ranks.ndim)
    return cycles_random.leading_bytes(index, sorted({name for mode in error_modes for name, _ in mode}))


def _aligned(part, start):
    """Absolute coordinates of a part of the region that starts at `start`, out to the next multiples of `ALIGNMENT`."""
    first, last = part.start + start, part.stop + start
    return np.arange(first - first % ALIGNMENT, last + -last % ALIGNMENT)
