# SPDX-License-Identifier: GPL-3.0-or-later
"""Light without negative pixels, for those who cannot take them.

Where noise was subtracted some pixels are below zero, and only together with those around them are right.  Denoisers
take them for zero, which makes dark parts brighter.
"""

import numpy as np

from .surroundings import SIDE, sums

_TINY = np.float32(1e-20)


def nonnegative(light):
    """Take what negative pixels lack from those around them.

    Parameters
    ----------
    light : float32 array, shape (channels, height, width)

    Returns
    -------
    float32 array
        Of the same shape, and about the same mean over any `SIDE` x `SIDE` pixels, as far as that is positive; `light`
        itself if nothing is negative.
    """
    if not (light < 0.0).any():
        return light
    positive = np.maximum(light, np.float32(0))
    share = _around(light) / np.maximum(_around(positive), _TINY)
    return positive * np.clip(share, np.float32(0), np.float32(1))


def _around(planes):
    """Sums over the `SIDE` x `SIDE` pixels around each."""
    reach = SIDE // 2
    edged = np.pad(planes, [(0, 0), (reach, reach), (reach, reach)], mode="edge")
    return sums(sums(edged, 1), 2)
