# SPDX-License-Identifier: GPL-3.0-or-later
"""How many random samples a pixel are worth one of a tile's (Mitchell 1991, section 7: "three or four")."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from bench.jobs import Settings, images
from bench.metrics import Ratio, Reference, flip, mean_square_error, ratio
from bench.samplers import RANDOM, Sampler
from bench.scene_files import SceneFile

#: The Gaussians of the filtered error, in pixels.
SIGMAS = (1, 2)

#: The paper showed its experts 1 to 9 random samples a pixel.
MOST = 9

#: Seeds of the random images that are averaged, apart from those of measured renders.
FIRST_SEED = 5000


@dataclass(frozen=True)
class Worth:
    """Random samples a pixel that leave the error of one sample of a sampler.

    Attributes
    ----------
    errors : ndarray, shape (seeds, sigmas)
        Mean square errors of the sampler's images.
    same_film : list of Ratio
        At each sigma, with the random sample in the pixel's middle as the sampler's own.
    anywhere : list of Ratio
        At each sigma, with random samples anywhere in the pixel.
    by_flip : Ratio
        By FLIP, against random samples anywhere; infinite if `MOST` are not enough for any of the images.
    """

    errors: np.ndarray
    same_film: list[Ratio]
    anywhere: list[Ratio]
    by_flip: Ratio


class RandomImages:
    """Images of 1 to `MOST` independent random samples a pixel, and their errors.

    Each is a mean of images with one sample anywhere in the pixel, so its mean square error is that of one such image
    over their number.

    Parameters
    ----------
    scene : SceneFile
    settings : Settings
        Size and bounces.
    truth : Reference
        At the same size and bounces.
    """

    def __init__(self, scene: SceneFile, settings: Settings, truth: Reference):
        self.truth = truth
        same_film, anywhere = (images(scene, *wanted) for wanted in random_images(settings))
        self.same_film, self.anywhere = _errors(same_film, truth), _errors(anywhere, truth)
        self.flip = [flip(np.mean(anywhere[:count], axis=0), truth.mean) for count in range(1, MOST + 1)]


def random_images(settings: Settings) -> list[tuple[Settings, range]]:
    """Return settings and seeds of the random samples in the pixels' middles, and anywhere in them."""
    base = RANDOM.settings(replace(settings, samples=1))
    seeds = range(FIRST_SEED, FIRST_SEED + MOST)
    return [(base, seeds), (replace(base, first_sample=1), seeds)]


def worth(scene: SceneFile, settings: Settings, sampler: Sampler, seeds: Sequence[int], random: RandomImages) -> Worth:
    """Return what one sample a pixel of a sampler is worth; arguments as in `RandomImages`."""
    found = images(scene, sampler.settings(replace(settings, samples=1)), seeds)
    errors = _errors(found, random.truth)
    counts = np.array([count_of(flip(image, random.truth.mean), random.flip) for image in found])
    return Worth(
        errors,
        [ratio(random.same_film[:, i], errors[:, i]) for i in range(len(SIGMAS))],
        [ratio(random.anywhere[:, i], errors[:, i]) for i in range(len(SIGMAS))],
        ratio(counts, np.ones_like(counts)) if np.isfinite(counts).all() else Ratio(np.inf, 0.0),
    )


def _errors(found: Sequence[np.ndarray], truth: Reference) -> np.ndarray:
    return np.array([[mean_square_error(image, truth, sigma) for sigma in SIGMAS] for image in found])


def count_of(seen: float, flips: Sequence[float]) -> float:
    """Return where the falling curve of FLIP over the number of random samples passes `seen`."""
    flips = np.minimum.accumulate(flips)
    if seen < flips[-1]:
        return np.inf
    return float(np.interp(-seen, -flips, np.arange(1, len(flips) + 1)))
