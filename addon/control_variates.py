# SPDX-License-Identifier: GPL-3.0-or-later
"""Noise that Cycles' random numbers explain, taken out of the picture.

A sample's radiance is a function of its random numbers, and those are known (`addon.cycles_random`).  Where the pixels
around show that radiance rises by b with each unit of a mode f of the numbers (`addon.modes`), b f is the part of a
pixel's noise that this mode has caused.  It is known, and its mean is zero: subtracting it takes noise away and leaves
the expectation alone.  That is a control variate with a coefficient from regression (Hammersley and Handscomb, "Monte
Carlo Methods" (1964), section 5.5; Salaün et al., "Regression-based Monte Carlo Integration" (2022), fit the many
samples of one pixel, here it is a few samples each of many pixels).

Three things keep the expectation: a pixel's own block has no say in its coefficient, only the blocks around have;
what that is scaled by, the size of the noise nearby, knows nothing of its sign; and modes are waves, as often and as
far below zero as above.
"""

import collections
import concurrent.futures
import os

import numpy as np

from . import automatic, modes

# Modes that are looked for, and samples a pixel beyond which what is left to explain is not worth the time.
_MODES = 32
MOST_SAMPLES = 4

# Pixels a side of the blocks that share their coefficients, and to how many blocks each way a block listens.
_BLOCK = 8
_NEIGHBOURS = 2

# How much it listens to each row and column of them; to itself it does not.
_NEARNESS = np.exp(-(np.arange(-_NEIGHBOURS, _NEIGHBOURS + 1) ** 2) / 2.88).astype(np.float32)
_WEIGHTS = np.outer(_NEARNESS, _NEARNESS)
_WEIGHTS[_NEIGHBOURS, _NEIGHBOURS] = 0.0
_WEIGHTS /= _WEIGHTS.sum()

# Rows of pixels that are worked at together, at most, a multiple of the block's: each takes some 100 bytes a pixel.
_ROWS = 128

# What differs from the mean over so many pixels to each side is noise.
_REACH = 3

# A difference counts as at most this many times the usual one: a very bright sample must not speak for its whole block.
_OUTLIER = 4.0

# Squared slopes are believed as far as they exceed chance this many times.  All of a block's are put to the proof: in
# units of chance, their sum must exceed its mean by so many of its standard deviations, which no edge or texture does.
_DOUBT = 2.0
_PROOF = 8.0

# Brighter than this pixels are not told apart, so that no square overflows.
_BRIGHTEST = np.float32(1e15)

_TINY = np.float32(1e-20)


def of_picture(use, region, plan, sequence):
    """What takes the explained noise out of a picture.

    Parameters
    ----------
    use : analysis.SceneUse
    region : addon.region.Region
    plan : plan.Plan
    sequence : int
        Samples a pixel of Cycles' whole sequence.

    Returns
    -------
    callable or None
        Planes (planes, height, width) of a picture by the plan, first sample, number of samples -> planes.  None if
        nothing is left to chance.
    """
    sources = tuple(automatic.shares(use))
    if not sources:
        return None
    ranks, lens_shift = plan.at_film(region)

    def taken_out(planes, first, samples):
        chosen = list(automatic.error_modes(sources, samples, _MODES))

        def numbers(rows):
            found = automatic.numbers(chosen, ranks[rows], samples, sequence, first)
            for name in found.keys() & lens_shift.keys():
                found[name] += lens_shift[name][rows]
            return found

        return without_noise(planes, numbers, chosen)

    return taken_out


def without_noise(planes, numbers, chosen):
    """Take out the noise that modes of the random numbers explain.

    Parameters
    ----------
    planes : float32 array, shape (planes, height, width)
        Radiances, each the mean of one or several samples.
    numbers : callable
        Rows of the picture (slice) -> dict of dimension to uint8 array, shape (samples, rows, width): leading bytes of
        the samples' random numbers (`cycles_random.leading_bytes`).
    chosen : sequence of tuple
        The modes, as in `modes.variances`.

    Returns
    -------
    float32 array, shape (planes, height, width)
    """
    height = planes.shape[1]
    result = np.empty_like(planes)
    part = min(_ROWS, _BLOCK * max(1, -(-height // (_BLOCK * (os.process_cpu_count() or 1)))))
    # Blocks that are listened to, and the pixels around these.
    margin = (_NEIGHBOURS + 1) * _BLOCK

    def clean(top):
        seen = slice(max(0, top - margin), min(height, top + part + margin))
        for row, explained in _explained(planes[:, seen], lambda rows: numbers(_moved(rows, seen.start)), chosen):
            own = _moved(row, seen.start)
            if top <= own.start < top + part:
                result[:, own] = planes[:, own] - explained

    with concurrent.futures.ThreadPoolExecutor(os.process_cpu_count()) as threads:
        list(threads.map(clean, range(0, height, part)))
    return result


def _moved(rows, by):
    return slice(rows.start + by, rows.stop + by)


def _explained(planes, numbers, chosen):
    """For each row of blocks its rows of pixels, and the noise in them that the modes explain."""
    _, height, width = planes.shape
    planes = np.clip(np.nan_to_num(planes), -_BRIGHTEST, _BRIGHTEST)
    noise = planes - _mean_around(planes)
    size = np.sqrt(_mean_around(np.square(noise)))
    rows = [slice(top, min(top + _BLOCK, height)) for top in range(0, height, _BLOCK)]
    waiting, heard = collections.deque(), collections.deque(maxlen=2 * _NEIGHBOURS + 1)
    heard.extend([None] * _NEIGHBOURS)
    for row in [*rows, *[None] * _NEIGHBOURS]:
        if row is None:
            heard.append(None)
        else:
            blocks = _Blocks(noise[:, row], size[:, row], numbers(row), chosen)
            waiting.append((row, blocks))
            heard.append(blocks)
        if len(heard) == heard.maxlen:
            own, blocks = waiting.popleft()
            yield own, blocks.explained(heard)[..., :width]


class _Blocks:
    """A row of blocks: what its pixels say of the modes' slopes.

    All arrays start with (columns, planes).
    """

    def __init__(self, noise, size, numbers, chosen):
        self._rows = noise.shape[1]
        inside = _in_blocks(np.ones((1, *noise.shape[1:]), np.float32))
        values = {name: np.moveaxis(_in_blocks(byte), 1, 0) for name, byte in numbers.items()}
        self.waves = np.empty((len(inside), len(chosen), inside.shape[2]), np.float32)
        for column, wave in enumerate(modes.waves(chosen, values)):
            self.waves[:, column] = wave
        self.waves[-1] *= inside[-1]
        if self._rows < _BLOCK:
            self.waves *= inside
        self.size = _in_blocks(size)
        noise = _in_blocks(noise)
        limit = _OUTLIER * self.size.mean(axis=2, keepdims=True)
        noise = np.clip(noise, -limit, limit)
        # Sums that make slopes, and what is needed to judge them, side by side so that they are summed up at once.
        self.told = np.concatenate(
            [
                noise @ self.waves.swapaxes(1, 2),
                np.broadcast_to(np.square(self.waves).sum(axis=2)[:, None], (*noise.shape[:2], len(chosen))),
                np.square(noise).sum(axis=2, keepdims=True),
                np.broadcast_to(inside.sum(axis=2, keepdims=True), (*noise.shape[:2], 1)),
            ],
            axis=2,
        )

    def explained(self, heard):
        """The noise that the modes explain, by what the rows of blocks around say: (planes, rows, columns' pixels)."""
        total = sum(_along(row.told, weights) for weights, row in zip(_WEIGHTS, heard, strict=True) if row is not None)
        count = self.waves.shape[1]
        product, power, square, pixels = np.split(total, [count, 2 * count, 2 * count + 1], axis=2)
        variance = square / np.maximum(pixels, _TINY)
        slope = product / np.maximum(power, _TINY)
        # In squares of what chance would make of no slope at all.
        evidence = np.square(product) / np.maximum(variance * power * np.square(_WEIGHTS).sum(), _TINY)
        slope *= np.maximum(1.0 - _DOUBT / np.maximum(evidence, _DOUBT), 0.0)
        slope *= evidence.sum(axis=2, keepdims=True) > count + _PROOF * np.sqrt(2.0 * count)
        scale = np.minimum(self.size / np.sqrt(np.maximum(variance, _TINY)), 1.0)
        return _from_blocks(scale * (slope @ self.waves))[:, : self._rows]


def _along(columns, weights):
    """Weighted sum of each column's neighbours, and of itself."""
    padded = np.pad(columns, ((_NEIGHBOURS, _NEIGHBOURS), (0, 0), (0, 0)))
    return sum(weight * padded[shift : shift + len(columns)] for shift, weight in enumerate(weights))


def _mean_around(planes):
    """Mean over the pixels within `_REACH` each way: (planes, height, width)."""
    for axis in (1, 2):
        margin = [(0, 0)] * 3
        margin[axis] = (_REACH, _REACH)
        padded = np.moveaxis(np.pad(planes, margin, mode="edge"), axis, 0)
        length = planes.shape[axis]
        total = sum(padded[shift : shift + length] for shift in range(2 * _REACH + 1))
        planes = np.moveaxis(total, 0, axis) / np.float32(2 * _REACH + 1)
    return planes


def _in_blocks(planes):
    """(planes, rows, width), at most a block high, as (columns, planes, pixels); zeros fill the last blocks."""
    count, height, width = planes.shape
    if height < _BLOCK or width % _BLOCK:
        planes = np.pad(planes, ((0, 0), (0, _BLOCK - height), (0, -width % _BLOCK)))
    blocks = planes.reshape(count, _BLOCK, -1, _BLOCK).transpose(2, 0, 1, 3)
    return blocks.reshape(len(blocks), count, _BLOCK * _BLOCK)


def _from_blocks(blocks):
    """The reverse of `_in_blocks`, whole blocks."""
    columns, count, _ = blocks.shape
    return blocks.reshape(columns, count, _BLOCK, _BLOCK).transpose(1, 2, 0, 3).reshape(count, _BLOCK, -1)
