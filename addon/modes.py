# SPDX-License-Identifier: GPL-3.0-or-later
"""Cosine modes of a sample's parameters: the ways in which integrands vary.

The error that a pattern of samples leaves in each mode tells its error for all integrands (Mitchell 1991, section 5;
DESIGN, section 4); the modes that are strong in pictures vary along few parameters, and slowly.
"""

import itertools

import numpy as np

# Half-periods along one dimension, at most.
_HIGHEST = 3

# Modes that are looked at for the strongest.
_CANDIDATES = 256

# Middles of the 256 intervals that a number's leading byte tells apart, as angles of half a period.
_ANGLES = np.pi * (np.arange(256) + 0.5) / 256


def variances(groups):
    """How much of a picture's variance to blame on each mode.

    Parameters
    ----------
    groups : sequence of (tuple of str, float)
        Dimensions that integrands depend on together, and the variance that this causes.

    Returns
    -------
    dict of tuple of (str, int) to float
        A mode is the number of its half-periods along each dimension that it depends on.  A step along a random plane
        has the power |m|^-(d + 1) at the wave vector m in d dimensions; a mode of k dimensions stands for 2^k vectors.
    """
    total = {}
    for dims, share in groups:
        power = {}
        for numbers in itertools.product(range(_HIGHEST + 1), repeat=len(dims)):
            mode = tuple((name, m) for name, m in zip(dims, numbers, strict=True) if m)
            if mode:
                power[mode] = sum(m * m for m in numbers) ** (-(len(dims) + 1) / 2) * 2.0 ** len(mode)
        scale = share / sum(power.values())
        for mode, value in power.items():
            total[mode] = total.get(mode, 0.0) + scale * value
    return total


def features(chosen, numbers):
    """What each pixel's samples contribute to the error in each mode.

    Parameters
    ----------
    chosen : dict of tuple to float
        Modes and their variances, of `variances`.
    numbers : dict of str to uint8 array, shape (samples, ...)
        Leading bytes of the samples' parameters, by dimension (`cycles_random.leading_bytes`).

    Yields
    ------
    float32 array, shape (...)
        One mode's mean over a pixel's samples, without its mean over all pixels.
    """
    count = len(next(iter(numbers.values())))
    cosines = {factor: np.cos(factor[1] * _ANGLES).astype(np.float32) for mode in chosen for factor in mode}
    for mode, variance in chosen.items():
        scale = np.float32((variance * 2.0 ** len(mode)) ** 0.5 / count)
        total = np.float32(0.0)
        for sample in range(count):
            product = scale
            for name, m in mode:
                product = product * cosines[name, m][numbers[name][sample]]
            total = total + product
        yield total - total.mean()


def strongest(total, numbers, count):
    """The modes in which some pixels differ most.

    Several samples of one pixel are stratified, and leave little of the slow modes that one sample varies in most.

    Parameters
    ----------
    total, numbers
        As `variances` returns and `features` takes them.
    count : int
        How many to keep.

    Returns
    -------
    dict of tuple to float
    """
    candidates = _largest(total, _CANDIDATES)
    left = [error.var() for error in features(candidates, numbers)]
    return {mode: total[mode] for mode in _largest(dict(zip(candidates, left, strict=True)), count)}


def _largest(values, count):
    return dict(sorted(values.items(), key=lambda item: item[1], reverse=True)[:count])
