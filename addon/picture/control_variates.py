# SPDX-License-Identifier: GPL-3.0-or-later
"""Noise that Cycles' random numbers explain, taken out of the picture.

A sample's radiance is a function of its random numbers, and those are known (`cycles.random_numbers`).  Where
the pixels around show that radiance rises by b with each unit of a mode f of the numbers (`addon.modes`), b f is the part of a
pixel's noise that this mode has caused.  It is known, and its mean is zero: subtracting it takes noise away and leaves
the expectation alone.  That is a control variate with a coefficient from regression (Hammersley and Handscomb, "Monte
Carlo Methods" (1964), section 5.5; Salaün et al., "Regression-based Monte Carlo Integration" (2022), fit the many
samples of one pixel, here it is a few samples each of many pixels).

Three things keep the expectation: a pixel's own block has no say in its coefficient, only the blocks around have;
what that is scaled by, the size of the noise nearby, knows nothing of its sign; and modes are waves, as often and as
far below zero as above.

Which modes are looked for, and how far a coefficient is believed, tiles of the picture say beforehand: by how much
coefficients of that mode differ from zero on average, beyond chance (empirical Bayes; Efron and Morris, "Stein's
Estimation Rule and Its Competitors" (1973)).
"""

import concurrent.futures
import itertools
import math
import os
from dataclasses import dataclass

import numpy as np

from ..plan import arranged_plan, modes

# Modes that may explain something, and how many of them are used.  And samples a pixel beyond which what is left to
# explain is not worth the time.
_CANDIDATES, _MODES = 64, 24
MOST_SAMPLES = 16

# Pixels a side of the blocks that share their coefficients, and to how many blocks each way a block listens.
_BLOCK = 8
_NEIGHBOURS = 2

# How much it listens to each row and column of them; to itself, and to blocks with its own numbers, it does not.
_AWAY = np.arange(-_NEIGHBOURS, _NEIGHBOURS + 1)
_NEARNESS = np.exp(-(_AWAY**2) / 2.88).astype(np.float32)

# Pixels that are worked at together, which take some 500 bytes each: few, but enough that threads seldom meet.
_TOGETHER = 2**16

# Pixels a side of the tiles, at most, that tell which modes matter in the picture; how many of them, and how many of
# these are worked at together.
_TILE, _TILES, _TILES_TOGETHER = 64, 16, 8

# Pixels of each block of a tile that tell what modes have in common.
_TELLING = 16

# What differs from the mean over so many pixels to each side is noise.
_REACH = 3

# A difference counts as at most this many times the usual one: a very bright sample must not speak for its whole block.
_OUTLIER = 4.0

# Evidence counts that chance makes once in exp of this many times: that of a mode in the picture, and that of all modes
# together in the blocks around.
_PROOF = 10.0

# Part of a mode's mean square that others are not to explain, so that numbers stay small.
_ALIKE = 1e-3

# Brighter than this pixels are not told apart, so that no square overflows.
_BRIGHTEST = np.float32(1e15)

_TINY = np.float32(1e-20)


def of_picture(use, drawn, period=0):
    """What takes the explained noise out of a picture.

    Parameters
    ----------
    use : analysis.SceneUse
    drawn : callable
        Pixels, modes, number of samples, first one -> the `numbers` of `without_noise`.
    period : int
        As `without_noise` takes it.

    Returns
    -------
    callable or None
        Planes (planes, height, width) of a picture by the plan, first sample, number of samples, which pixels as
        `without_noise` takes them, and what they drew if not what `drawn` tells -> planes.  None if nothing is left to
        chance, or no block has other numbers.
    """
    sources = tuple(arranged_plan.shares(use))
    if not sources or 0 < period <= _BLOCK:
        return None

    def taken_out(planes, first, samples, taken=None, drawn=drawn):
        candidates = tuple(arranged_plan.error_modes(sources, samples, _CANDIDATES))

        def numbers(pixels, chosen):
            return drawn(pixels, chosen, samples, first)

        return without_noise(planes, numbers, candidates, period, taken)

    return taken_out


def without_noise(planes, numbers, candidates, period=0, taken=None):
    """Take out the noise that modes of the random numbers explain.

    Parameters
    ----------
    planes : float32 array, shape (planes, height, width)
        Radiances, each the mean of one or several samples.
    numbers : callable
        Pixels of the picture (rows and columns, index arrays that broadcast together), modes -> dict of dimension to
        uint8 array, shape (samples, ...): leading bytes of the samples' random numbers
        (`cycles_random.leading_bytes`), of the dimensions that the modes depend on.
    candidates : sequence of tuple
        Modes that may explain something, as in `modes.variances`.
    period : int
        Pixels each way after which numbers repeat, a multiple of 8; 0 if they do not.
    taken : bool array, shape (height, width), optional
        The pixels from which noise is to be taken out, and which tell of it; all by default.

    Returns
    -------
    float32 array, shape (planes, height, width)
    """
    _, height, width = planes.shape
    taken = np.ones((height, width), bool) if taken is None else taken
    if not taken.any():
        return planes.copy()
    processors = os.process_cpu_count() or 1
    part = max(_whole_blocks(_TOGETHER // width), _whole_blocks(-(-height // processors)))
    # Blocks that are listened to, and the pixels around these.
    margin = (_NEIGHBOURS + 1) * _BLOCK
    result = planes.copy()
    with concurrent.futures.ThreadPoolExecutor(processors) as threads:
        found = _survey(planes, taken, numbers, candidates, _Listening(period), threads)

        def clean(top):
            seen = slice(max(0, top - margin), min(height, top + part + margin))
            own = slice(top, min(top + part, height))
            for rows, explained in _explained(planes[:, seen], taken[seen], numbers, found, seen.start):
                here = _moved(rows, seen.start)
                kept = slice(max(here.start, own.start), min(here.stop, own.stop))
                if kept.start < kept.stop:
                    result[found.noisy, kept] -= explained[:, kept.start - here.start : kept.stop - here.start]

        if found.modes:
            list(threads.map(clean, range(0, height, part)))
    return result


class _Listening:
    """How much a block listens to those around it, each way, when numbers repeat after `period` pixels.

    Attributes
    ----------
    own : float32 array
        Weights of the rows (and columns) with the block's own numbers: what they have in common is not listened to.
    heard : float
        The number of blocks that have one say.
    """

    def __init__(self, period):
        same = _AWAY % (period // _BLOCK) == 0 if period else _AWAY == 0
        self.own = np.where(same, _NEARNESS, np.float32(0))
        weights = _NEARNESS.sum() ** 2 - self.own.sum() ** 2
        squares = np.square(_NEARNESS).sum() ** 2 - np.square(self.own).sum() ** 2
        self.heard = float(weights**2 / squares)


@dataclass(frozen=True)
class _Survey:
    """What explains noise in a picture.

    Attributes
    ----------
    listening : _Listening
    modes : list of tuple
    basis : float32 array, shape (directions, modes)
        Sums of modes that do not go together: several samples of a pixel depend on each other, and so do their modes.
        Their mean square is 1.
    noisy : integer array
        Planes of which something is explained.
    strength : float32 array, shape (noisy planes, directions)
        By how much the squares of their scores (`_Blocks.listen`) exceed chance on average; 0 if not by enough.
    """

    listening: _Listening
    modes: list[tuple]
    basis: np.ndarray
    noisy: np.ndarray
    strength: np.ndarray


def _survey(planes, taken, numbers, candidates, listening, threads):
    """Find out in some tiles of the picture, where most pixels are taken, what explains most."""
    sides, counts = zip(*map(_tiles, planes.shape[1:]), strict=True)
    corners = np.stack(np.meshgrid(*map(np.arange, counts), indexing="ij"), axis=-1).reshape(-1, 2) * sides
    if len(corners) > _TILES:
        corners = np.random.default_rng(0).permutation(corners)
        counts = np.array([taken[y : y + sides[0], x : x + sides[1]].sum() for y, x in corners])
        corners = corners[np.argsort(-counts, kind="stable")[:_TILES]]

    def look(some):
        rows, columns = (
            start[:, None] + np.arange(side) for start, side in zip(np.transpose(some), sides, strict=True)
        )
        pixels = rows[:, :, None], columns[:, None, :]
        inside = taken[pixels].astype(np.float32)
        noise, size = _noise(np.moveaxis(planes[:, *pixels], 0, 1), inside)
        blocks = _Blocks(noise, size, inside, (rows, columns), numbers, candidates)
        score, _, _ = blocks.listen(None, None, listening)
        return *blocks.moments(), score

    looks = threads.map(look, itertools.batched(corners, _TILES_TOGETHER, strict=False))
    moments, pixels, scores = zip(*looks, strict=True)
    moments, scores = sum(moments) / max(sum(pixels), 1.0), np.concatenate(scores)
    # A few pixels at an edge may be in no tile, or tell nothing.
    if not (len(scores) and moments.diagonal().all()):
        nothing = np.zeros((0, 0), np.float32)
        return _Survey(listening, [], nothing, np.arange(0), nothing)
    least = _most_by_chance(listening.heard / len(scores), listening.heard / len(scores))

    def strength(basis):
        excess = np.square(scores @ basis.T).mean(axis=0) - 1.0
        return np.where(excess > least, excess, 0.0).astype(np.float32)

    each = strength(np.diag(np.diag(moments) ** -0.5)).max(axis=0)
    best = [number for number in np.argsort(-each)[:_MODES] if each[number] > 0.0]
    scores, moments = scores[..., best], moments[np.ix_(best, best)]
    # A direction that is all but a sum of those before it is left to itself.
    basis = np.linalg.inv(np.linalg.cholesky(moments + _ALIKE * np.diag(np.diag(moments))))
    found = strength(basis)
    noisy = np.flatnonzero(found.any(axis=1))
    chosen = [candidates[number] for number in best] if noisy.size else []
    return _Survey(listening, chosen, basis.astype(np.float32), noisy, found[noisy])


def _tiles(size):
    """Pixels of equal parts of a side, and how many parts; of whole blocks, if possible, so a few may be left over."""
    count = -(-size // _TILE)
    side = size // count
    return side - (side % _BLOCK if side > _BLOCK else 0), count


def _most_by_chance(squares, largest):
    """How far above its mean chance puts a weighted sum of squares of normal deviates once in exp(`_PROOF`) times.

    At most, by the weights' squares and the largest weight: Laurent and Massart, "Adaptive estimation of a quadratic
    functional by model selection" (2000), lemma 1.
    """
    return 2.0 * np.sqrt(_PROOF * squares) + 2.0 * _PROOF * largest


def _whole_blocks(pixels):
    """Pixels along one side, rounded up to whole blocks."""
    return max(_BLOCK, pixels + -pixels % _BLOCK)


def _moved(rows, by):
    return slice(rows.start + by, rows.stop + by)


def _noise(planes, inside):
    """What differs from the pixels around, and how much that usually is inside: (..., planes, height, width) both."""
    noise = np.clip(np.nan_to_num(planes), -_BRIGHTEST, _BRIGHTEST)
    noise -= _mean_around(noise)
    inside = inside[..., None, :, :]
    mean_square = _mean_around(np.square(noise) * inside) / np.maximum(_mean_around(inside), _TINY)
    return noise, np.sqrt(np.maximum(mean_square, 0.0))


def _explained(planes, taken, numbers, survey, first):
    """For groups of rows of pixels, which follow each other, the noise in them that the modes explain.

    Parameters
    ----------
    planes, taken
        Some rows of what `without_noise` takes.
    numbers, survey
    first : int
        Which is the first of the rows.
    """
    _, height, width = planes.shape
    columns = np.arange(width)
    group = _whole_blocks(_TOGETHER // width)
    below = waiting = None
    for top in range(0, height + group, group):
        blocks = None
        if top < height:
            rows = slice(top, min(top + group, height))
            # What the noise of these rows depends on.
            seen = slice(max(0, top - 2 * _REACH), rows.stop + 2 * _REACH)
            inside = taken[seen].astype(np.float32)
            own = _moved(rows, -seen.start)
            noise, size = (found[:, own] for found in _noise(planes[survey.noisy, seen], inside))
            place = np.arange(rows.start, rows.stop) + first, columns
            blocks = _Blocks(noise, size, inside[own], place, numbers, survey.modes)
        if waiting:
            yield slice(top - group, min(top, height)), waiting.explained(below, blocks, survey)
        below, waiting = waiting, blocks


class _Blocks:
    """Some rows of blocks: what their pixels say of the modes' slopes.

    Parameters
    ----------
    noise, size : float32 array, shape (..., planes, height, width)
        Of `_noise`.
    inside : float32 array, shape (..., height, width)
        1 of pixels that tell, 0 of others.
    place : (integer array, shape (..., height); integer array, shape (..., width))
        Rows and columns of the picture.
    numbers : callable
        As `without_noise` takes it.
    chosen : sequence of tuple
        Modes.
    """

    def __init__(self, noise, size, inside, place, numbers, chosen):
        self._shape = noise.shape
        inside = _in_blocks(inside[..., None, :, :])
        # Blocks without a pixel that tells are left out of everything that takes time.
        self.some = inside.any(axis=(-2, -1))
        self.inside, self.size = inside[self.some], _in_blocks(size)[self.some]
        *tiles, row, column = np.nonzero(self.some)
        rows, columns = (_in_eights(part)[*tiles, at] for part, at in zip(place, (row, column), strict=True))
        drawn = numbers((rows[:, :, None], columns[:, None, :]), chosen)
        drawn = {name: byte.reshape(*byte.shape[:-2], _BLOCK**2) for name, byte in drawn.items()}
        self.waves = np.moveaxis(modes.waves(chosen, drawn), 0, 1)
        noise = _in_blocks(noise)[self.some]
        limit = _OUTLIER * self.size.mean(axis=-1, keepdims=True)
        noise = np.clip(noise, -limit, limit) * self.inside
        # Sums that make scores, side by side so that they are summed up at once.
        products = noise @ self.waves.swapaxes(-1, -2)
        squares = np.square(noise).sum(axis=-1)
        products = products.reshape(*products.shape[:-2], math.prod(products.shape[-2:]))
        told = np.concatenate([products, squares, self.inside.sum(axis=-1)], axis=-1)
        self.told = np.zeros((*self.some.shape, told.shape[-1]), np.float32)
        self.told[self.some] = told

    def moments(self):
        """Products of the modes, (modes, modes), summed over a part of the pixels, and how many these are."""
        # Block by block: one large product would be taken by threads of the linear algebra library's own, which get in
        # the way of ours.
        inside = self.inside[..., :_TELLING]
        waves = self.waves[..., :_TELLING] * inside
        return (waves @ waves.swapaxes(-1, -2)).sum(axis=0), inside.sum()

    def listen(self, below, above, listening):
        """What the blocks around say of the noise.

        Parameters
        ----------
        below, above : _Blocks or None
            The rows before and after, if there are any.
        listening : _Listening

        Returns
        -------
        score : float32 array, shape (blocks, planes, modes)
            Of blocks with pixels that tell: how the noise goes with each mode.  Of a mode with a mean square of 1 that
            it does not go with, chance makes the score's mean square 1.
        chance : float32 array, shape (blocks, planes)
            The part of the noise's standard deviation that a score of 1 stands for.
        deviation : float32 array, shape (blocks, planes)
            The noise's standard deviation.
        """
        planes = self._shape[-3]
        count = self.waves.shape[-2]
        *tiles, rows, columns = self.some.shape
        around = np.zeros((*tiles, rows + 2 * _NEIGHBOURS, columns + 2 * _NEIGHBOURS, self.told.shape[-1]), np.float32)
        inner = around[..., _NEIGHBOURS:-_NEIGHBOURS, :]
        inner[..., _NEIGHBOURS:-_NEIGHBOURS, :, :] = self.told
        if below:
            inner[:_NEIGHBOURS] = below.told[-_NEIGHBOURS:]
        if above:
            inner[rows + _NEIGHBOURS : rows + _NEIGHBOURS + len(above.told)] = above.told[:_NEIGHBOURS]

        def heard(told, power):
            return (_weighted(told, _NEARNESS**power) - _weighted(told, listening.own**power))[self.some]

        product, square, pixels = np.split(heard(around, 1), np.cumsum((planes * count, planes)), axis=-1)
        # The weights' squares weigh the chances.
        by_chance = np.sqrt(np.maximum(heard(around[..., planes * count : -1], 2), 0.0))
        score = product.reshape(-1, planes, count) / np.maximum(by_chance, _TINY)[..., None]
        # A picture of a single block has nobody to listen to, only what rounding leaves of itself.
        pixels = np.where(pixels > 0.1, pixels, np.float32(np.inf))
        deviation = np.sqrt(np.maximum(square, 0.0) / pixels)
        return score, by_chance / (pixels * np.maximum(deviation, _TINY)), deviation

    def explained(self, below, above, survey):
        """The noise that the modes explain: (planes, rows, width), of pixels.

        Parameters
        ----------
        below, above : _Blocks or None
            As for `listen`.
        survey : _Survey
        """
        _, height, width = self._shape
        score, chance, deviation = self.listen(below, above, survey.listening)
        score @= survey.basis.T
        # How far scores are from chance here, all together, weighed by how much of each is true where all is usual.
        strength = survey.strength
        share = strength / (1.0 + strength)
        excess = (share * (np.square(score) - 1.0)).sum(axis=2, keepdims=True)
        score *= excess > _most_by_chance(np.square(share).sum(axis=1), share.max(axis=1))[:, None]
        here = strength * (np.maximum(excess, 0.0) / np.maximum((share * strength).sum(axis=1), _TINY)[:, None])
        score *= here / (1.0 + here)
        slope = (chance[..., None] * score) @ survey.basis
        size = np.minimum(self.size, deviation[..., None]) * self.inside
        found = np.zeros((*self.some.shape, *size.shape[1:]), np.float32)
        found[self.some] = size * (slope @ self.waves)
        return _from_blocks(found)[:, :height, :width]


def _weighted(around, weights):
    """Sums over the neighbours each way with these weights; `around` has a margin of `_NEIGHBOURS`."""
    for axis in (-3, -2):
        around = np.moveaxis(around, axis, 0)
        count = len(around) - 2 * _NEIGHBOURS
        total = sum(weight * around[shift : shift + count] for shift, weight in enumerate(weights) if weight)
        around = np.moveaxis(total, 0, axis)
    return around


def _mean_around(planes):
    """Mean over the pixels within `_REACH` each way: (..., height, width)."""
    for axis in (-2, -1):
        margin = [(0, 0)] * planes.ndim
        margin[axis] = (_REACH, _REACH)
        one = np.moveaxis(np.pad(planes, margin, mode="edge"), axis, 0)
        # Seven pixels are four, two and one.
        two = one[:-1] + one[1:]
        seven = two[:-5] + two[2:-3]
        seven += two[4:-1]
        seven += one[6:]
        seven /= np.float32(7)
        planes = np.moveaxis(seven, 0, axis)
    return planes


def _in_eights(numbers):
    """(..., length) as (..., blocks, 8); the last number fills the last block."""
    numbers = np.pad(numbers, [(0, 0)] * (numbers.ndim - 1) + [(0, -numbers.shape[-1] % _BLOCK)], mode="edge")
    return numbers.reshape(*numbers.shape[:-1], -1, _BLOCK)


def _in_blocks(planes):
    """(..., planes, height, width) as (..., rows, columns, planes, pixels); zeros fill the last blocks."""
    *others, count, height, width = planes.shape
    if height % _BLOCK or width % _BLOCK:
        margin = [(0, 0)] * len(others) + [(0, 0), (0, -height % _BLOCK), (0, -width % _BLOCK)]
        planes = np.pad(planes, margin)
    blocks = planes.reshape(*others, count, -(-height // _BLOCK), _BLOCK, -1, _BLOCK)
    blocks = np.moveaxis(blocks, (-4, -2, -5), (-5, -4, -3))
    return blocks.reshape(*blocks.shape[:-2], _BLOCK**2)


def _from_blocks(blocks):
    """The reverse of `_in_blocks`, whole blocks."""
    rows, columns, count, _ = blocks.shape
    planes = blocks.reshape(rows, columns, count, _BLOCK, _BLOCK).transpose(2, 0, 3, 1, 4)
    return planes.reshape(count, rows * _BLOCK, columns * _BLOCK)
