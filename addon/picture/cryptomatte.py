# SPDX-License-Identifier: GPL-3.0-or-later
"""Cryptomatte: which objects a pixel shows, ranked by how much of it they cover."""

import numpy as np

from ..cycles.passes import Kind


def is_ranked(kind, pixels):
    """Whether a pass of this kind is two ranks of Cryptomatte; an AOV of one value may bear the name of such."""
    return kind is Kind.CRYPTOMATTE and pixels.shape[-1] == 4


def mixed(before, after, shares):
    """Passes of Cryptomatte of two pictures together, by their shares, which are 1 together.

    They are those of `after`: (pass name, view name) -> array, shape (..., 4), of two identifiers and coverages in
    turn.  Those of one kind differ in the two digits at their names' ends.
    """
    kinds, found = {}, {}
    for name, view in sorted(after):
        kinds.setdefault((name[:-2], view), []).append((name, view))
    for keys in kinds.values():
        total = None
        for passes, share in zip((before, after), shares, strict=True):
            total = added(total, np.concatenate([passes[key] for key in keys], axis=-1), share)
        largest = ranked(total, 4 * len(keys))
        found |= zip(keys, np.split(largest, len(keys), axis=-1), strict=True)
    return found


def added(total, picture, weight):
    """Coverages of all identifiers so far (None at first) and of a picture's, in order of the identifiers."""
    more = picture.astype(np.float64)
    more[..., 1::2] *= weight
    both = more if total is None else np.concatenate((total, more), axis=-1)
    ids, coverage = both.reshape(-1, both.shape[-1] // 2, 2).transpose(2, 0, 1)
    order = np.argsort(ids, axis=1, kind="stable")
    ids, coverage = (np.take_along_axis(values, order, axis=1) for values in (ids, coverage))
    pixel = np.arange(len(ids))[:, None]
    run = np.cumsum(np.diff(ids, axis=1, prepend=ids[:, :1]) != 0, axis=1)
    # Scenes have few objects in a pixel, however many pictures there are of it.
    pairs = np.zeros((len(ids), run.max(initial=0) + 1, 2))
    np.add.at(pairs[..., 1], (pixel, run), coverage)
    pairs[..., 0][pixel, run] = ids
    return pairs.reshape(*both.shape[:-1], -1)


def ranked(total, length):
    """The largest of `added` coverages, with their identifiers, as so many numbers a pixel."""
    pairs = total.reshape(*total.shape[:-1], -1, 2)
    best = np.argsort(-pairs[..., 1], axis=-1, kind="stable")[..., : length // 2]
    found = np.take_along_axis(pairs, best[..., None], axis=-2).reshape(*total.shape[:-1], -1)
    return np.pad(found, (*((0, 0) for _ in found.shape[1:]), (0, length - found.shape[-1])))
