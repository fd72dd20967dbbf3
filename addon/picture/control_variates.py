# SPDX-License-Identifier: GPL-3.0-or-later
"""Control variates: noise that Cycles' random numbers explain is subtracted from the picture.

A sample's radiance is a function of its random numbers, and those are known (`cycles.random_numbers`).  Where pixels
around show that radiance rises by b with each unit of a mode f of the numbers (`plan.modes`), b f is the part of a
pixel's noise that this mode has caused.  It is known, and its mean is zero: subtracting it takes noise away and leaves
the expectation alone.  That is a control variate with a coefficient from regression (Hammersley and Handscomb, "Monte
Carlo Methods" (1964), section 5.5; Salaün et al., "Regression-based Monte Carlo Integration" (2022), fit the many
samples of one pixel, here it is a few samples each of many pixels).

Noise of a pixel counts in units of what is usual on its own side of an edge (`surroundings`), red, green and blue
together, and what is subtracted has the colour of that side.

Three things keep the expectation: a pixel's own block has no say in its coefficient, only the blocks around have; nor
has the pixel in what that is scaled by; and modes are waves, as often and as far below zero as above.

Which modes are looked for, and how far a coefficient is believed, patches of the picture say beforehand: by how much
coefficients of that mode differ from zero on average, beyond chance (empirical Bayes; Efron and Morris, "Stein's
Estimation Rule and Its Competitors" (1973)).
"""

import concurrent.futures
import os
from dataclasses import dataclass

import numpy as np

from ..plan import arranged_plan, modes
from . import noise_blocks
from .surroundings import Surroundings, opaque

# Modes that may explain something, of how many that are looked at, and how many of them are used.  And samples a pixel
# beyond which what is left to explain is not worth the time.
_CANDIDATES, _CONSIDERED, _MODES = 24, 48, 8
MOST_SAMPLES = 16

# Pixels that are worked at together, which take some 100 bytes each.
_TOGETHER = 2**18

# Pixels a side of the patches that tell which modes matter in the picture, and how many of them.
_PATCH, _PATCHES = 64, 6

# Pixels of each block of a patch that tell what modes have in common.
_TELLING = 16

# Evidence counts that chance makes once in exp of this many times: that of a mode in the picture, and that of all modes
# together in the blocks around.
_PROOF = 10.0

# Part of a mode's mean square that others are not to explain, so that numbers stay small.
_ALIKE = 1e-3

_TINY = np.float32(1e-20)


def of_picture(use, plan, region, sequence):
    """What takes the explained noise out of a picture.

    Parameters
    ----------
    use : SceneUse
    plan : Plan
        By which it was rendered.
    region : Region
    sequence : int
        Samples a pixel of Cycles' whole sequence.

    Returns
    -------
    callable or None
        A picture (`Picture`, of one view), first sample, number of samples -> picture.  None if nothing is left to
        chance.
    """
    sources = tuple(arranged_plan.shares(use))
    if not sources:
        return None

    ranks = plan.ranks_at_film(region)

    def cleaned(picture, first, samples):
        def numbers(pixels, chosen):
            return arranged_plan.numbers(chosen, ranks[pixels], samples, sequence, first)

        keys = picture.radiance_keys
        lights = [picture.light_of(key)[:3] for key in keys]
        candidates = list(arranged_plan.error_modes(sources, samples, _CANDIDATES, _CONSIDERED))
        found = without_noise(lights, picture.opacity, numbers, candidates)
        return picture.with_light_of(
            {key: new for key, old, new in zip(keys, lights, found, strict=True) if new is not old}
        )

    return cleaned


def without_noise(lights, opacity, numbers, candidates):
    """Take out the noise that modes of the random numbers explain.

    Where the film is seen through nothing is done: there opacity is left to chance, too, and is not to leave its range.

    Parameters
    ----------
    lights : list of float32 array, shape (3, height, width)
        Red, green and blue of each pass, the mean of one or several samples.
    opacity : float32 array, shape (height, width), or None
        Of the film; None if it is opaque.
    numbers : callable
        Pixels of the picture (rows and columns, index arrays that broadcast together), modes -> dict of dimension to
        uint8 array, shape (samples, ...): leading bytes of the samples' random numbers
        (`random_numbers.leading_bytes`), of the dimensions that the modes depend on.
    candidates : sequence of tuple
        Modes that may explain something, as in `modes.variances`.

    Returns
    -------
    list of float32 array
        Of the same shapes; passes of which nothing is explained are the same arrays.
    """
    if not lights or not lights[0].size:
        return lights
    judged = None if opacity is None or (opacity >= 1.0).all() else opaque(opacity)
    survey = _survey(lights, judged, numbers, candidates)
    if survey is None:
        return lights
    _, height, width = lights[0].shape
    result = list(lights)
    for number in survey.noisy:
        result[number] = lights[number].copy()
    # Whole blocks, and around them those that they listen to and what their pixels depend on.
    margin = (noise_blocks.REACH + 1) * noise_blocks.SIDE
    processors = os.process_cpu_count() or 1
    rows = max(_TOGETHER // width, margin)
    rows += -rows % noise_blocks.SIDE

    def clean(top):
        seen = slice(max(0, top - margin), min(height, top + rows + margin))
        own = slice(top, min(top + rows, height))
        inner = slice(own.start - seen.start, own.stop - seen.start)
        around = [Surroundings(lights[number][:, seen], _part(judged, seen)) for number in survey.noisy]
        explained = _explained(around, _waves(numbers, survey.modes, (seen.start, 0), around[0].noise.shape), survey)
        for number, pixels, found in zip(survey.noisy, explained, around, strict=True):
            result[number][:, own] -= found.coloured(pixels)[:, inner]

    with concurrent.futures.ThreadPoolExecutor(processors) as threads:
        list(threads.map(clean, range(0, height, rows)))
    return result


@dataclass(frozen=True)
class _Survey:
    """What explains noise in a picture.

    Attributes
    ----------
    modes : list of tuple
    basis : float32 array, shape (directions, modes)
        Sums of modes that do not go together: several samples of a pixel depend on each other, and so do their modes.
        Their mean square is 1.
    noisy : integer array
        Passes of which something is explained.
    strength : float32 array, shape (noisy passes, directions)
        By how much the squares of their scores (`noise_blocks.scores`) exceed chance on average; 0 if not by enough.
    """

    modes: list[tuple]
    basis: np.ndarray
    noisy: np.ndarray
    strength: np.ndarray


def _survey(lights, judged, numbers, candidates):
    """Find out in some patches of the picture what explains most; None if nothing does."""
    _, height, width = lights[0].shape
    corners = [(y, x) for y in _starts(height) for x in _starts(width)]
    if len(corners) > _PATCHES:
        corners = [corners[number] for number in np.random.default_rng(0).permutation(len(corners))[:_PATCHES]]
    moments, pixels, scores = 0.0, 0, []
    for y, x in corners:
        part = slice(y, min(y + _PATCH, height)), slice(x, min(x + _PATCH, width))
        around = [Surroundings(light[:, *part], _part(judged, part)) for light in lights]
        waves = _waves(numbers, candidates, (y, x), around[0].noise.shape)
        noise = noise_blocks.in_blocks(np.stack([found.noise for found in around]))
        scores.append(noise_blocks.scores(noise, waves)[0].reshape(-1, len(lights), len(candidates)))
        # Block by block: one large product would be taken by threads of the linear algebra library's own.
        telling = waves[..., :_TELLING]
        moments = moments + (telling @ telling.swapaxes(-1, -2)).sum(axis=(0, 1))
        pixels += telling.size // len(candidates)
    moments, scores = moments / pixels, np.concatenate(scores)
    if not moments.diagonal().all():
        return None
    weight = noise_blocks.HEARD / len(scores)
    least = _most_by_chance(weight, weight)

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
    if not noisy.size:
        return None
    return _Survey([candidates[number] for number in best], basis.astype(np.float32), noisy, found[noisy])


def _part(judged, part):
    return None if judged is None else judged[part]


def _starts(size):
    """Where patches begin along a side; what is left of the last one is none, unless it is the first, too."""
    return range(0, max(size - _PATCH, 0) + 1, _PATCH)


def _most_by_chance(squares, largest):
    """How far above its mean chance puts a weighted sum of squares of normal deviates once in exp(`_PROOF`) times.

    At most, by the weights' squares and the largest weight: Laurent and Massart, "Adaptive estimation of a quadratic
    functional by model selection" (2000), lemma 1.
    """
    return 2.0 * np.sqrt(_PROOF * squares) + 2.0 * _PROOF * largest


def _waves(numbers, chosen, corner, shape):
    """Modes at the pixels of a part of the picture: (rows, columns, modes, pixels) of blocks."""
    y, x = (noise_blocks.places(*part) for part in zip(corner, shape, strict=True))
    drawn = numbers((y[:, None, :, None], x[None, :, None, :]), chosen)
    drawn = {name: byte.reshape(*byte.shape[:-2], noise_blocks.SIDE**2) for name, byte in drawn.items()}
    return np.ascontiguousarray(np.moveaxis(modes.waves(chosen, drawn), 0, 2))


def _explained(around, waves, survey):
    """The noise that modes explain, in units of its usual size: (passes, height, width)."""
    noise = noise_blocks.in_blocks(np.stack([found.noise for found in around]))
    score, unit = noise_blocks.scores(noise, waves)
    score = score @ survey.basis.T
    # How far scores are from chance here, all together, weighed by how much of each is true where all is usual.
    strength = survey.strength
    share = strength / (1.0 + strength)
    excess = (share * (np.square(score) - 1.0)).sum(axis=-1, keepdims=True)
    score *= excess > _most_by_chance(np.square(share).sum(axis=1), share.max(axis=1))[:, None]
    here = strength * (np.maximum(excess, 0.0) / np.maximum((share * strength).sum(axis=1), _TINY)[:, None])
    score *= here / (1.0 + here)
    slope = (unit[..., None] * score) @ survey.basis
    return noise_blocks.from_blocks(slope @ waves, *around[0].noise.shape)
