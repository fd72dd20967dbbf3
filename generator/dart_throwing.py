"""Dart throwing: uniform darts, kept if no earlier one is closer than a radius (Mitchell 1991, section 3).

The best known pattern with little low-frequency power is the Poisson disk: random, but no two points closer than a
given distance. Throwing darts makes one, slowly, and "makes it difficult to control the final density" (section 4);
`poisson_disk_count` therefore searches for the radius that gives a wanted number of points.
"""

import numpy as np

from .tile import check_size

FAILURES = 2000
"""Darts in a row that may miss before the pattern counts as full."""

PATIENCE, SHRINKING = 200, 0.98
"""With a wanted count: darts in a row that may miss before the radius shrinks, and the factor."""


def toroidal_distance(points, centre):
    """Return the Euclidean distances of `points`, shape (k, d), to `centre` on the unit torus."""
    difference = np.abs(points - centre)
    return np.sqrt((np.minimum(difference, 1 - difference) ** 2).sum(axis=-1))


def is_free(dart, points, radius):
    """Return whether no point is closer to the dart than `radius`."""
    return not len(points) or toroidal_distance(points, dart).min() >= radius


def poisson_disk_radius(radius, rng, d=2, limit=None):
    """Throw darts on the unit torus until `FAILURES` in a row miss.

    Parameters
    ----------
    radius : float
        Smallest distance of two points, in (0, 0.5].
    rng : numpy.random.Generator
    d : int
        Dimensions.
    limit : int, optional
        Stop as soon as there are so many points.

    Returns
    -------
    ndarray of float64, shape (count, d), in [0, 1)

    Raises
    ------
    ValueError
        If the radius is out of range.
    """
    if not 0 < radius <= 0.5:
        raise ValueError(f"radius: expected a number in (0, 0.5], got {radius!r}")
    return _throw(np.empty((0, d)), radius, rng, FAILURES, limit)


def _throw(points, radius, rng, patience, limit=None):
    """Add free darts to the pattern until `patience` in a row have missed, or it has `limit` points."""
    failures = 0
    while failures < patience and (limit is None or len(points) < limit):
        dart = rng.random(points.shape[1])
        if is_free(dart, points, radius):
            points = np.append(points, dart[None], axis=0)
            failures = 0
        else:
            failures += 1
    return points


def poisson_disk_count(count, rng, d=2):
    """Throw darts with a radius that shrinks until the pattern has `count` points.

    The radius starts where even the densest packing would be full and shrinks whenever the pattern seems to be.

    Parameters
    ----------
    count : int
    rng : numpy.random.Generator
    d : int
        Dimensions.

    Returns
    -------
    points : ndarray of float64, shape (count, d), in [0, 1)
    radius : float
        Smallest distance that was asked for in the end.

    Raises
    ------
    ValueError
        If `count` is not positive.
    """
    count = check_size("count", count)
    radius = min(0.5, 1.1 * count ** (-1 / d))
    points = _throw(np.empty((0, d)), radius, rng, PATIENCE, count)
    while len(points) < count:
        radius *= SHRINKING
        points = _throw(points, radius, rng, PATIENCE, count)
    return points, radius
