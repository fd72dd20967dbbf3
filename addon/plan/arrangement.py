# SPDX-License-Identifier: GPL-3.0-or-later
"""Cycles' own samples, arranged: a bluer error in what the scene uses, no worse a one in anything else.

Cycles' blue noise gives every aligned block of 2^k x 2^k pixels one block of 4^k consecutive points of its sequence,
four sub-blocks in random order, and so on down to single pixels.  Each such block of points is well stratified in every
dimension of every bounce, which is where its quality comes from; the order of the four is left to chance.  Here that
order is chosen instead: block by block, coarse blocks first, the one of the 24 permutations (less those below) that
makes the visible error smallest,

    E = sum over p, q of G(p - q) sum over modes m of f_m(p) f_m(q),

where f_m are cosine modes of the samples' parameters (`plan.modes`), and G is the autocorrelation of the low-pass
through which the picture is seen (Mitchell 1991, section 5: the parameters of samples inside any disc of the image
should be a high-frequency pattern, jointly and in each marginal).  Coarse blocks stand for the means of their samples,
and are seen through a low-pass of their own size.

Dimensions that are not looked at keep Cycles' stratification, since the blocks are kept, and gain a little: two points
that follow each other in the sequence complement each other best, so permutations that would put such a pair on a
diagonal are left out, and the two always share an edge.
"""

import itertools

import numpy as np

# Blocks of up to 2 ** 5 pixels a side are permuted.
_LEVELS = 5

#: Sides of what is arranged at once must be multiples of this many pixels.
ALIGNMENT = 4 * 2 ** (_LEVELS - 1)

_PERMUTATIONS = np.array(list(itertools.permutations(range(4))))

# The three ways to pair four quarters; a permutation puts one of them on the block's diagonals.
_PAIRINGS = (((0, 1), (2, 3)), ((0, 2), (1, 3)), ((0, 3), (1, 2)))


def _low_pass(sigma):
    """Weights at distances 0, 1, 2 of the autocorrelation of a Gaussian, cut off there."""
    return np.exp(-(np.arange(3) ** 2) / (4.0 * sigma**2)).astype(np.float32)


# Pixels are arranged for a low-pass of about a pixel, coarser blocks for one of about half their side.
_FINE, _COARSE = _low_pass(0.9), _low_pass(0.6)


def _cost_table():
    """(24, 19): which of the 16 costs of (place, quarter) and 3 of pairings on the diagonals a permutation pays."""
    table = np.zeros((24, 19), np.float32)
    for row, order in zip(table, _PERMUTATIONS, strict=True):
        row[4 * np.arange(4) + order] = 1.0
        row[16:] = [{order[0], order[3]} in map(set, pairing) for pairing in _PAIRINGS]
    return table


_COST_TABLE = _cost_table()

# Modes that are looked at together: few enough for a processor's cache.
_TOGETHER = 6

# More than any permutation costs; infinity times the table's zeros would not do.
_FORBIDDEN = np.float32(1e9)


def arrange(features, count, ranks, inside):
    """Choose the order of the quarters of every aligned block.

    Parameters
    ----------
    features : iterable of float32 arrays, shape (height, width)
        One for each mode, of the samples in Cycles' own order (`modes.features`).  Height and width, and the
        absolute coordinates of the first pixel, are multiples of `ALIGNMENT`.
    count : int
        How many modes there are.
    ranks : uint32 array, shape (height, width)
        The samples' ranks in the sequence.
    inside : bool array, shape (height, width)
        Pixels that are rendered; blocks with others stay as they are.

    Returns
    -------
    int32 array, shape (height, width)
        The pixel, row by row, whose sample should stand here.
    """
    height, width = ranks.shape
    # With a margin of one cell, in which nothing is seen.
    fields = [
        np.zeros((count, 4, 4, 2 + height // (4 << level), 2 + width // (4 << level)), np.float32)
        for level in range(_LEVELS)
    ]
    for mode, means in enumerate(features):
        for field in fields:
            field[mode, ..., 1:-1, 1:-1] = _interleaved(means)
            means = sum(_quarters(means)) / np.float32(4)
    order = np.arange(ranks.size >> 2 * _LEVELS - 2, dtype=np.int32).reshape(means.shape[0] * 2, -1)
    for level in reversed(range(_LEVELS)):
        node_ranks = ranks[:: 1 << level, :: 1 << level] >> np.uint32(2 * level)
        side = 2 << level
        whole = inside.reshape(height // side, side, -1, side).all(axis=(1, 3))
        order = _rearranged(order, fields.pop(), node_ranks, whole, _FINE if level == 0 else _COARSE)
        if level:
            order = _children(order)
    return order


def _quarters(grid):
    """Views of the lower left, lower right, upper left and upper right quarter of every block of 2 x 2."""
    return [grid[..., y::2, x::2] for y in (0, 1) for x in (0, 1)]


def _children(order):
    """The same order, of nodes half as large."""
    height, width = order.shape
    children = np.empty((2 * height, 2 * width), np.int32)
    first = 2 * order + 2 * width * (order // width)
    for child, offset in zip(_quarters(children), (0, 1, 2 * width, 2 * width + 1), strict=True):
        child[...] = first + np.int32(offset)
    return children


def _interleaved(grid):
    """(height, width) as (4, 4, height / 4, width / 4): every fourth node each way together.

    What is then done to every second block, to its neighbours, or to a quarter of each, is done to a slice.
    """
    height, width = grid.shape
    return np.ascontiguousarray(grid.reshape(height // 4, 4, width // 4, 4).transpose(1, 3, 0, 2))


def _rearranged(order, field, ranks, whole, low_pass):
    """Permute the blocks of 2 x 2 nodes.

    Parameters
    ----------
    order : int32 array, shape (height, width)
        Which node stands where.
    field : float32 array, shape (modes, 4, 4, 2 + height / 4, 2 + width / 4)
        Features of the nodes in Cycles' own order, interleaved; left in an undefined state.
    ranks : uint32 array, shape (height, width)
        Of the nodes, in Cycles' own order.
    whole : bool array, shape (height / 2, width / 2)
        Blocks that may be permuted.
    low_pass : float32 array, shape (3,)

    Returns
    -------
    int32 array, shape (height, width)
    """
    place = np.empty(order.size, np.int32)
    place[_interleaved(np.arange(order.size).reshape(order.shape)).ravel()] = np.arange(order.size)
    order = _interleaved(order)
    ranks = ranks.ravel()[order]
    _, _, height, width = order.shape
    source = place[order]
    inner = field[..., 1:-1, 1:-1]
    for plane in inner:
        plane[...] = plane.ravel()[source]
    # Every second block each way: those in between stay put, so that what one decides on is still true.
    for y, x in itertools.product((0, 2), (0, 2)):
        block = slice(y, y + 2), slice(x, x + 2)
        chosen = _PERMUTATIONS.T[:, _best(field, block, ranks[block], low_pass)]
        chosen[:, ~whole[y // 2 :: 2, x // 2 :: 2]] = np.arange(4)[:, None]
        source = chosen * (height * width) + np.arange(height * width).reshape(height, width)
        for grid in (order, ranks, *inner):
            grid[block] = grid[block].ravel()[source].reshape(2, 2, height, width)
    return order.transpose(2, 0, 3, 1).reshape(4 * height, 4 * width)


def _best(field, block, ranks, low_pass):
    """Number of the permutation of each block with the smallest error, (height, width)."""
    height, width = ranks.shape[2:]
    costs = np.zeros((19, height * width), np.float32)
    of_place, of_pairing = costs[:16].reshape(4, 4, -1), costs[16:]
    for first in range(0, len(field), _TOGETHER):
        part = slice(first, first + _TOGETHER)
        own = field[part, ..., 1:-1, 1:-1][:, *block].reshape(-1, 4, height * width)
        around = _seen_around(field[part], block, low_pass)
        of_place += np.einsum("mkn,mpn->pkn", own, around.reshape(own.shape))
        for cost, pairing in zip(of_pairing, _PAIRINGS, strict=True):
            for a, b in pairing:
                cost += np.einsum("mn,mn->n", own[:, a], own[:, b])
    # All six pairs of quarters see each other; those on the diagonals less than those that share an edge.
    of_pairing *= low_pass[1] ** 2 - low_pass[1]
    digits = ranks.reshape(4, -1) & 3
    for cost, other in zip(of_pairing, digits[1:], strict=True):
        cost[digits[0] ^ other == 1] = _FORBIDDEN  # they follow each other in the sequence
    # Row by row: larger products would be taken by threads of the linear algebra library's own, which get in the way
    # of ours (three quarters of the plan's time, on two processors).
    return np.argmin(_COST_TABLE @ costs.reshape(-1, height, width).swapaxes(0, 1), axis=1)


def _seen_around(planes, block, low_pass):
    """What the low-pass sees at the places of each block, of all but the block itself: (modes, 2, 2, height, width)."""
    inner = planes[..., 1:-1, 1:-1][:, *block]
    own = inner.copy()
    inner[...] = 0.0
    count, _, _, height, width = own.shape
    columns = np.empty((count, 2, 4, height, width + 2), np.float32)
    seen = np.empty_like(own)
    for place, row in enumerate(range(block[0].start, block[0].stop)):
        near = range(row - 2, row + 3)
        lines = [planes[:, y % 4, :, 1 + y // 4 : 1 + y // 4 + height] for y in near]
        _blur(lines, low_pass, columns[:, place])
    for place, column in enumerate(range(block[1].start, block[1].stop)):
        near = range(column - 2, column + 3)
        lines = [columns[:, :, x % 4, :, 1 + x // 4 : 1 + x // 4 + width] for x in near]
        _blur(lines, low_pass, seen[:, :, place])
    inner[...] = own
    return seen


def _blur(lines, low_pass, out):
    """Write the weighted sum of five neighbouring lines to `out`."""
    np.add(lines[0], lines[4], out=out)
    out *= low_pass[2]
    nearer = lines[1] + lines[3]
    nearer *= low_pass[1]
    out += nearer
    out += lines[2]
