"""Positions of the samples in their pixels: blue noise on the film with exactly n samples in each pixel.

Mitchell 1991, section 5: "if there is no movement in a region of the image, then only the spatial projection of the
pattern is important, so we could begin by constraining it to form an optimal distribution, like Poisson-disk".
Section 6 starts from one jittered sample a cell; here each cell takes the best of several jittered candidates, the one
farthest from the samples that surround it (the idea of section 4).
"""

import numpy as np

from .messages import quoted
from .scanning import check_candidates

CANDIDATES = 32


def film_positions(size, dims, samples, rng, candidates=CANDIDATES, progress=None):
    """Return positions inside the pixels of a periodic film.

    Parameters
    ----------
    size : int
        Side T of the tile in pixels.
    dims : tuple of str
        ``film.x`` and ``film.y``, in this order.
    samples : int
        Samples n of a pixel.
    rng : numpy.random.Generator
    candidates : int
        Jittered candidates a sample; 1 is plain jitter.
    progress : callable, optional
        Called as ``progress(done, total)`` after each row.

    Returns
    -------
    ndarray of float64, shape (size, size, samples, 2), in [0, 1)
        Offsets (x, y) from the pixel's lower left corner, in pixels.

    Raises
    ------
    ValueError
        If `dims` are others.
    """
    candidates = check_candidates(candidates, samples)
    if dims != ("film.x", "film.y"):
        raise ValueError(f"dims: expected film.x, film.y for film positions, got {quoted(', '.join(dims))}")
    values = np.full((size, size, samples, 2), np.inf)  # infinitely far: not yet there
    offsets = np.array([(dx, dy) for dy in (-1, 0, 1) for dx in (-1, 0, 1)])
    for layer in range(samples):
        for row in range(size):
            for column in range(size):
                rows, columns = (row + offsets[:, 1]) % size, (column + offsets[:, 0]) % size
                near = (values[rows, columns] + offsets[:, None]).reshape(-1, 2)
                drawn = rng.random((candidates, 2))
                distance = ((drawn[:, None] - near) ** 2).sum(axis=2).min(axis=1)
                values[row, column, layer] = drawn[np.argmax(distance)]
            if progress:
                progress(layer * size + row + 1, samples * size)
    return values
