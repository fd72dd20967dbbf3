# SPDX-License-Identifier: GPL-3.0-or-later
"""The random numbers that Cycles will draw, computed ahead of the render.

With the sampling pattern 'BLUE_NOISE' all pixels share one Owen-scrambled Sobol sequence; the pixel decides only which
part of it it gets.  So the numbers of a render are a known function of (pixel, Cycles seed, number of samples), and a
plan can say which film position each of them should serve.

Sources: Cycles 5.2 `kernel/sample/pattern.h`, `sobol_burley.h`, `util.h`, `util/hash.h`, `scene/integrator.cpp`.
`tests/cycles/test_random_numbers.py` renders a probe scene and compares, so a Blender release that changes its sampler
fails a test instead of silently spoiling pictures.
"""

import numpy as np

# Dimension ids, kernel/types.h `PathTraceDimension`.
LENS_TIME = 1
BOUNCE = 16
LIGHT = 1
SURFACE_BSDF = 3

# Dimension -> (Cycles' set of three numbers, which of the three).  Light and BSDF are the first hit's, with a 2 the
# second hit's.
DIMENSIONS = {
    "t": (LENS_TIME, 0),
    "lens.u": (LENS_TIME, 1),
    "lens.v": (LENS_TIME, 2),
    "light.u": (BOUNCE + LIGHT, 0),
    "light.v": (BOUNCE + LIGHT, 1),
    "light.pick": (BOUNCE + LIGHT, 2),
    "bsdf.u": (BOUNCE + SURFACE_BSDF, 0),
    "bsdf.v": (BOUNCE + SURFACE_BSDF, 1),
    "bsdf.pick": (BOUNCE + SURFACE_BSDF, 2),
    "light2.u": (2 * BOUNCE + LIGHT, 0),
    "light2.v": (2 * BOUNCE + LIGHT, 1),
    "light2.pick": (2 * BOUNCE + LIGHT, 2),
}

_SHUFFLE_SEED_3D = 0xCAA726AC
_SCRAMBLE_SEEDS_3D = (0x9E78E391, 0x67C33241, 0x78C395C5)
_MASK = 0xFFFFFFFF

# Columns of the Sobol matrices for dimensions 1 and 2, for a bit-reversed index (dimension 0 is van der Corput's, the
# identity).  These are Joe and Kuo's direction numbers, as in `sobol_burley_table`.
_SOBOL_COLUMNS = (
    (0x00000001, 0x00000003, 0x00000005, 0x0000000F, 0x00000011, 0x00000033, 0x00000055, 0x000000FF,
     0x00000101, 0x00000303, 0x00000505, 0x00000F0F, 0x00001111, 0x00003333, 0x00005555, 0x0000FFFF,
     0x00010001, 0x00030003, 0x00050005, 0x000F000F, 0x00110011, 0x00330033, 0x00550055, 0x00FF00FF,
     0x01010101, 0x03030303, 0x05050505, 0x0F0F0F0F, 0x11111111, 0x33333333, 0x55555555, 0xFFFFFFFF),
    (0x00000001, 0x00000003, 0x00000006, 0x00000009, 0x00000017, 0x0000003A, 0x00000071, 0x000000A3,
     0x00000116, 0x00000339, 0x00000677, 0x000009AA, 0x00001601, 0x00003903, 0x00007706, 0x0000AA09,
     0x00010117, 0x0003033A, 0x00060671, 0x000909A3, 0x00171616, 0x003A3939, 0x00717777, 0x00A3AAAA,
     0x01170001, 0x033A0003, 0x06710006, 0x09A30009, 0x16160017, 0x3939003A, 0x77770071, 0xAAAA00A3),
)  # fmt: skip


def _half_tables(columns):
    """XOR of the columns of every half, so that a 32-bit matrix product is two look-ups: uint32 (2, 65536)."""
    tables = []
    for half in (columns[:16], columns[16:]):
        table = np.zeros(1, np.uint32)
        for column in half:
            table = np.concatenate([table, table ^ np.uint32(column)])
        tables.append(table)
    return np.array(tables)


# The bits of a number in reverse order are a matrix product, too.
_REVERSING = _half_tables([1 << (31 - bit) for bit in range(32)])
_REVERSED_BYTE = (_REVERSING[0, :256] >> 24).astype(np.uint8)

# The three dimensions of a set, for a reversed index.  `sobol_burley()` walks its leading bits, so its column i belongs
# to bit 31 - i; and Owen scrambling wants reversed numbers, as the columns are: the first dimension is that index
# mirrored.
_SOBOL_TABLES = (_REVERSING, *(_half_tables(columns[::-1]) for columns in _SOBOL_COLUMNS))

# Of all three at once the lowest bytes, which decide about the leading bytes of the values.
_SOBOL_BYTES = sum((tables & 0xFF) << (8 * axis) for axis, tables in enumerate(_SOBOL_TABLES))


def _matrix_product(tables, n):
    # Clipping does nothing to halves, but spares a check of each.
    return tables[0].take(n & 0xFFFF, mode="clip") ^ tables[1].take(n >> 16, mode="clip")


def reverse_bits(n):
    """The 32 bits of each number, in reverse order: uint32 array of the same shape."""
    return _matrix_product(_REVERSING, n)


def hash_hp(i):
    """`hash_hp_uint()` of an integer or a uint32 array (util/hash.h)."""
    i = i ^ i >> 16
    i = (i * 0x21F0AAAD) & _MASK
    i ^= i >> 15
    i = (i * 0xD35A2D97) & _MASK
    i ^= i >> 15
    return i ^ 0xE6FE3BEB


def _hash_uint(*keys):
    """`hash_uint()` of one integer, `hash_uint2()` of two: Jenkins' final mix (util/hash.h)."""
    a = b = c = (0xDEADBEEF + (len(keys) << 2) + 13) & _MASK
    a = (a + keys[0]) & _MASK
    b = (b + sum(keys[1:])) & _MASK

    def rotate(x, k):
        return ((x << k) | (x >> (32 - k))) & _MASK

    c = ((c ^ b) - rotate(b, 14)) & _MASK
    a = ((a ^ c) - rotate(c, 11)) & _MASK
    b = ((b ^ a) - rotate(a, 25)) & _MASK
    c = ((c ^ b) - rotate(b, 16)) & _MASK
    a = ((a ^ c) - rotate(c, 4)) & _MASK
    b = ((b ^ a) - rotate(a, 14)) & _MASK
    c = ((c ^ b) - rotate(b, 24)) & _MASK
    return c


def animated_seed(seed, frame, subframe=0.0):
    """Seed that Cycles renders a frame with where *Animated Seed* is on (`BlenderSync::sync_integrator`).

    Parameters
    ----------
    seed, frame : int
    subframe : float
        In [0, 1).

    Returns
    -------
    int
        In [0, 2**32): the bits of Cycles' signed seed.
    """
    found = _hash_uint(frame & _MASK, seed & _MASK)
    if subframe != 0.0:
        found += _hash_uint(int(np.float32(subframe) * np.float32(2**31 - 1)) & _MASK, seed & _MASK)
    return found & _MASK


def owen_reversed(n, seed):
    """`reversed_bit_owen()`: base-2 Owen scrambling of a bit-reversed integer (Laine-Karras hash)."""
    n = n ^ n * np.uint32(0x3D20ADEA)
    n += np.uint32(seed)
    n *= np.uint32((seed >> 16) | 1)
    n ^= n * np.uint32(0x05526C56)
    n ^= n * np.uint32(0x53A22864)
    return n


def _owen_reversed_base4(n, seed):
    """`reversed_bit_owen_base4()`: base-4 Owen scrambling of a bit-reversed integer."""
    n = n ^ n * np.uint32(0x3D20ADEA)
    n ^= (n >> 1) & (n << 1) & 0x55555555
    n += np.uint32(seed)
    n *= np.uint32((seed >> 16) | 1)
    n ^= (n >> 1) & (n << 1) & 0x55555555
    n ^= n * np.uint32(0x05526C56)
    n ^= n * np.uint32(0x53A22864)
    return n


def _spread_bits(x):
    """Put bit k of a 16-bit integer at bit 2k (`expand_bits()`)."""
    x = x & 0xFFFF
    x = (x ^ (x << 8)) & 0x00FF00FF
    x = (x ^ (x << 4)) & 0x0F0F0F0F
    x = (x ^ (x << 2)) & 0x33333333
    return (x ^ (x << 1)) & 0x55555555


def z_order(x, y):
    """Where pixels lie on the curve that Cycles walks (`morton2d()`): uint32 array; coordinates as of `pixel_ranks`."""
    return (_spread_bits(np.asarray(x, np.uint32)) << 1) | _spread_bits(np.asarray(y, np.uint32))


def pixel_ranks(x, y, seed):
    """Which part of the sequence each pixel gets (`path_rng_pixel_init()`).

    Parameters
    ----------
    x, y : integer arrays that broadcast together
        Absolute pixel coordinates in the full frame, below 65536, y counted from the bottom.
    seed : int
        The scene's Cycles seed.

    Returns
    -------
    uint32 array
        Pixel p draws the points n * rank ... n * rank + n - 1 of the sequence when n samples a pixel are rendered.
    """
    return reverse_bits(_owen_reversed_base4(reverse_bits(z_order(x, y)), _hash_uint(seed & _MASK)))


def sequence_values(index, dims):
    """Values of some dimensions at points of Cycles' blue-noise sequence (`sobol_burley_sample_3D()`, seed 0).

    Parameters
    ----------
    index : uint32 array
        Indices into the sequence.
    dims : sequence of str
        Names out of `DIMENSIONS`.

    Returns
    -------
    float32 array, shape index.shape + (len(dims),)
        Values in [0, 1).

    Raises
    ------
    ValueError
        A dimension that Cycles has no number for.
    """
    index = np.asarray(index, np.uint32)
    values = np.empty((*index.shape, len(dims)), np.float32)
    for column, (axis, seed, point) in enumerate(_shuffled_points(index, dims)):
        digits = owen_reversed(_matrix_product(_SOBOL_TABLES[axis], point), seed ^ _SCRAMBLE_SEEDS_3D[axis])
        values[..., column] = reverse_bits(digits) * np.float32(1.0 / 4294967808.0)
    return values


def leading_bytes(index, dims):
    """`sequence_values` cut off after 8 bits, several times as fast.

    Owen scrambling carries from low bits to high ones only, and works on bit-reversed numbers: one byte of the digits
    decides about the leading byte of the value.

    Returns
    -------
    dict of str to uint8 array, shape index.shape
        floor(256 * value) by dimension.
    """
    points = _shuffled_points(np.asarray(index, np.uint32), dims)
    products, leading = {}, {}
    for name, (axis, seed, point) in zip(dims, points, strict=True):
        if seed not in products:
            products[seed] = _matrix_product(_SOBOL_BYTES, point)
        digits = (products[seed] >> (8 * axis)) & 0xFF
        scrambled = owen_reversed(np.arange(256, dtype=np.uint32), seed ^ _SCRAMBLE_SEEDS_3D[axis])
        leading[name] = _REVERSED_BYTE[scrambled & 0xFF].take(digits, mode="clip")
    return leading


def _shuffled_points(index, dims):
    """For each dimension its axis in Cycles' set of three, the set's seed, and the set's bit-reversed indices."""
    unknown = [name for name in dims if name not in DIMENSIONS]
    if unknown:
        raise ValueError(f"Cycles draws no number for {', '.join(unknown)}; it has {', '.join(DIMENSIONS)}")
    reversed_index = reverse_bits(index)
    shuffled = {}
    for name in dims:
        dimension_set, axis = DIMENSIONS[name]
        seed = hash_hp(dimension_set)
        if dimension_set not in shuffled:
            shuffled[dimension_set] = owen_reversed(reversed_index, seed ^ _SHUFFLE_SEED_3D)
        yield axis, seed, shuffled[dimension_set]
