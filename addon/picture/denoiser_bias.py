# SPDX-License-Identifier: GPL-3.0-or-later
"""What a denoiser has taken from a picture that was no noise, and is put back.

A denoiser blurs what it takes for noise, and more samples do not help much where it is wrong.  The samples themselves
tell: two pictures of different samples differ from the denoised one alike where it is biased, and each in its own way
where they are noisy.  So of the difference that was taken away, band by band of frequencies, the part comes back that
leaves the least square error: all of it where there is no noise, none of it where there is nothing else (Firmino et
al., "Progressive Denoising of Monte Carlo Rendered Images" (2022), mix noisy and denoised pixels in this way; James
and Stein, "Estimation with Quadratic Loss" (1961)).
"""

import numpy as np

from ..plan.rates import BRIGHTEST, DARKEST, LUMINANCE

# Bands of frequencies, each an octave wide; what is lower is the last one.
_BANDS = 4

# A pixel's surroundings reach as far as smoothing by these multiples of the band's width: with the first four only,
# chance left specks of noise on smooth walls.
_SURROUNDINGS = (1, 2, 4, 8, 16)

# What both parts have in common is believed where it is larger than this times its root mean square: that of a single
# pixel, as of a firefly, and what chance leaves of noise in so many pixels are not.
_DOUBT = np.float32(0.12)

_TINY, _HUGE = np.float32(1e-20), np.float32(1e15)


def reduced(noisy, denoised, parts):
    """Put back what the denoiser has taken that was no noise.

    Parameters
    ----------
    noisy, denoised : float32 array, shape (3, height, width)
        Red, green and blue before and after the denoiser.
    parts : pair of float32 array, each of that shape
        The same light by one part of the samples and by others.

    Returns
    -------
    float32 array, shape (3, height, width)
    """
    clean = _dimmed(denoised)
    taken = _dimmed(noisy) - clean
    # In about the steps that the eye sees.
    scale = np.sqrt(np.maximum(_smooth(_smooth(_luminance(clean), 1), 2), DARKEST))
    # What the picture, and either part, differ by.
    differences = [_luminance(taken) / scale, *(_luminance(_dimmed(part) - clean) / scale for part in parts)]
    del clean, scale
    result = denoised.copy()
    for band in range(_BANDS + 1):
        width = 1 << band
        whole, one, other = differences
        details = taken
        if band < _BANDS:
            differences = [_smooth(plane, width) for plane in differences]
            taken = _smooth(taken, width)
            whole, one, other = (plane - low for plane, low in zip((whole, one, other), differences, strict=True))
            details = details - taken
        power, common = np.square(whole), one * other
        doubt = np.square(common)
        for times in _SURROUNDINGS:
            power, common, doubt = (_smooth(plane, width * times) for plane in (power, common, doubt))
        sure = np.maximum(common / np.maximum(_DOUBT * np.sqrt(doubt), _TINY), np.float32(0)) ** 4
        share = common / np.maximum(power, _TINY) * (sure / (np.float32(1) + sure))
        result += np.clip(share, np.float32(0), np.float32(1)) * details
    return np.maximum(result, np.float32(0), out=result)


def _dimmed(light):
    """Light of the same hue that is not brighter than what a display shows."""
    light = np.nan_to_num(light, posinf=_HUGE, neginf=-_HUGE).clip(-_HUGE, _HUGE)
    return light / np.maximum(np.abs(_luminance(light)) / BRIGHTEST, np.float32(1))


def _luminance(light):
    return np.tensordot(LUMINANCE, light, 1)


def _smooth(planes, step):
    """Smooth by the weights 1/4, 1/2, 1/4 of pixels that are `step` apart; what lies outside is as the edge."""
    for axis in (-1, -2):
        size = planes.shape[axis]
        along = planes.swapaxes(-1, axis)
        reach = min(step, size - 1)
        smooth = np.empty_like(planes)
        sums = smooth.swapaxes(-1, axis)
        sums[..., : size - reach] = along[..., reach:]
        sums[..., size - reach :] = along[..., -1:]
        sums[..., reach:] += along[..., : size - reach]
        sums[..., :reach] += along[..., :1]
        smooth *= np.float32(0.5)
        smooth += planes
        smooth *= np.float32(0.5)
        planes = smooth
    return planes
