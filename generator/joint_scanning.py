"""The scanning algorithm for N parameters: joint and marginal distributions at once (Mitchell 1991, section 8).

Good marginals alone leave white noise where effects combine, in a moving penumbra; a good joint distribution alone
resulted "in relatively poor image quality". The paper met "this combination of conditions ... by extending the scanning
algorithm to select a series of primary, secondary, and tertiary candidates". Here the candidates pass one sieve after
the other, each keeping those with the largest smallest distance to the values near by:

1. the P-cells, group by group (Poisson-rod, Poisson-disk), then all dimensions together (Poisson-sphere);
2. the S-cells in the same order.

The paper does not say in which order its three sieves went. Letting the joint distance decide last in each ring, and
asking both rings for everything, was the best of nine orders tried (sigma = 1, t | light | both: .23 | .43 | .50; joint
alone .48 | .52 | .55, marginals alone .22 | .41 | .53).
"""

import numpy as np

from .dimensions import groups
from .scanning import Scan, best, check_candidates, smallest_distance

CANDIDATES = 1000
"""More than the 100 of a single group, because several sieves share them."""


def scan_jointly(size, dims, samples, rng, sieves, candidates=CANDIDATES, progress=None):
    """Fill a tile for several groups at once.

    Parameters
    ----------
    size : int
        Side T of the tile in pixels.
    dims : tuple of str
    samples : int
        Samples n of a pixel.
    rng : numpy.random.Generator
    sieves : sequence of (ring, columns)
        In their order: ring 0 for the P-cells, 1 for the S-cells of figure 7, and the dimensions that count for the
        distance. Each sieve keeps the same share of the candidates it gets; the last one leaves a single candidate.
    candidates : int
        How many are drawn.
    progress : callable, optional
        Called as ``progress(done, total)`` after each cell.

    Returns
    -------
    ndarray of float64, shape (size, size, samples, len(dims)), in [0, 1)
    """
    candidates = check_candidates(candidates, samples)
    kept = np.round(candidates ** (1 - np.arange(1, len(sieves) + 1) / len(sieves))).astype(int)
    scan = Scan(size, samples, len(dims))
    for cell in scan.cells(progress):
        rings = scan.neighbours(*cell)
        remaining = rng.random((candidates, len(dims)))
        for (ring, columns), keep in zip(sieves, kept, strict=True):
            columns = list(columns)
            distance = smallest_distance(remaining[:, columns], rings[ring][:, columns])
            remaining = best(remaining, distance, keep)
        scan.set(*cell, remaining[0])
    return scan.values


def joint_and_marginal_sieves(dims):
    """Return the sieves of the module's description."""
    everything = tuple(range(len(dims)))
    columns = [*groups(dims).values(), everything]
    return [(ring, part) for ring in (0, 1) for part in columns]


def joint_scanning(size, dims, samples, rng, candidates=CANDIDATES, progress=None):
    """Return values that are good jointly and in each group; parameters and result as in `generator.scanning`."""
    return scan_jointly(size, dims, samples, rng, joint_and_marginal_sieves(dims), candidates, progress)
