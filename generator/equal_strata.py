"""Exact stratification of values that are nearly stratified already.

Cook's design (Mitchell 1991, section 2) over the whole tile: every single dimension hits each of its T*T strata once, a
pair hits in addition each cell of a T x T grid once.
"""

import numpy as np


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


def stratify_square(points):
    """Move N = k*k points so that every cell of a k x k grid and every of the N strata of each axis holds one.

    Points are split into k columns by their first coordinate and each column into k rows by the second.

    Parameters
    ----------
    points : ndarray, shape (N, 2)

    Returns
    -------
    ndarray of float64, shape (N, 2)
    """
    count = len(points)
    side = round(count**0.5)
    cells = np.argsort(points[:, 0], kind="stable").reshape(side, side)
    cells = np.take_along_axis(cells, np.argsort(points[cells, 1], axis=1, kind="stable"), axis=1)
    result = np.empty((count, 2))
    # Within a column the N strata of the first axis go by the first coordinate; likewise rows and the second axis.
    result[cells, 0] = (side * np.arange(side)[:, None] + ranks(points[cells, 0], axis=1) + 0.5) / count
    result[cells, 1] = (side * np.arange(side)[None, :] + ranks(points[cells, 1], axis=0) + 0.5) / count
    return result
