# SPDX-License-Identifier: GPL-3.0-or-later
"""Cycles' own samples, arranged: a bluer error in what the scene uses, no worse a one in anything else.

Cycles' blue noise gives every aligned block of 2^k x 2^k pixels one block of 4^k consecutive points of its sequence,
four sub-blocks in random order, and so on down to single pixels.  Each such block of points is well stratified in every
dimension of every bounce, which is where its quality comes from; the order of the four is left to chance.  Here that
order is chosen instead: block by block, the one of the 24 permutations (less those below) that makes the visible error
smallest,

    E = sum over p, q of G(p - q) sum over modes m of w_m f_m(s_p) f_m(s_q),

which is DESIGN's spectral criterion: f_m are cosines of the sample's parameters s, w_m says how strong integrands are
there, and G is the autocorrelation of the low-pass through which the picture is seen (Mitchell 1991, section 5: the
parameters of samples inside any disc of the image should be a high-frequency pattern, jointly and in each marginal).

Dimensions that are not looked at keep Cycles' stratification, since the blocks are kept, and gain a little: two points
that follow each other in the sequence complement each other best, so permutations that would put such a pair on a
diagonal are left out, and the two always share an edge.
"""

import itertools

import numpy as np

# The low-pass through which a picture is seen is a Gaussian of one pixel; its autocorrelation has twice the variance.
# This is one axis of it, and how far it reaches.
_REACH = 4
_LOW_PASS = np.exp(-(np.arange(-_REACH, _REACH + 1) ** 2) / 4.0).astype(np.float32)

# Sides of the blocks whose four quarters are permuted, in the order of treatment.
_BLOCKS = (4, 2, 2)

_PERMUTATIONS = np.array(list(itertools.permutations(range(4))))
_PAIRS = tuple(itertools.combinations(range(4), 2))


def _quarter_table():
    """(16, 24): which of the 16 (place, quarter) costs each permutation pays."""
    table = np.zeros((4, 4, 24), np.float32)
    for column, order in enumerate(_PERMUTATIONS):
        table[range(4), order, column] = 1.0
    return table.reshape(16, 24)


def _pair_table():
    """(96, 24): which of the 6 x 16 costs of two quarters at two places each permutation pays."""
    table = np.zeros((6, 4, 4, 24), np.float32)
    for row, (a, b) in enumerate(_PAIRS):
        for column, order in enumerate(_PERMUTATIONS):
            table[row, order[a], order[b], column] = 1.0
    return table.reshape(96, 24)


_QUARTER_TABLE, _PAIR_TABLE = _quarter_table(), _pair_table()


def modes(groups, count):
    """The strongest cosine modes of some groups of dimensions.

    Parameters
    ----------
    groups : sequence of (tuple of int, float)
        Columns of the sample that integrands depend on together, and how much of the error to blame on them.
    count : int
        How many modes to keep.

    Returns
    -------
    list of (dict of int to int, float)
        Per mode the half-periods along each column it depends on, and its weight.  A step along a random plane has
        the power |m|^-(d + 1) at mode m in d dimensions; a product of k cosines has the variance 2^-k.
    """
    weights = {}
    for columns, share in groups:
        local = {}
        for numbers in itertools.product(range(4), repeat=len(columns)):
            if any(numbers):
                mode = tuple((column, m) for column, m in zip(columns, numbers, strict=True) if m)
                local[mode] = sum(m * m for m in numbers) ** (-(len(columns) + 1) / 2) * 2.0 ** len(mode)
        total = sum(local.values())
        for mode, weight in local.items():
            weights[mode] = weights.get(mode, 0.0) + share * weight / total
    strongest = sorted(weights, key=weights.get, reverse=True)[:count]
    return [(dict(mode), weights[mode]) for mode in strongest]


def features(values, chosen_modes):
    """What each pixel's samples contribute to each mode's error.

    Parameters
    ----------
    values : float32 array, shape (pixels, samples, dims)
    chosen_modes : list
        Of `modes`.

    Returns
    -------
    float32 array, shape (pixels, modes)
        sqrt(w_m) times the mean of the mode over the pixel's samples, without the mean over the pixels.
    """
    cosines = {}
    result = np.empty((len(values), len(chosen_modes)), np.float32)
    for row, (mode, weight) in enumerate(chosen_modes):
        product = np.float32(weight**0.5 * 2.0 ** (len(mode) / 2))
        for factor in mode.items():
            if factor not in cosines:
                column, m = factor
                cosines[factor] = np.cos(np.float32(np.pi * m) * values[..., column])
            product = product * cosines[factor]
        result[:, row] = product.mean(axis=1)
    return result - result.mean(axis=0)


def arrange(error_features, index):
    """Choose the order of the quarters of every aligned block.

    Parameters
    ----------
    error_features : float32 array, shape (height, width, modes)
        Of the samples in Cycles' own order; height and width are multiples of 4, and the first pixel's absolute
        coordinates are too.
    index : uint32 array, shape (height, width)
        Their ranks in the sequence.

    Returns
    -------
    int32 array, shape (height, width)
        The pixel, row by row, whose sample should stand here.
    """
    height, width, _ = error_features.shape
    field = _padded(error_features)
    order = _padded(np.arange(height * width, dtype=np.int32).reshape(height, width, 1))
    rank = _padded(index[:, :, None])
    for side in _BLOCKS:
        for first_y, first_x in itertools.product((0, side), (0, side)):
            # Every second block each way: those in between stay put, so that what one decides on is still true.
            count_y, count_x = -((first_y - height) // (2 * side)), -((first_x - width) // (2 * side))
            if count_y and count_x:
                _permute(field, order, rank, side, (first_y, count_y), (first_x, count_x))
    return order[_REACH : _REACH + height, _REACH : _REACH + width, 0]


def _padded(pixels):
    """A copy with a margin: the low-pass's reach before, and room for a whole pair of blocks and the reach behind."""
    margin = (_REACH, _REACH + 2 * max(_BLOCKS))
    return np.pad(pixels, (margin, margin, (0, 0)))


def _every_second(pixels, axis, side, first, count, shift=0):
    """View of the pixels along one axis, from `first`, as (count, side): every second block of that side."""
    start = _REACH + first + shift
    part = pixels[(slice(None),) * axis + (slice(start, start + count * 2 * side),)]
    split = part.reshape(*part.shape[:axis], count, 2 * side, *part.shape[axis + 1 :])
    return split[(slice(None),) * (axis + 1) + (slice(side),)]


def _low_passed(pixels, axis, *blocks):
    """The low-pass along one axis, at every second block."""
    total = _every_second(pixels, axis, *blocks) * _LOW_PASS[_REACH]
    term = np.empty_like(total)
    for distance in range(1, _REACH + 1):
        both = _every_second(pixels, axis, *blocks, -distance), _every_second(pixels, axis, *blocks, distance)
        np.add(*both, out=term)
        term *= _LOW_PASS[_REACH + distance]
        total += term
    return total


def _permute(field, order, rank, side, y, x):
    """Give each block the permutation of its quarters with the smallest error; y, x are (first, count) of blocks."""
    half = side // 2
    blocks = y[1] * x[1]
    y, x = (side, *y), (side, *x)

    def in_quarters(grid):
        """(count, side, count, side, c) as (count, count, 2, 2, half, half, c): a block's quarters together."""
        split = grid.reshape(grid.shape[0], 2, half, grid.shape[2], 2, half, -1)
        return split.transpose(0, 3, 1, 4, 2, 5, 6)

    def here(pixels):
        return in_quarters(_every_second(_every_second(pixels, 0, *y), 2, *x))

    features_here = here(field).reshape(blocks, 4, half * half, -1)
    seen = in_quarters(_low_passed(_low_passed(field, 0, *y), 2, *x)).reshape(features_here.shape)
    energy = _energies(features_here, seen, _low_pass_within(side))

    # The sequence's pairs must not lie on a diagonal: not at places 0 and 3, hence not at 1 and 2 either.
    digits = here(rank).reshape(blocks, 4, -1)[:, :, 0] // np.uint32(half * half) % 4
    diagonal = digits[:, _PERMUTATIONS[:, 0]] ^ digits[:, _PERMUTATIONS[:, 3]] == 1
    best = _PERMUTATIONS[np.argmin(np.where(diagonal, np.inf, energy), axis=1)]

    chosen = (best + 4 * np.arange(blocks)[:, None]).ravel()
    for pixels in (field, order, rank):
        quarters = here(pixels)
        quarters[...] = quarters.reshape(4 * blocks, -1).take(chosen, axis=0).reshape(quarters.shape)


def _low_pass_within(side):
    """G between any two pixels of a block, quarter by quarter: (side * side, side * side)."""
    half = side // 2
    inner_y, inner_x = np.divmod(np.arange(half * half), half)
    y = (np.array([0, 0, half, half])[:, None] + inner_y).ravel()
    x = (np.array([0, half, 0, half])[:, None] + inner_x).ravel()
    return _LOW_PASS[np.subtract.outer(y, y) + _REACH] * _LOW_PASS[np.subtract.outer(x, x) + _REACH]


def _energies(here, blurred, near):
    """Error of the 24 permutations of each block, but for what they share.

    Parameters
    ----------
    here, blurred : float32 arrays, shape (blocks, 4, cells, modes)
        Features and low-passed features at the pixels of the blocks' quarters.
    near : float32 array, shape (4 * cells, 4 * cells)
        G between the pixels of a block.

    Returns
    -------
    float32 array, shape (blocks, 24)
    """
    blocks, _, cells, _ = here.shape
    flat = here.reshape(blocks, 4 * cells, -1)
    gram = flat @ flat.transpose(0, 2, 1)
    # Quarter k at place b against what is outside the block: all that is seen there, less the block's own part.
    cost = blurred.reshape(blocks, 4, -1) @ here.reshape(blocks, 4, -1).transpose(0, 2, 1)
    cost -= np.einsum("nbckc->nbk", (near @ gram).reshape(blocks, 4, cells, 4, cells))
    # Two quarters against each other, at each pair of places.
    between = near.reshape(4, cells, 4, cells)
    between = np.stack([between[a, :, b].ravel() for a, b in _PAIRS], axis=1)
    mutual = gram.reshape(blocks, 4, cells, 4, cells).transpose(0, 1, 3, 2, 4).reshape(blocks, 16, cells * cells)
    mutual = (mutual @ between).transpose(0, 2, 1)
    return cost.reshape(blocks, 16) @ _QUARTER_TABLE + mutual.reshape(blocks, 96) @ _PAIR_TABLE
