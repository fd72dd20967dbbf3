"""Cook's incomplete block design: N*N samples that fill the strata of every marginal once (Mitchell 1991, section 2).

Time is divided into N*N levels and pairs like the lens into N x N cells; how the blocks of different marginals go
together is random, since what "should be avoided" is linear correlation.
"""

import math

import numpy as np

from .dimensions import groups
from .jittered import jittered_grid


def cook(count, dims, rng):
    """Return `count` points, one in each level of every single dimension and in each cell of every pair.

    Parameters
    ----------
    count : int
        A square number N*N.
    dims : tuple of str
    rng : numpy.random.Generator

    Returns
    -------
    ndarray of float64, shape (count, len(dims)), in [0, 1)

    Raises
    ------
    ValueError
        If `count` is not a square number.
    """
    side = math.isqrt(max(count, 0))
    if side < 1 or side * side != count:
        raise ValueError(f"samples: expected a square number for Cook's design, got {count}")
    points = np.empty((count, len(dims)))
    for columns in groups(dims).values():
        shape = (count,) if len(columns) == 1 else (side, side)
        points[:, columns] = rng.permutation(jittered_grid(shape, rng))
    return points


def cook_pixels(size, dims, samples, rng, progress=None):
    """Return values whose n samples of each pixel are Cook's; parameters and result as in `generator.white`.

    `progress` is called as ``progress(done, total)`` after each row.
    """
    values = np.empty((size, size, samples, len(dims)))
    for row in range(size):
        for column in range(size):
            values[row, column] = cook(samples, dims, rng)
        if progress:
            progress(row + 1, size)
    return values
