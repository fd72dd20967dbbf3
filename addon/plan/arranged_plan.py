# SPDX-License-Identifier: GPL-3.0-or-later
"""The automatic plan: Cycles' own samples, arranged for what the scene uses."""

import concurrent.futures
import functools
import os

import numpy as np

from ..blender.refusal import Cancelled
from ..cycles import aperture, random_numbers
from . import modes
from .arrangement import ALIGNMENT, arrange
from .sample_plan import MOST_PLANNED, Plan, remembered

# Blocks of the sequence are arranged within windows of this many pixels a side, a multiple of `ALIGNMENT`.  Windows
# that are worked at take some 200 bytes a pixel, so at most one in `_SPREAD` is at a time.
_WINDOW, _SPREAD = 256, 12

# Modes of the error that are weighed, of how many that are looked at, and samples that tell which these are.
_MODES, _CONSIDERED, _TRIAL = 18, 256, 4096

# Dimensions that integrands depend on together.
_TIME, _LENS, _LIGHT, _PICK = ("t",), aperture.dims(0), ("light.u", "light.v"), ("light.pick",)
_SCATTERING, _CLOSURE, _PICK_2 = ("bsdf.u", "bsdf.v"), ("bsdf.pick",), ("light2.pick",)

# What part of the variance of pictures comes from each, in percent, and from their interactions: about the mean of
# `python -m bench shares` over the scenes that use them.
SHARES = {
    (_TIME,): 5.0,
    (_LENS,): 10.0,
    (_LIGHT,): 4.0,
    (_PICK,): 14.0,
    (_SCATTERING,): 12.0,
    (_CLOSURE,): 2.5,
    (_SCATTERING, _CLOSURE): 1.5,
    (_LIGHT, _PICK): 0.5,
    (_TIME, _LIGHT): 0.5,
    (_SCATTERING, _PICK_2): 0.3,
    (_PICK_2,): 0.2,
}


def shares(use):
    """What the noise of a frame comes from, as `modes.variances` takes it.

    Parameters
    ----------
    use : SceneUse

    Returns
    -------
    list of (tuple of tuple of str, float)
    """
    used = set()
    if use.motion_blur:
        used.add(_TIME)
    if use.lens:
        used.add(_LENS)
    if use.lights:
        used.add(_LIGHT)
    if use.lights > 1:
        used.add(_PICK)
    if use.bounces or use.glow:
        used |= {_SCATTERING, _CLOSURE}
    if use.bounces and use.lights > 1:
        used.add(_PICK_2)
    seen = {_LENS: aperture.dims(use.blades)}
    return [
        (tuple(seen.get(group, group) for group in groups), share)
        for groups, share in SHARES.items()
        if used.issuperset(groups)
    ]


def make(use, region, samples, seed, is_cancelled=lambda: False):
    """Plan for a frame; remembered as of `sample_plan.remembered`.

    Parameters
    ----------
    use : SceneUse
    region : Region
    samples : int
        Samples a pixel.
    seed : int
        Another seed gives another, equally good plan; in [0, 2**31).
    is_cancelled : callable, optional
        Whether the user wants it no more; asked from several threads.

    Returns
    -------
    Plan

    Raises
    ------
    Cancelled
    """
    sources = tuple(shares(use))
    return remembered(
        (sources, samples), region, seed, lambda own_seed: _arrange(sources, region, samples, own_seed, is_cancelled)
    )


def _arrange(sources, region, samples, seed, is_cancelled):
    plan = Plan.in_place(seed, region)
    if not sources:
        return plan
    planned = min(samples, MOST_PLANNED)
    weighed = _error_modes(sources, planned)

    def fill(window):
        if is_cancelled():
            raise Cancelled
        y, x = (_aligned(part, start) for part, start in zip(window, region.corner[::-1], strict=True))
        y, x = y[:, None], x[None, :]
        inside = region.holds(x, y)
        ranks = random_numbers.pixel_ranks(x, y, seed)
        features = modes.features(weighed, numbers(weighed, ranks, planned, samples))
        order = arrange(features, len(weighed), ranks, inside)
        place = (y - region.corner[1]) * plan.width + (x - region.corner[0])
        plan.film[place.ravel()[order[inside]]] = place[inside]

    windows = region.windows(_WINDOW)
    at_once = min(os.process_cpu_count(), len(windows) // _SPREAD)
    with concurrent.futures.ThreadPoolExecutor(max(1, at_once)) as threads:
        list(threads.map(fill, windows))
    return plan


@functools.cache
def _error_modes(sources, samples):
    """The modes in which pixels differ most, as `modes.features` takes them.

    Parameters
    ----------
    sources : tuple
        Of `shares`.
    samples : int
        Samples of each pixel.
    """
    likely = modes.largest(modes.variances(sources), _CONSIDERED)
    ranks = np.arange(max(_TRIAL // samples, 256), dtype=np.uint32)
    return modes.strongest(likely, numbers(likely, ranks, samples, samples), _MODES)


def numbers(chosen, ranks, samples, sequence):
    """What modes depend on, at some samples of each pixel's share of the sequence.

    Parameters
    ----------
    chosen : iterable of tuple
        Modes.
    ranks : uint32 array
        Of the pixels (`random_numbers.pixel_ranks`).
    samples, sequence : int
        How many samples, of how many.

    Returns
    -------
    dict of str to uint8 array, shape (samples, *ranks.shape)
        Leading bytes of the numbers, by dimension (`aperture.leading_bytes`).
    """
    steps = np.arange(samples, dtype=np.uint32).reshape(-1, *(1,) * ranks.ndim)
    index = ranks * np.uint32(sequence) + steps
    dims = {name for mode in chosen for name, _ in mode}
    return aperture.leading_bytes(dims, lambda own: random_numbers.leading_bytes(index, own))


def _aligned(part, start):
    """Absolute coordinates of a part of the region that starts at `start`, out to the next multiples of `ALIGNMENT`."""
    first, last = part.start + start, part.stop + start
    return np.arange(first - first % ALIGNMENT, last + -last % ALIGNMENT, dtype=np.int32)
