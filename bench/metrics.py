# SPDX-License-Identifier: GPL-3.0-or-later
"""Error figures of images against a converged reference."""

from dataclasses import dataclass

import flip_evaluator
import numpy as np
from scipy.ndimage import gaussian_filter

#: Widths in pixels of the Gaussians that stand for the eye's low-pass, 0 for none.
SIGMAS = (0, 1, 2)

#: Rec. 709 weights: the luminance of Blender's linear RGB.
LUMINANCE = np.array((0.2126, 0.7152, 0.0722), np.float32)

#: The two ways a difference in RGB becomes one number a pixel.
MEASURES = ("luminance", "RGB")


@dataclass(frozen=True)
class Reference:
    """Two independent, nearly converged images of the same scene, shape (height, width, 3).

    Their mean is the best estimate of the truth; their difference tells how good it is.
    """

    first: np.ndarray
    second: np.ndarray

    @property
    def mean(self) -> np.ndarray:
        """The best estimate of the truth."""
        return (self.first + self.second) / 2

    def noise(self, sigma: float, measure: str = "luminance") -> float:
        """Return the mean square error of the two halves' mean."""
        # The mean of two has half the variance of one, their difference twice.
        difference = _filtered(self.first - self.second, sigma, measure)
        return _mean_product(difference, difference) / 4


def mean_square_error(image: np.ndarray, reference: Reference, sigma: float, measure: str = "luminance") -> float:
    """Return the mean square error of a filtered image.

    The product of the errors against the two halves of the reference is averaged, not the square of one: the halves'
    noises are independent and average out, so that the result is unbiased however noisy the reference is.

    Parameters
    ----------
    image : ndarray
        Linear RGB, shape (height, width, 3).
    reference : Reference
        The converged halves.
    sigma : float
        Width of the Gaussian in pixels, 0 for none.
    measure : str
        ``"luminance"`` (Rec. 709 of linear RGB) or ``"RGB"`` (mean of the three channels' squares).
    """
    return _mean_product(
        _filtered(image - reference.first, sigma, measure), _filtered(image - reference.second, sigma, measure)
    )


def flip(image: np.ndarray, reference: np.ndarray) -> float:
    """Return the mean of FLIP (Andersson et al. 2020), the difference that a viewer of both pictures in turn sees.

    Parameters
    ----------
    image, reference : ndarray
        Linear RGB, shape (height, width, 3), shown without a tone curve at 67 pixels a degree.
    """
    shown = [np.clip(picture, 0, 1).astype(np.float32) for picture in (reference, image)]
    return float(flip_evaluator.evaluate(*shown, "LDR", inputsRGB=False, applyMagma=False)[1])


def _filtered(difference: np.ndarray, sigma: float, measure: str) -> np.ndarray:
    """Return the low-passed difference, in float64, shape (height, width, channels)."""
    if measure not in MEASURES:
        raise ValueError(f"no measure {measure!r}")
    difference = difference.astype(np.float64)
    if measure == "luminance":
        difference = (difference @ LUMINANCE)[..., None]
    return gaussian_filter(difference, (sigma, sigma, 0)) if sigma else difference


def _mean_product(one: np.ndarray, other: np.ndarray) -> float:
    return float(np.mean(one * other))


@dataclass(frozen=True)
class Ratio:
    """Mean error of one engine over another's, from several seeds.

    Attributes
    ----------
    value : float
        Ratio of the means over seeds.
    spread : float
        Standard error of `value`, 0 with a single seed.
    """

    value: float
    spread: float

    def __str__(self) -> str:
        return f"{self.value:.3f}±{self.spread:.3f}"


def ratio(ours: np.ndarray, theirs: np.ndarray) -> Ratio:
    """Return the ratio of two sets of errors, one value a seed, the seeds being independent."""
    ours, theirs = np.asarray(ours, float), np.asarray(theirs, float)
    value = ours.mean() / theirs.mean()
    if min(len(ours), len(theirs)) < 2:
        return Ratio(float(value), 0.0)
    # First-order propagation of the two means' standard errors.
    relative = [np.var(errors, ddof=1) / len(errors) / errors.mean() ** 2 for errors in (ours, theirs)]
    return Ratio(float(value), float(value * np.sqrt(sum(relative))))
