"""Jitter, or full stratification: one random point in every block (Mitchell 1991, sections 2 and 3)."""

import math

import numpy as np

from .dimensions import groups


def jittered_grid(shape, rng):
    """Return one uniform point in every block of a grid over the unit cube.

    Parameters
    ----------
    shape : tuple of int
        Blocks along each dimension.
    rng : numpy.random.Generator

    Returns
    -------
    ndarray of float64, shape (prod(shape), len(shape)), in [0, 1)
        In the order of the blocks, last dimension fastest.
    """
    blocks = np.stack(np.meshgrid(*map(np.arange, shape), indexing="ij"), axis=-1).reshape(-1, len(shape))
    return (blocks + rng.random(blocks.shape)) / shape


def squarest_factors(count):
    """Return the two factors of `count` that are closest to each other, the larger first."""
    smaller = next(factor for factor in range(math.isqrt(count), 0, -1) if count % factor == 0)
    return count // smaller, smaller


def stratified(size, dims, samples, rng):
    """Return values whose every group is fully stratified over the tile, and which are in random order.

    A single dimension has T*T*n strata, a pair a grid of as many cells, as square as the number allows. Parameters and
    result are those of `generator.white.white`.
    """
    count = size * size * samples
    values = np.empty((count, len(dims)))
    for columns in groups(dims).values():
        shape = (count,) if len(columns) == 1 else squarest_factors(count)
        values[:, columns] = rng.permutation(jittered_grid(shape, rng))
    return values.reshape(size, size, samples, len(dims))
