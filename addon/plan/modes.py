# SPDX-License-Identifier: GPL-3.0-or-later
"""Cosine modes of a sample's parameters: the ways in which integrands vary.

The error that a pattern of samples leaves in each mode tells its error for all integrands (Mitchell 1991, section 5);
the modes that are strong in pictures vary along few parameters, and slowly.
"""

import functools
import itertools
import math

import numpy as np

# Half-periods along one dimension, at most.
_HIGHEST = 6

# Modes whose features are made together: few, for the sake of memory.
_TOGETHER = 2

# Half a period, in the middles of the 256 intervals that a number's leading byte tells apart.
_COSINES = np.cos(np.pi * (np.arange(256) + 0.5) / 256).astype(np.float32)


def variances(shares):
    """How much of a picture's variance to blame on each mode.

    Parameters
    ----------
    shares : sequence of (tuple of tuple of str, float)
        Groups of dimensions whose interaction causes variance (a single one: what it causes by itself), and how much:
        the terms of an analysis of variance.

    Returns
    -------
    dict of tuple of (str, int) to float
        A mode is the number of its half-periods along each dimension that it depends on.  Within a group the power at
        the wave vector m falls like |m|^-3, as for a step along a random line in the plane.
    """
    total = {}
    for groups, share in shares:
        power = {}
        for waves_of_groups in itertools.product(*map(_group_powers, groups)):
            mode = tuple(sorted(itertools.chain(*(mode for mode, _ in waves_of_groups))))
            power[mode] = math.prod(value for _, value in waves_of_groups)
        scale = share / sum(power.values())
        for mode, value in power.items():
            total[mode] = total.get(mode, 0.0) + scale * value
    return total


def _group_powers(dims):
    """Modes along some dimensions, with their power."""
    for numbers in itertools.product(range(_HIGHEST + 1), repeat=len(dims)):
        if any(numbers):
            mode = tuple((name, m) for name, m in zip(dims, numbers, strict=True) if m)
            yield mode, sum(m * m for m in numbers) ** -1.5


def features(chosen, numbers):
    """What each pixel's samples contribute to the error in each mode.

    Parameters
    ----------
    chosen : dict of tuple to float
        Modes and their variances, of `variances`.
    numbers : dict of str to uint8 array, shape (samples, ...)
        Leading bytes of the samples' parameters, by dimension (`random_numbers.leading_bytes`).

    Yields
    ------
    float32 array, shape (...)
        One mode's mean over a pixel's samples, without its mean over all pixels.
    """
    for some in itertools.batched(chosen, _TOGETHER, strict=False):
        for mode, wave in zip(some, waves(some, numbers), strict=True):
            wave *= np.float32((chosen[mode] * 2.0 ** len(mode)) ** 0.5)
            yield wave - wave.mean()


def waves(chosen, numbers):
    """Modes of the samples' parameters, between -1 and 1.

    Parameters
    ----------
    chosen : sequence of tuple
    numbers : dict
        As `features` takes it.

    Returns
    -------
    float32 array, shape (modes, ...)
        Each mode's mean over a pixel's samples.
    """
    highest = {}
    for name, m in itertools.chain(*chosen):
        highest[name] = max(m, highest.get(name, 0))
    samples, *shape = next(iter(numbers.values())).shape if numbers else (0,)
    total = np.zeros((len(chosen), *shape), np.float32)
    for sample in range(samples):
        harmonics = {name: _harmonics(numbers[name][sample], most) for name, most in highest.items()}
        for mode, wave in zip(chosen, total, strict=True):
            wave += functools.reduce(np.multiply, (harmonics[name][m] for name, m in mode))
    total /= np.float32(samples)
    return total


def _harmonics(byte, most):
    """Cosines of 0, 1, ... half-periods."""
    # Clipping does nothing to bytes, but spares a check of each.
    first = _COSINES.take(byte, mode="clip")
    found = [np.float32(1.0), first]
    twice = first + first
    for _ in range(most - 1):
        # cos(m + 1)x + cos(m - 1)x = 2 cos x cos mx
        following = twice * found[-1]
        following -= found[-2]
        found.append(following)
    return found


def strongest(likely, numbers, count):
    """The modes in which some pixels differ most.

    Several samples of one pixel are stratified, and leave little of the slow modes that one sample varies in most.

    Parameters
    ----------
    likely, numbers : dict
        As `features` takes them.
    count : int
        How many to keep.

    Returns
    -------
    dict of tuple to float
    """
    left = [error.var() for error in features(likely, numbers)]
    return {mode: likely[mode] for mode in largest(dict(zip(likely, left, strict=True)), count)}


def largest(values, count):
    """The `count` largest values of a dict, from the largest on."""
    return dict(sorted(values.items(), key=lambda item: item[1], reverse=True)[:count])
