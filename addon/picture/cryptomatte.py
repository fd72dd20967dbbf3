# SPDX-License-Identifier: GPL-3.0-or-later
"""Cryptomatte: which objects a pixel shows, ranked by how much of it they cover."""

import numpy as np


def merged(pictures, weights):
    """Ranks of several pictures together: coverages of one identifier add up, and the largest stay.

    Parameters
    ----------
    pictures : list of float32 array, shape (height, width, 2 * ranks)
        Identifiers and coverages in turn.
    weights : list of float
        Of each picture, 1 together.

    Returns
    -------
    float64 array, shape (height, width, 2 * ranks)
    """
    shape = pictures[0].shape
    ranks = shape[-1] // 2
    ids = np.concatenate([picture[..., 0::2] for picture in pictures], axis=-1).reshape(-1, len(pictures) * ranks)
    coverage = np.concatenate(
        [weight * picture[..., 1::2].astype(np.float64) for weight, picture in zip(weights, pictures, strict=True)],
        axis=-1,
    ).reshape(ids.shape)
    order = np.argsort(ids, axis=1, kind="stable")
    ids, coverage = (np.take_along_axis(values, order, axis=1) for values in (ids, coverage))
    pixel = np.arange(len(ids))[:, None]
    run = np.cumsum(np.diff(ids, axis=1, prepend=ids[:, :1]) != 0, axis=1)
    total, owner = np.zeros_like(coverage), np.zeros_like(ids)
    np.add.at(total, (pixel, run), coverage)
    owner[pixel, run] = ids
    best = np.argsort(-total, axis=1, kind="stable")[:, :ranks]
    ranked = (np.take_along_axis(values, best, axis=1) for values in (owner, total))
    return np.stack(list(ranked), axis=-1).reshape(shape)
