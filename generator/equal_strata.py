"""Exact stratification of values that are nearly stratified already.

Cook's design (Mitchell 1991, section 2) over the whole tile: every single dimension hits each of its T*T strata once, a
pair hits in addition each cell of a T x T grid once.
"""

import numpy as np

_SWEEPS = 3000
REPORTS = 30
"""How many times `stratify_square` reports."""

_REACH = 2  # cells
_TEMPERATURE = 2.0  # of the annealing, in squared cells


def ranks(values, axis=-1):
    """Return the place of each value in the sorted order along `axis`, starting from 0."""
    order = np.argsort(values, axis=axis, kind="stable")
    result = np.empty_like(order)
    shape = [1] * order.ndim
    shape[axis] = -1
    np.put_along_axis(result, order, np.arange(values.shape[axis]).reshape(shape), axis)
    return result


def stratify_line(values):
    """Move values to the centres of as many equal strata, keeping their order.

    Parameters
    ----------
    values : ndarray, shape (N,)

    Returns
    -------
    ndarray of float64, shape (N,)
    """
    return (ranks(values) + 0.5) / len(values)


def _assign_cells(points, side, report):
    """Return which point goes to which cell of a `side` x `side` grid: indices, shape (column, row).

    Start: columns by the first coordinate, rows by the second. Then annealing: random pairs of cells a few cells apart
    exchange their points if that shortens the squared moves, or lengthens them by little while the temperature lasts.
    The moves end at about a third of what they were, 1.25 of the shortest possible (against the exact assignment).
    """
    cells = np.argsort(points[:, 0], kind="stable").reshape(side, side)
    cells = np.take_along_axis(cells, np.argsort(points[cells, 1], axis=1, kind="stable"), axis=1)
    rng = np.random.default_rng(0)
    column, row = np.meshgrid(np.arange(side), np.arange(side), indexing="ij")
    for sweep in range(_SWEEPS):
        if report and (sweep + 1) % (_SWEEPS // REPORTS) == 0:
            report()
        right, up = rng.integers(0, _REACH + 1), rng.integers(-_REACH, _REACH + 1)
        if right == up == 0:
            continue
        # Blocks of `right` columns (or `up` rows) are in turn first and second of their pairs, so pairs are disjoint.
        block = column // right if right else row // abs(up)
        first = (block + rng.integers(2)) % 2 == 0
        first &= (column + right < side) & (row + up >= 0) & (row + up < side)
        here = column[first], row[first]
        there = here[0] + right, here[1] + up
        one, other = cells[here], cells[there]
        # Exchanging adds 2 (p_other - p_one).(c_there - c_here) to the sum of squared moves; in cells, not sides.
        cost = side * (points[other] - points[one]) @ (right, up)
        swap = cost < _TEMPERATURE * (1 - sweep / _SWEEPS) ** 2 * rng.exponential(size=len(cost))
        cells[here[0][swap], here[1][swap]] = other[swap]
        cells[there[0][swap], there[1][swap]] = one[swap]
    return cells


def stratify_square(points, report=None):
    """Move N = k*k points so that every cell of a k x k grid and every of the N strata of each axis holds one.

    Parameters
    ----------
    points : ndarray, shape (N, 2)
    report : callable, optional
        Called `REPORTS` times in between.

    Returns
    -------
    ndarray of float64, shape (N, 2)
        Moved as little as the annealing of `_assign_cells` finds.
    """
    count = len(points)
    side = round(count**0.5)
    cells = _assign_cells(points, side, report)
    result = np.empty((count, 2))
    # Within a column the N strata of the first axis go by the first coordinate; likewise rows and the second axis.
    result[cells, 0] = (side * np.arange(side)[:, None] + ranks(points[cells, 0], axis=1) + 0.5) / count
    result[cells, 1] = (side * np.arange(side)[None, :] + ranks(points[cells, 1], axis=0) + 0.5) / count
    return result
