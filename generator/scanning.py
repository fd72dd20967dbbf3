"""Mitchell's scanning algorithm: each cell takes the candidate farthest from its neighbours' values.

Mitchell 1991, section 6 for one parameter, section 7 for two. Cells are visited in scanning order, left to right and
top to bottom. Of 100 random *primary candidates* those 10 are kept whose smallest distance to the values of the
P-cells, the ring of figure 7 next to the cell, is largest; of these *secondary candidates* the one with the largest
smallest distance to the S-cells, the outer ring, wins.

Distances wrap around at 0 and 1, "so the pattern can be used periodically from frame to frame".

Two additions: neighbours are looked up on the torus, so that the last rows and columns also fit the first ones and the
tile can be replicated; and a cell's earlier samples, where there are several, count as P-cells.
"""

import numpy as np

from .dimensions import groups
from .progress import part_of
from .tile import check_size


def neighbour_offsets():
    """Return the (dy, dx) of the 8 P-cells and the 16 S-cells of figure 7, with the half not yet visited."""
    square = [(dy, dx) for dy in range(-2, 3) for dx in range(-2, 3)]
    ring = {1: [], 2: [], 0: []}
    for dy, dx in square:
        ring[max(abs(dy), abs(dx))].append((dy, dx))
    return np.array(ring[1]), np.array(ring[2])


def smallest_distance(candidates, values):
    """Return each candidate's distance to the closest value.

    Parameters
    ----------
    candidates : ndarray, shape (m, d)
    values : ndarray, shape (k, d)

    Returns
    -------
    ndarray, shape (m,)
        Euclidean distances on the unit torus, so that there is no border to which values could flee; infinite if there
        are no values.
    """
    difference = np.abs(candidates[:, None] - values)
    difference = np.minimum(difference, 1 - difference)
    return np.sqrt((difference**2).sum(axis=2)).min(axis=1, initial=np.inf)


class Scan:
    """The grid of values while it is being filled: which cells have a value, and who the neighbours of a cell are."""

    def __init__(self, size, samples, d):
        self.size = size
        self.values = np.empty((size, size, samples, d))
        self.filled = np.zeros((size, size, samples), dtype=bool)
        self.rings = neighbour_offsets()

    def cells(self, progress=None):
        """Yield (layer, row, column) in scanning order; row 0 of a tile is the lowest, so rows count down."""
        layers = self.values.shape[2]
        for layer in range(layers):
            for row in reversed(range(self.size)):
                for column in range(self.size):
                    yield layer, row, column
                    if progress:
                        done = ((layer + 1) * self.size - row - 1) * self.size + column + 1
                        progress(done, layers * self.size**2)

    def neighbours(self, layer, row, column):
        """Return the values of the P-cells and of the S-cells that have one."""
        found = []
        for ring in self.rings:
            rows, columns = (ring + np.array([row, column])).T % self.size
            present = self.filled[rows, columns, layer]
            found.append(self.values[rows[present], columns[present], layer])
        own = self.values[row, column, :layer]
        return np.concatenate([found[0], own]), found[1]

    def set(self, layer, row, column, value):
        """Give a cell its value."""
        self.values[row, column, layer] = value
        self.filled[row, column, layer] = True


def best(candidates, distance, keep):
    """Return the `keep` candidates with the largest distance."""
    return candidates[np.argpartition(-distance, keep - 1)[:keep]]


CANDIDATES, SECONDARY = 100, 10
"""The paper's numbers of primary and secondary candidates."""

MOST_CANDIDATES = 10_000
"""Candidates of a sample, at most; a tenth of a second for a cell with few samples."""

_MOST_COMPARED = 100_000  # candidates times samples of a pixel, which are compared with one another


def check_candidates(candidates, samples):
    """Return the number of candidates as an int, or raise a ValueError if it is none or too large."""
    candidates = check_size("candidates", candidates, maximum=MOST_CANDIDATES)
    if candidates * samples > _MOST_COMPARED:
        most = _MOST_COMPARED // samples
        raise ValueError(f"candidates: expected at most {most} with {samples} samples a pixel, got {candidates}")
    return candidates


def scan_group(size, d, samples, rng, candidates=CANDIDATES, secondary=SECONDARY, progress=None):
    """Fill a tile for one group of parameters (sections 6 and 7).

    Parameters
    ----------
    size : int
        Side T of the tile in pixels.
    d : int
        Dimensions of the group.
    samples : int
        Samples n of a pixel.
    rng : numpy.random.Generator
    candidates, secondary : int
        Primary candidates drawn, and how many of them become secondary ones.
    progress : callable, optional
        Called as ``progress(done, total)`` after each cell.

    Returns
    -------
    ndarray of float64, shape (size, size, samples, d), in [0, 1)

    Raises
    ------
    ValueError
        If there are no candidates, or more secondary than primary ones.
    """
    candidates = check_candidates(candidates, samples)
    secondary = check_size("secondary", secondary, maximum=candidates)
    scan = Scan(size, samples, d)
    for cell in scan.cells(progress):
        near, far = scan.neighbours(*cell)
        primary = rng.random((candidates, d))
        kept = best(primary, smallest_distance(primary, near), secondary)
        scan.set(*cell, best(kept, smallest_distance(kept, far), 1)[0])
    return scan.values


def scanning(size, dims, samples, rng, candidates=CANDIDATES, secondary=SECONDARY, progress=None):
    """Return values whose groups are scanned one by one: good marginal, random joint distributions.

    Parameters and result are those of `generator.white.white`, and for each group those of `scan_group`.
    """
    values = np.empty((size, size, samples, len(dims)))
    parts = groups(dims).values()
    for index, columns in enumerate(parts):
        report = part_of(progress, index, len(parts))
        values[..., columns] = scan_group(size, len(columns), samples, rng, candidates, secondary, report)
    return values
