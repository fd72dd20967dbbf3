"""Shirley's N-rooks design: N samples, one in each of the N levels of every dimension (Mitchell 1991, section 2)."""

import numpy as np

from .tile import check_size


def n_rooks(count, d, rng):
    """Return `count` points whose projection on every axis is stratified.

    Parameters
    ----------
    count : int
        Number N of points and of levels along each axis.
    d : int
        Dimensions.
    rng : numpy.random.Generator

    Returns
    -------
    ndarray of float64, shape (count, d), in [0, 1)
        Levels are associated by random permutations, jittered inside.

    Raises
    ------
    ValueError
        If `count` or `d` is not positive.
    """
    count, d = check_size("count", count), check_size("d", d)
    levels = rng.permuted(np.tile(np.arange(count), (d, 1)), axis=1).T
    return (levels + rng.random((count, d))) / count


def n_rooks_pixels(size, dims, samples, rng):
    """Return values whose n samples of each pixel are N-rooks; parameters and result as in `generator.white`."""
    shape = (size, size, samples, len(dims))
    levels = rng.permuted(np.broadcast_to(np.arange(samples)[:, None], shape), axis=2)
    return (levels + rng.random(shape)) / samples
