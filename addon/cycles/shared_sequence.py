# SPDX-License-Identifier: GPL-3.0-or-later
"""The random numbers that all pixels of a render share, computed ahead of it.

With the sampling pattern 'TABULATED_SOBOL' and a scrambling distance of 0 every pixel draws the k-th point of one
sequence, in every dimension of every bounce; Cycles' sample offset chooses k.  This module computes those points.

Sources: Cycles 5.2 `scene/tabulated_sobol.cpp` (after Helmer, Christensen and Kensler, "Stochastic Generation of (t, s)
Sample Sequences"), `kernel/sample/tabulated_sobol.h`, `util/hash.h`.  `tests/cycles/test_shared_sequence.py` renders
scenes that show the numbers, and compares.
"""

import functools

import numpy as np

from . import random_numbers

# Dimension -> (Cycles' dimension id, which of its numbers).  The film's is `PRNG_FILTER` of kernel/types.h.
DIMENSIONS = {"film.x": (0, 0), "film.y": (0, 1), **random_numbers.DIMENSIONS}

# Cycles keeps this many patterns, each of at least this many points (kernel/types.h).
_PATTERNS = 256
_FEWEST = 256

# Which earlier point fixes the stratum of a new one, as a mask on its index: by axis and level, up to 8192 points.
_PARTNERS = (
    (0,) * 13,
    (0x0, 0x1, 0x1, 0x7, 0x1, 0x13, 0x15, 0x7F, 0x1, 0x103, 0x105, 0x70F, 0x111),
    (0x0, 0x1, 0x3, 0x1, 0x5, 0x1F, 0x2B, 0x3D, 0x11, 0x133, 0x377, 0x199, 0x445),
)

_LONGEST = 2 ** len(_PARTNERS[0])


def length(points):
    """Samples a pixel to set in Cycles for sample offsets below `points`: a power of two."""
    return max(_FEWEST, 1 << (points - 1).bit_length())


def values(dims, count, seed):
    """The sequence of a render.

    Parameters
    ----------
    dims : sequence of str
        Names out of `DIMENSIONS`.
    count : int
        Samples a pixel that Cycles is set to, of `length`.
    seed : int
        The scene's Cycles seed.

    Returns
    -------
    float32 array, shape (count, len(dims))
        Values in [0, 1); row k is what every pixel draws with the sample offset k.
    """
    size = min(count, _LONGEST)
    k = np.arange(size, dtype=np.uint32)
    result = np.empty((count, len(dims)), np.float32)
    for column, name in enumerate(dims):
        dimension, axis = DIMENSIONS[name]
        seed_here = _hash_wang(dimension, seed)
        first = _shuffled(dimension, seed)
        for start in range(0, count, size):
            # The whole index is scrambled, but only its lower digits are used within a pattern.
            order = random_numbers.owen_reversed(random_numbers.reverse_bits(k + np.uint32(start)), seed_here)
            order = random_numbers.reverse_bits(order) % np.uint32(size)
            pattern = _pattern((first + start // size) % _PATTERNS, size)
            result[start : start + size, column] = pattern[order, axis]
    return result


@functools.lru_cache(maxsize=64)
def _pattern(number, count):
    """`tabulated_sobol_generate_4D()`: (count, 3), the first three of the four numbers of each point."""
    # Numbers are drawn one after the other, four a point.
    first = random_numbers.hash_hp((number ^ 0x44605A73 ^ (0x44605A73 << 19)) & 0xFFFFFFFF)
    drawn = np.arange(4 * count, dtype=np.uint32) + np.uint32(first)
    drawn = (random_numbers.hash_hp(drawn) * np.float32(1.0 / 4294967808.0)).reshape(count, 4)[:, :3]
    points = drawn.copy()
    for level in range(count.bit_length() - 1):
        half = 2**level
        strata = np.float32(2 * half)
        for axis, partners in enumerate(_PARTNERS):
            taken = (points[np.arange(half) ^ partners[level], axis] * strata).astype(np.uint32)
            new = slice(half, 2 * half)
            points[new, axis] = ((taken ^ 1).astype(np.float32) + drawn[new, axis]) / strata
    return points


def _hash_wang(i, seed):
    """`hash_wang_seeded_uint()`."""
    i = i ^ 61 ^ seed
    i = (i + (i << 3)) & 0xFFFFFFFF
    i ^= i >> 4
    return (i * 0x27D4EB2D) & 0xFFFFFFFF


def _shuffled(i, seed):
    """`hash_shuffle_uint()`: which pattern a dimension gets."""
    i %= _PATTERNS
    mask = _PATTERNS - 1
    i = (i ^ seed) * 0xE170893D & 0xFFFFFFFF
    i ^= seed >> 16
    i ^= (i & mask) >> 4
    i = (i ^ seed >> 8) * 0x0929EB3F & 0xFFFFFFFF
    i ^= seed >> 23
    i ^= (i & mask) >> 1
    i = i * (1 | seed >> 27) * 0x6935FA69 & 0xFFFFFFFF
    i ^= (i & mask) >> 11
    i = i * 0x74DCB303 & 0xFFFFFFFF
    i ^= (i & mask) >> 2
    i = i * 0x9E501CC3 & 0xFFFFFFFF
    i ^= (i & mask) >> 2
    i = (i * 0xC860A3DF) & mask
    return i ^ i >> 5
