"""Several samples a pixel that stay an Owen-scrambled Sobol sequence while an optimiser moves them.

The samples of a pixel should be stratified as well as a low-discrepancy sequence, after every power of two of them. All
sequences that Owen scrambling can make of the first n Sobol points have this property (Owen 1998); they differ in one
bit, flip or not, per inner node of the binary tree over each axis, and in the position inside the n strata. `OwenNets`
finds a member of this family that is near to arbitrary points: a node is flipped if the points of its lower half lie,
on average, above those of its upper half. An optimiser may then move the points freely, be judged by the nearest net,
and turn whole branches over by moving points far enough.

As Cycles does, three numbers share one sequence, here (lens.u, lens.v, t) and (light.u, light.v, light.pick), the pair
being the first two Sobol dimensions, a (0, 2)-sequence; the sets are decorrelated by shuffling the sample order within
each pixel, in a nested way that keeps every prefix of a power of two.
"""

import numpy as np

from .dimensions import check_dims

_SEQUENCES = {
    "lens.u": ("camera", 0),
    "lens.v": ("camera", 1),
    "t": ("camera", 2),
    "light.u": ("light", 0),
    "light.v": ("light", 1),
    "light.pick": ("light", 2),
    "bsdf.u": ("bsdf", 0),
    "bsdf.v": ("bsdf", 1),
    "film.x": ("film", 0),
    "film.y": ("film", 1),
}


def sobol_cells(bits):
    """Return the strata of the first 2**bits points of the first three Sobol dimensions.

    Direction numbers of Joe and Kuo 2008: m = (1, 1, ...), then the recurrences of the primitive polynomials x + 1 and
    x^2 + x + 1.

    Returns
    -------
    ndarray of int, shape (2**bits, 3), in [0, 2**bits)
    """
    numbers = [[1] * bits, [1], [1, 3]]
    while len(numbers[1]) < bits:
        numbers[1].append(2 * numbers[1][-1] ^ numbers[1][-1])
    while len(numbers[2]) < bits:
        numbers[2].append(2 * numbers[2][-1] ^ 4 * numbers[2][-2] ^ numbers[2][-2])
    index = np.arange(2**bits)
    cells = np.zeros((2**bits, 3), dtype=int)
    for axis in range(3):
        for bit in range(bits):
            cells[:, axis] ^= (index >> bit & 1) * (numbers[axis][bit] << (bits - 1 - bit))
    return cells


def nested_shuffles(count, bits, rng):
    """Return random orders of 2**bits samples whose prefixes of 2**k are aligned blocks, that is nets again.

    Returns
    -------
    ndarray of int, shape (count, 2**bits)
    """
    index = np.broadcast_to(np.arange(2**bits), (count, 2**bits))
    order = np.zeros_like(index)
    for bit in range(bits):
        flips = rng.integers(0, 2, (count, 2 ** (bits - bit - 1)))
        order |= (index >> bit & 1 ^ np.take_along_axis(flips, index >> (bit + 1), axis=1)) << bit
    return order


class OwenNets:
    """One family of nets per pixel.

    Parameters
    ----------
    pixels : int
    samples : int
        A power of two.
    dims : tuple of str
    rng : numpy.random.Generator
        Draws the sample orders.

    Raises
    ------
    ValueError
        If `samples` is not a power of two.
    """

    def __init__(self, pixels, samples, dims, rng):
        self.bits = samples.bit_length() - 1
        if samples != 2**self.bits:
            raise ValueError(f"samples: expected a power of two for Sobol points, got {samples}")
        cells = sobol_cells(self.bits)
        shuffles = {}
        order = np.empty((pixels, samples, len(dims)), dtype=int)
        for column, dim in enumerate(check_dims(dims)):
            sequence, axis = _SEQUENCES[dim]
            if sequence not in shuffles:
                shuffles[sequence] = nested_shuffles(pixels, self.bits, rng)
            order[..., column] = np.argsort(cells[shuffles[sequence], axis], axis=1)
        self._sample_of_cell = order
        self._cell_of_sample = np.argsort(order, axis=1)

    def nearest(self, points):
        """Return the nets nearest to the points.

        Parameters
        ----------
        points : ndarray, shape (pixels, samples, D)

        Returns
        -------
        ndarray of float64, shape (pixels, samples, D), in [0, 1)
            One point in each of the n strata of each axis and pixel. Inside a stratum the pixels' points keep their
            order and are spread evenly, so that each axis of the whole tile is exactly stratified too.
        """
        pixels, samples, d = points.shape
        in_order = np.take_along_axis(points, self._sample_of_cell, axis=1)
        cell = np.zeros(points.shape, dtype=int)
        for level in range(self.bits):
            middle = cell / samples + 0.5 ** (level + 1)
            halves = (in_order - middle).reshape(pixels, 2**level, 2, -1, d).sum(axis=3)
            flip = halves[:, :, 0] > halves[:, :, 1]
            bit = np.stack([flip, ~flip], axis=2).astype(int)
            cell |= np.repeat(bit.reshape(pixels, -1, d), samples >> level + 1, axis=1) << self.bits - level - 1
        cell = np.take_along_axis(cell, self._cell_of_sample, axis=1)
        result = np.empty(points.shape)
        spread = (np.arange(pixels * samples) + 0.5) / (pixels * samples)
        for column in range(d):
            # Values are below 2 cells wide, so this sorts by stratum first and by value inside it.
            order = np.argsort(2 * cell[..., column] + points[..., column], axis=None)
            result[..., column].flat[order] = spread
        return result
