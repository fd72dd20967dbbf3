"""Sequential best-candidate sampling: the farthest of m n random candidates joins the pattern.

Mitchell 1991, section 4. The candidates, m n of them, grow with the pattern, so its statistics stay the same while its
density rises, and every prefix is a good pattern. The section's remarks are the options here: wrap-around, more
dimensions, the surface of a sphere, and other shapes than the disk: "a Poisson-diamond pattern might be better", since
the eye sees less of diagonal patterns.
"""

import numpy as np

from .tile import check_size

CANDIDATES = 10
"""The paper's m."""

_CROWDED = 2  # points a cell, on average, at which the grid is refined


class PointGrid:
    """Points in the cells of a grid, so that near ones are found quickly ("grid methods", section 4).

    Parameters
    ----------
    d : int
        Dimensions of the unit cube.
    norm : float
        Exponent p of the distance, (sum |x_i / a_i|^p)^(1/p): 1 is the diamond, 2 the disk.
    axes : ndarray, shape (d,)
        Half-axes a of the shape, for elliptic patterns.
    toroidal : bool
        Whether distances wrap around.
    """

    def __init__(self, d, norm, axes, toroidal):
        self.norm, self.axes, self.toroidal = norm, axes, toroidal
        self.points = np.empty((0, d))
        self.side = 1
        self._slots = np.full((1, 1), -1)
        self._offsets = np.stack(np.meshgrid(*[(-1, 0, 1)] * d, indexing="ij"), axis=-1).reshape(-1, d)

    def add(self, point):
        """Enter a point, shape (d,)."""
        self.points = np.append(self.points, point[None], axis=0)
        d = len(point)
        if len(self.points) > _CROWDED * self.side**d:
            self.side *= 2
            self._slots = np.full((self.side**d, 1), -1)
            for index in range(len(self.points)):
                self._enter(index)
        else:
            self._enter(len(self.points) - 1)

    def _enter(self, index):
        cell = self._flat((self.points[index] * self.side).astype(int))
        if (self._slots[cell] >= 0).all():
            self._slots = np.pad(self._slots, ((0, 0), (0, 1)), constant_values=-1)
        self._slots[cell, np.argmin(self._slots[cell])] = index

    def _flat(self, cells):
        return cells @ (self.side ** np.arange(cells.shape[-1]))

    def _powers(self, candidates, points):
        """Return the distances, to the power of p, of candidates (m, d) to points of shape (k, d) or (m, k, d)."""
        total = 0
        for axis, length in enumerate(self.axes):  # a sum over the short last axis would be several times slower
            difference = np.abs(candidates[:, axis, None] - points[..., axis])
            if self.toroidal:
                np.minimum(difference, 1 - difference, out=difference)
            difference /= length
            total = total + (difference * difference if self.norm == 2 else difference**self.norm)
        return total

    def nearest_distance(self, candidates):
        """Return each candidate's distance to the closest point; exact, whatever the grid.

        Parameters
        ----------
        candidates : ndarray, shape (m, d)

        Returns
        -------
        ndarray, shape (m,)
        """
        if self.side < 4:  # the 3^d neighbours would be nearly all cells, on the torus some of them twice
            return self._powers(candidates, self.points).min(axis=1) ** (1 / self.norm)
        cells = (candidates * self.side).astype(int)[:, None] + self._offsets
        found = self._slots[self._flat(cells % self.side)]
        if not self.toroidal:
            found[((cells < 0) | (cells >= self.side)).any(axis=2)] = -1
        found = found.reshape(len(candidates), -1)
        powers = np.where(found < 0, np.inf, self._powers(candidates, self.points[found])).min(axis=1)
        # A point outside the neighbouring cells is at least one cell away along some axis.
        unsure = powers > (1 / (self.side * self.axes.max())) ** self.norm
        if unsure.any():
            powers[unsure] = self._powers(candidates[unsure], self.points).min(axis=1)
        return powers ** (1 / self.norm)


def best_candidates(count, d, rng, m=CANDIDATES, toroidal=True, norm=2.0, axes=None):
    """Return a pattern whose every prefix is a high-frequency pattern.

    Parameters
    ----------
    count : int
        Number of points.
    d : int
        Dimensions of the unit cube.
    rng : numpy.random.Generator
    m : int
        Candidates per point that is already there; the quality "increases with m".
    toroidal : bool
        Whether the pattern can be replicated periodically.
    norm : float
        At least 1, finite; the unit ball of this Lp norm is the region of avoidance: 1 a diamond, 2 a disk.
    axes : sequence of float, optional
        Positive half-axes of that region along each dimension.

    Returns
    -------
    ndarray of float64, shape (count, d), in [0, 1)
        In the order of their making.

    Raises
    ------
    ValueError
        If an argument is out of range.
    """
    count, d, m = check_size("count", count), check_size("d", d), check_size("m", m)
    if not 1 <= norm < np.inf:
        raise ValueError(f"norm: expected a finite exponent of at least 1, got {norm!r}")
    axes = np.ones(d) if axes is None else np.asarray(axes, dtype=float)
    if axes.shape != (d,) or not ((axes > 0) & (axes < np.inf)).all():
        raise ValueError(f"axes: expected {d} positive numbers, got {axes.tolist()}")
    grid = PointGrid(d, norm, axes, toroidal)
    grid.add(rng.random(d))
    for existing in range(1, count):
        candidates = rng.random((m * existing, d))
        grid.add(candidates[np.argmax(grid.nearest_distance(candidates))])
    return grid.points


def best_candidates_on_sphere(count, rng, m=CANDIDATES):
    """Return unit vectors spread over the sphere, for solid angles of lights and glossy reflection.

    Parameters
    ----------
    count : int
    rng : numpy.random.Generator
    m : int
        As in `best_candidates`.

    Returns
    -------
    ndarray of float64, shape (count, 3)
        In the order of their making.
    """
    count, m = check_size("count", count), check_size("m", m)
    points = np.empty((count, 3))
    for existing in range(count):
        candidates = rng.standard_normal((max(1, m * existing), 3))
        candidates /= np.linalg.norm(candidates, axis=1, keepdims=True)
        # The closest point has the largest cosine; the best candidate the smallest of those.
        cosine = (candidates @ points[:existing].T).max(axis=1, initial=-1)
        points[existing] = candidates[np.argmin(cosine)]
    return points
