# SPDX-License-Identifier: GPL-3.0-or-later
"""True reconstruction: every sample weighs in on all pixels that the filter spreads it over.

Cycles itself moves each sample by a random offset drawn from the filter and averages what falls on a pixel, so a sample
serves one pixel only.  Here positions are uniform, a sample is shared by all pixels around it, and the noise, which a
plan makes blue, passes through the filter's low-pass (Mitchell 1991, section 3 and figure 2).
"""

import concurrent.futures
import itertools

import numpy as np

from ..cycles.exposure import blackman_harris

# Rows that are filtered at a time: a few planes of them fit into a processor's cache.
_STRIP = 32


def _mitchell_netravali(b, c):
    """Mitchell and Netravali, "Reconstruction Filters in Computer Graphics" (1988), equation 8; 4 pixels at width 4."""

    def weight(x, half):
        x = np.abs(2.0 * x / half)
        near = (12.0 - 9.0 * b - 6.0 * c) * x**3 + (-18.0 + 12.0 * b + 6.0 * c) * x**2 + (6.0 - 2.0 * b)
        far = (-b - 6.0 * c) * x**3 + (6.0 * b + 30.0 * c) * x**2 + (-12.0 * b - 48.0 * c) * x + (8.0 * b + 24.0 * c)
        return np.where(x < 1.0, near, far)

    return weight


# Weights at distances x, up to half the filter's width.
_FILTERS = {
    "BOX": lambda x, half: np.ones_like(x),
    "TENT": lambda x, half: 1.0 - np.abs(x) / half,
    # Cut at three standard deviations; Cycles' own Gaussian is twice as wide for the same deviation, most of it zero.
    "GAUSSIAN": lambda x, half: np.exp(-4.5 * (x / half) ** 2),
    "BLACKMAN_HARRIS": blackman_harris,
    # As many lobes as the filter's radius has pixels.
    "LANCZOS": lambda x, half: np.sinc(x) * np.sinc(x / half),
}

# Full width in pixels that each filter is known by.
CUSTOMARY_WIDTHS = {
    "BOX": 1.0,
    "TENT": 2.0,
    "GAUSSIAN": 3.0,
    "BLACKMAN_HARRIS": 3.0,
    "MITCHELL_NETRAVALI": 4.0,
    "LANCZOS": 6.0,
}


class Filter:
    """A separable filter of unit weight.

    Parameters
    ----------
    kind : str
        A key of `CUSTOMARY_WIDTHS`.
    width : float
        Full width in pixels.
    b, c : float
        Of the Mitchell-Netravali filter.
    """

    def __init__(self, kind, width, b=1 / 3, c=1 / 3):
        self._half = width / 2.0
        self._shape = _mitchell_netravali(b, c) if kind == "MITCHELL_NETRAVALI" else _FILTERS[kind]
        self._scale = 1.0
        steps = (np.arange(4096) + 0.5) / 4096.0
        self._scale = 1.0 / (width * float(self(width * (steps - 0.5)).mean()))
        self.negative = bool((self(width * (steps - 0.5)) < -1e-6).any())
        # Pixels that a sample reaches beyond its own, to each side.
        self.reach = int(np.ceil(self._half + 0.5)) - 1

    def __call__(self, x):
        """Weight at a distance of x pixels along one axis."""
        return np.where(np.abs(x) < self._half, self._scale * self._shape(x, self._half), 0.0).astype(np.float32)


# Steps of the R2 sequence (Roberts 2018) from sample to sample, and from pixel to pixel, in 65,536ths.
_STEPS = np.array((49471, 37345), np.uint16)
_HALF, _GOLDEN = np.uint16(32768), np.uint16(40503)


def first_position(sample, seed):
    """Where in its pixel the n-th sample of the first pixel lies, x and y as of `positions`: uint16 array."""
    return np.random.default_rng(seed).integers(0, 65536, 2, np.uint16) + np.uint16(sample) * _STEPS


def positions(region, sample, seed):
    """Where in its pixel the n-th sample of every pixel lies; `camera.osl` knows them by the `first_position`.

    Neighbours keep well apart, by half a pixel one way and the golden ratio the other way, so that what falls into any
    filter is nearly the same amount everywhere; further samples follow the R2 sequence.  The start is uniform, so that
    the expectation is the filtered picture's.

    Parameters
    ----------
    region : Region
    sample : int
        n.
    seed : int

    Returns
    -------
    uint16 array, shape (2, height, width)
        x and y: q stands for (q + 1/2) / 65536 of a pixel.
    """
    width, height = region.size
    x, y = first_position(sample, seed)
    column, row = np.arange(width, dtype=np.uint16), np.arange(height, dtype=np.uint16)[:, None]
    return np.stack([x + _HALF * column + _GOLDEN * row, y + _GOLDEN * column + _HALF * row])


class Reconstruction:
    """Sums of samples weighted by a `Filter`, becoming pixels."""

    def __init__(self, chosen, channels, height, width):
        self._filter = chosen
        self._samples = 0
        # The last plane is the sum of the weights.
        self._sums = np.zeros((channels + 1, height, width), np.float32)
        self._positive = np.zeros_like(self._sums) if chosen.negative else self._sums

    def add(self, radiance, where):
        """Add one sample of every pixel.

        Parameters
        ----------
        radiance : float32 array, shape (channels, height, width)
        where : uint16 array, shape (2, height, width)
            Of `positions`.
        """
        self._samples += 1
        height = radiance.shape[1]
        strips = [slice(top, min(top + _STRIP, height)) for top in range(0, height, _STRIP)]
        with concurrent.futures.ThreadPoolExecutor() as threads:
            list(threads.map(lambda rows: self._add_to(rows, radiance, where), strips))

    def _add_to(self, rows, radiance, where):
        """Add what the samples around a strip of pixels give to it."""
        reach = self._filter.reach
        _, height, width = radiance.shape
        first, last = max(rows.start - reach, 0), min(rows.stop + reach, height)
        shifts = range(-reach, reach + 1)
        x, y = (where[:, first:last] + np.float32(0.5)) / np.float32(65536.0)
        along_x = {shift: self._filter(shift + np.float32(0.5) - x) for shift in shifts}
        along_y = {shift: self._filter(shift + np.float32(0.5) - y) for shift in shifts}
        for up, right in itertools.product(shifts, shifts):
            # A sample of pixel (y, x) gives to pixel (y + up, x + right).
            bottom, top = max(rows.start, up), min(rows.stop, height + up)
            left, stop = max(0, right), min(width, width + right)
            if bottom >= top or left >= stop:
                continue
            source = slice(bottom - up, top - up), slice(left - right, stop - right)
            inner = slice(source[0].start - first, source[0].stop - first), source[1]
            weight = along_y[up][inner] * along_x[right][inner]
            targets = [(self._sums, weight)]
            if self._filter.negative:
                targets.append((self._positive, np.abs(weight)))
            for sums, part in targets:
                here = sums[:, bottom:top, left:stop]
                here[:-1] += part * radiance[(slice(None), *source)]
                here[-1] += part

    def pixels(self):
        """The picture, (channels, height, width).

        Dividing by the sum of the weights keeps a constant picture constant, up to the border.  Where lobes are
        negative that sum can come close to zero; there what is missing to 1 for each sample is filled with the mean by
        the weights' sizes.
        """
        mean = self._positive[:-1] / np.maximum(self._positive[-1], 1e-20)
        if not self._filter.negative:
            return mean
        whole = self._sums / np.float32(self._samples)
        return whole[:-1] + (1.0 - whole[-1]) * mean
