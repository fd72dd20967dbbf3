"""Statistics of a tile's values that do not look at the image: uniformity, spacing, correlation."""

import numpy as np

from .dimensions import groups


def l2_star_discrepancy(points):
    """Return the L2 star discrepancy by Warnock's formula (1972).

    Parameters
    ----------
    points : ndarray, shape (N, d), in [0, 1)

    Returns
    -------
    float
        Root mean square, over all boxes [0, x), of the difference between volume and share of points. Independent
        uniform points have about sqrt((2^-d - 3^-d) / N).
    """
    points = np.asarray(points, dtype=float)
    count, d = points.shape
    single = np.prod(1 - points**2, axis=1).sum() * 2 ** (1 - d) / count
    pairs = 0.0
    for start in range(0, count, 256):  # N^2 numbers at once would be too many
        block = points[start : start + 256]
        pairs += np.prod(1 - np.maximum(block[:, None], points), axis=2).sum()
    return float(np.sqrt(max(0.0, 3.0**-d - single + pairs / count**2)))


def star_discrepancy_1d(values):
    """Return the star discrepancy of numbers in [0, 1): the largest error of an interval's share."""
    ordered = np.sort(np.asarray(values, dtype=float).ravel())
    index = np.arange(len(ordered))
    return float(max(np.max((index + 1) / len(ordered) - ordered), np.max(ordered - index / len(ordered))))


def neighbour_distances(values):
    """Return how far values of neighbouring pixels are from each other.

    Parameters
    ----------
    values : ndarray, shape (T, T, n, d)

    Returns
    -------
    dict of str to float
        ``smallest``: mean over the pixels of the Euclidean distance of its first sample to the closest of its eight
        neighbours (on the torus in x and y); ``white``: the same after the pixels have been shuffled.
    """
    first = np.asarray(values[:, :, 0], dtype=float)
    shuffled = np.random.default_rng(0).permutation(first.reshape(-1, first.shape[-1])).reshape(first.shape)

    def smallest(image):
        shifts = [(dy, dx) for dy in (-1, 0, 1) for dx in (-1, 0, 1) if (dy, dx) != (0, 0)]
        distances = [np.linalg.norm(image - np.roll(image, shift, axis=(0, 1)), axis=2) for shift in shifts]
        return float(np.min(distances, axis=0).mean())

    return {"smallest": smallest(first), "white": smallest(shuffled)}


def empty_cells(points):
    """Return the share of the cells of the sqrt(N) x sqrt(N) grid that hold none of N points, shape (N, 2)."""
    side = int(np.sqrt(len(points)))
    cells = (np.asarray(points, dtype=float) * side).astype(int)
    return 1 - len(np.unique(cells[:, 0] * side + cells[:, 1])) / side**2


def correlations(values):
    """Return the correlation matrix of the dimensions over all samples, shape (D, D) (section 2: to be avoided)."""
    points = np.asarray(values, dtype=float).reshape(-1, values.shape[-1])
    if len(points) == 1:
        return np.full((points.shape[1],) * 2, np.nan)
    with np.errstate(invalid="ignore", divide="ignore"):  # of a dimension that is constant: not a number
        return np.atleast_2d(np.corrcoef(points.T))


def summary(tile):
    """Return a table of these statistics.

    Returns
    -------
    list of (str, dict of str to float)
        A row for each group of the tile's dimensions.
    """
    rows = []
    for name, columns in groups(tile.dims).items():
        values = tile.values[..., list(columns)]
        points = values.reshape(-1, len(columns))
        row = {"L2 discrepancy": l2_star_discrepancy(points[:16384])}
        row |= {f"star {tile.dims[c]}": star_discrepancy_1d(tile.values[..., c]) for c in columns}
        if len(columns) == 2:
            row["empty cells"] = empty_cells(points)
        distances = neighbour_distances(values)
        row["neighbour distance"] = distances["smallest"]
        row["the same, white"] = distances["white"]
        rows.append((name, row))
    return rows
