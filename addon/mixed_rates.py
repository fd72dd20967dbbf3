# SPDX-License-Identifier: GPL-3.0-or-later
"""A picture whose pixels have several rates: how it looks at the base rate, and all of its samples together."""

import itertools

import numpy as np

from . import denoising, film
from .in_order import cleaned
from .reconstruction import Reconstruction

# Cycles' pass with the number of samples that each pixel got.
_SAMPLE_COUNT = "Debug Sample Count"


def base_picture(job, passes):
    """The picture at the base rate, (height, width, 4)."""
    width, height = job.region.size
    return film.combined(passes | denoising.noisy(passes)).reshape(height, width, 4)


def planes(job, passes):
    """All passes that may be mixed, as light: (channels, height, width)."""
    width, height = job.region.size
    return film.colours(passes, height, width)


def mixed(engine, job, first, base, further, levels, clean=None):
    """Passes of all samples together; as many as there are until the user cancels.

    Parameters
    ----------
    engine : bpy.types.RenderEngine
    job : gather.Job or subrender.Job
    first : dict
        Passes that the data are taken from.
    base, further : iterable of (planes, where, share)
        The samples of the base, and those that are taken beyond it: light, positions as of
        `reconstruction.positions`, and how many samples of each pixel it is the mean of.
    levels : int8 array, shape (height, width)
        Of each pixel (`adaptive.Rates`).
    clean : callable, optional
        Planes of the mean of all samples -> planes without the noise that is still known.
    """
    rates = job.rates
    count = rates.counts[levels].astype(np.float32)
    base_weight = rates.base_weight[levels]
    total = count - rates.base * (1.0 - base_weight)
    used, mean, heard, sums = [], 0.0, 0.0, None
    for light, where, share in itertools.chain(((*part, share * base_weight) for *part, share in base), further):
        weight = share / total
        mean += weight * light
        heard += weight
        if job.filter:
            sums = sums or Reconstruction(job.filter, *light.shape)
            sums.add(light, where, weight)
            if clean:
                used.append((where, weight))
        if engine.test_break():
            break
    # Not all samples are heard of if the user has cancelled.
    result = sums.pixels() if job.filter else mean / np.maximum(heard, 1e-20)
    if clean and not engine.test_break():
        noise = mean - planes(job, cleaned(job, film.with_colours(first, mean), clean))
        if job.filter:
            sums = Reconstruction(job.filter, *noise.shape)
            for where, weight in used:
                sums.add(noise, where, weight)
            noise = sums.pixels()
        result -= noise
    passes = film.with_colours(first, result)
    return passes | {key: count.reshape(-1, 1) for key in passes if key[0] == _SAMPLE_COUNT}
