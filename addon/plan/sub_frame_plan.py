# SPDX-License-Identifier: GPL-3.0-or-later
"""Which samples are taken at which moment of the shutter, where the moments are rendered one by one.

With as many samples as moments each pixel takes one or some of its samples at every moment: consecutive ones of its own
sequence, so that all of them stay one stratified block.  With fewer, a moment gets some of the pixels only: those of
one cell of a periodic pattern, which is seen on every n-th pixel each way.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..cycles import random_numbers


class CellShot(NamedTuple):
    """Samples of the pixels of a cell that are taken together.

    Attributes
    ----------
    cell : (int, int)
        Row and column of the pixels that take them, in the period of the pattern.
    first, count : int
        Of the sequence that all pixels of a period share.
    opening : (float, float)
        The part of the shutter's whole exposure, from 0 to 1, that they stand for.
    sample : int
        Which of a pixel's samples the first one is.
    """

    cell: tuple[int, int]
    first: int
    count: int
    opening: tuple[float, float]
    sample: int

    @property
    def index(self):
        """Of the first one: row, column, and which of a pixel's samples."""
        return *self.cell, self.sample


@dataclass(frozen=True)
class SubFramePlan:
    """The shots of a frame.

    Attributes
    ----------
    side : int
        Period of the pattern, in pixels.
    length : int
        Samples of the sequence of a period.
    groups : list of list of CellShot
        Those of a group give each pixel the same number of samples; in the order of time, as their groups are.
    """

    side: int
    length: int
    groups: list


def side(samples, moments):
    """Least period, a power of two, by which so many samples a pixel reach all moments."""
    side = 1
    while side * side * samples < moments:
        side *= 2
    return side


def make(samples, moments, taken, seed, one_by_one=False):
    """The `SubFramePlan` of a frame.

    Parameters
    ----------
    samples : int
        Of a pixel.
    moments : int
    taken : range
        The samples of a pixel that are rendered.
    seed : int
        Moves the pattern.
    one_by_one : bool
        Whether each shot is to be of a single sample.
    """
    period = side(samples, moments)
    if period == 1:
        return SubFramePlan(1, samples, _whole(samples, moments, taken, one_by_one))
    ranks, order = _cells(period, seed)
    groups = []
    for sample in taken:
        # Each sample of a pixel has its own part of the shutter, which the cells share.
        times = (sample + (order + 0.5) / order.size) / samples
        moment = np.floor(times * moments).astype(int)
        group = []
        for cell in by_time(times):
            opening = moment[cell] / moments, (moment[cell] + 1) / moments
            group.append(CellShot(cell, int(ranks[cell]) * samples + sample, 1, opening, sample))
        groups.append(group)
    return SubFramePlan(period, order.size * samples, groups)


def by_time(times):
    """Rows and columns of cells, pairs of int, in the order of their times (rows, columns)."""
    order = np.argsort(times, axis=None)
    return list(zip(*(indices.tolist() for indices in np.unravel_index(order, times.shape)), strict=True))


def _whole(samples, moments, taken, one_by_one):
    """Groups of one shot each, for all pixels."""
    groups = []
    for moment in range(moments):
        start, end = samples * moment // moments, samples * (moment + 1) // moments
        # As long as its samples weigh.
        opening = start / samples, end / samples
        first, last = max(start, taken.start), min(end, taken.stop)
        step = 1 if one_by_one else max(1, last - first)
        groups += [[CellShot((0, 0), sample, step, opening, sample)] for sample in range(first, last, step)]
    return groups


def _cells(period, seed):
    """The place of each cell in the sequence, and in the order of time: two int arrays (period, period).

    Cells follow each other along a Z-curve, as Cycles' blue noise takes its pixels.  Time goes by the reversed bits of
    that: Bayer's matrix, by which neighbours are far apart.
    """
    rows, columns = np.mgrid[:period, :period]
    ranks = random_numbers.z_order(columns.ravel(), rows.ravel()).astype(np.uint32)
    bits = 2 * period.bit_length() - 2
    order = random_numbers.reverse_bits(ranks) >> np.uint32(32 - bits)
    moved = np.random.default_rng(seed).integers(0, period, 2)
    return tuple(np.roll(cells.astype(int).reshape(period, period), moved, axis=(0, 1)) for cells in (ranks, order))
