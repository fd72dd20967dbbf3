# SPDX-License-Identifier: GPL-3.0-or-later
"""Pairing two sets of points so that partners lie close together."""

import numpy as np


def match(points, targets):
    """Pair every point with one target by splitting both sets alike, over and over, at their medians.

    Both sets are halved at the median of the same dimension, then the halves at the next dimension, and so on (a k-d
    tree built over both at once), until single pairs remain.  Not the optimal assignment, but its mean distance falls
    like the spacing of the points, in O(n log n).

    Parameters
    ----------
    points, targets : float32 arrays, shape (n, d)
        In [0, 1).

    Returns
    -------
    int32 array, shape (n,)
        `pairs[i]` is the target of point i; a permutation.
    """
    count, dims = points.shape
    levels = (count - 1).bit_length()
    # Halving evenly needs a power of two, so both sets get the same extra points.
    extra = np.random.default_rng(count).random(((1 << levels) - count, dims), np.float32)
    point_order = _median_order(np.concatenate([points, extra]), levels)
    target_order = _median_order(np.concatenate([targets, extra]), levels)
    pairs = np.empty(1 << levels, np.int32)
    pairs[point_order] = target_order
    # A point whose partner is an extra one goes on to that one's own partner.
    result = pairs[:count]
    while (beyond := result >= count).any():
        result[beyond] = pairs[result[beyond]]
    return result


def _median_order(points, levels):
    """Order of 2 ** levels points in the leaves of a balanced k-d tree that cycles through the dimensions."""
    order = np.arange(len(points), dtype=np.int32)
    columns = np.ascontiguousarray(points.T)
    for level in range(levels):
        groups = order.reshape(1 << level, -1)
        values = columns[level % len(columns)][groups]
        half = groups.shape[1] // 2
        order = np.take_along_axis(groups, np.argpartition(values, half, axis=1), axis=1).ravel()
    return order
