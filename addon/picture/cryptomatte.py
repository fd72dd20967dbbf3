# SPDX-License-Identifier: GPL-3.0-or-later
"""Cryptomatte: which objects a pixel shows, ranked by how much of it they cover."""

import numpy as np


def merged(pictures, weights):
    """Ranks of several pictures together: coverages of one identifier add up, and the largest stay.

    Parameters
    ----------
    pictures : iterable of float32 array, shape (height, width, 2 * ranks)
        Identifiers and coverages in turn.
    weights : iterable of float
        Of each picture, 1 together.

    Returns
    -------
    float64 array, shape (height, width, 2 * ranks)
    """
    total = None
    for picture, weight in zip(pictures, weights, strict=True):
        total = added(total, picture, weight)
    return ranked(total, picture.shape[-1])


def added(total, picture, weight):
    """Coverages of all identifiers so far (None at first) and of a picture's, in order of the identifiers."""
    more = picture.astype(np.float64)
    more[..., 1::2] *= weight
    both = more if total is None else np.concatenate((total, more), axis=-1)
    ids, coverage = both[..., 0::2], both[..., 1::2]
    order = np.argsort(ids, axis=-1, kind="stable")
    ids, coverage = (np.take_along_axis(values, order, axis=-1) for values in (ids, coverage))
    run = np.cumsum(np.diff(ids, axis=-1, prepend=ids[..., :1]) != 0, axis=-1)
    # Scenes have few objects in a pixel, however many pictures there are of it.
    result = np.zeros((*run.shape[:-1], run.max(initial=0) + 1, 2))
    rows, columns, _ = np.ogrid[tuple(map(slice, run.shape))]
    np.add.at(result[..., 1], (rows, columns, run), coverage)
    result[..., 0][rows, columns, run] = ids
    return result.reshape(*run.shape[:-1], -1)


def ranked(total, length):
    """The largest of `added` coverages, with their identifiers, as so many numbers a pixel."""
    pairs = total.reshape(*total.shape[:-1], -1, 2)
    best = np.argsort(-pairs[..., 1], axis=-1, kind="stable")[..., : length // 2]
    found = np.take_along_axis(pairs, best[..., None], axis=-2).reshape(*total.shape[:-1], -1)
    return np.pad(found, ((0, 0), (0, 0), (0, length - found.shape[-1])))
