# SPDX-License-Identifier: GPL-3.0-or-later
"""A picture that grows: sums of all passes over samples whose number differs from pixel to pixel."""

import numpy as np

from ..cycles.passes import GUIDES, LARGEST_SUM, Kind, divisor_of
from ..plan.rates import visible_variance
from . import cryptomatte
from .picture import Picture


class Accumulation:
    """Sums of passes.

    Parameters
    ----------
    size : (int, int)
        Width and height in pixels.
    kinds : dict of str to Kind
        By pass name.
    light : str
        Name of the pass whose noise is judged.

    Attributes
    ----------
    half : float32 array, shape (height, width, channels), or None
        Mean of about the first half of each pixel's samples, or of those that were replaced, in the first view of the
        light; where a pixel was rendered more than once.
    counts : float32 array, shape (height, width, 1)
        Samples of each pixel.
    """

    def __init__(self, size, kinds, light):
        self.size, self.kinds, self._light = size, kinds, light
        self.half = None
        self.counts = np.zeros((*size[::-1], 1), np.float32)
        # Samples of the half that are in the sums; below 0 where there is no half.
        self._held = np.full_like(self.counts, -1.0)
        # Square error of what guides the denoiser, where there is a half; None if nothing does.
        self._guides_error = None if kinds.keys().isdisjoint(GUIDES) else np.zeros_like(self.counts)
        self._sums = {}

    def add(self, part, passes, first, count):
        """Add samples of a rectangle, or put them in place of those that it has if they are a sequence's first.

        Parameters
        ----------
        part : (slice, slice)
            Its rows and columns.
        passes : dict
            (pass name, view name) -> float32 array (height, width, channels): means over these samples.
        first, count : int
            First sample, and how many.
        """
        if self._sums and count >= first:
            if self.half is None:
                self.half = np.zeros_like(self._light_sums)
            self.half[part] = self._light_sums[part] / self.counts[part]
            self._held[part] = first
            if self._guides_error is not None:
                self._guides_error[part] = self._error_of_guides(part, passes, first, count)
        ranked = {}
        for key, pixels in passes.items():
            if key not in self._sums:
                self._sums[key] = np.zeros((*self.size[::-1], pixels.shape[2]), np.float32)
            sums, kind = self._sums[key], self.kinds[key[0]]
            if cryptomatte.is_ranked(kind, pixels):
                ranked[key] = pixels
            elif kind in {Kind.FIRST_SAMPLE, Kind.CRYPTOMATTE}:
                if first == 0:
                    sums[part] = pixels
            else:
                if first == 0:
                    sums[part] = 0.0
                by = divisor_of(key, passes, self.kinds)
                light = pixels * passes[by] if by else pixels
                with np.errstate(over="ignore"):
                    sums[part] += np.float32(count) * light
                if kind is Kind.MEAN:
                    np.minimum(sums[part], LARGEST_SUM, out=sums[part])
        if first > 0:
            before = {key: self._sums[key][part] for key in ranked}
            ranked = cryptomatte.mixed(before, ranked, np.array((first, count)) / (first + count))
        for key, pixels in ranked.items():
            self._sums[key][part] = pixels
        self.counts[part] = first + count

    def _error_of_guides(self, part, passes, first, count):
        """Square error of the guides' means with these samples, as those and the ones before differ."""
        before = self.counts[part]
        guides = [key for key in passes if key[0] in GUIDES]
        squares = sum(np.square(self._sums[key][part] / before - passes[key]).sum(2, keepdims=True) for key in guides)
        return squares * before * count / (before + count) / (first + count)

    @property
    def _light_sums(self):
        return next(sums for (name, _), sums in self._sums.items() if name == self._light)

    @property
    def mean(self):
        """Mean of the light in the first view, (height, width, channels)."""
        return self._light_sums / self.counts

    @property
    def _is_in_parts(self):
        return (self._held >= 0.0).all()

    @property
    def parts(self):
        """The light's red, green and blue by some of each pixel's samples, and by others: (3, height, width) each.

        None unless every pixel was rendered in parts.
        """
        if not self._is_in_parts:
            return None
        sums, held = self._light_sums[..., :3], self._held
        others = (sums - held * self.half[..., :3]) / (self.counts - held)
        return tuple(np.ascontiguousarray(light.transpose(2, 0, 1)) for light in (self.half[..., :3], others))

    @property
    def errors(self):
        """Mean square errors of what guides the denoiser, and of the light (`rates.visible_variance`).

        None unless every pixel was rendered in parts, and something guides the denoiser.
        """
        if not self._is_in_parts or self._guides_error is None:
            return None
        light = visible_variance(self.mean[..., :3], self.half[..., :3])
        return float(self._guides_error.mean()), float(light.mean())

    def picture(self, has_parts=False):
        """All samples together, as a `Picture`; the sums become its pixels, so nothing more can be added.

        Parameters
        ----------
        has_parts : bool
            Whether the picture is to hold `parts` and `errors`.
        """
        parts, errors = (self.parts, self.errors) if has_parts else (None, None)
        # Those that are divided by a colour come first: both are sums over the same samples.
        for key, sums in self._sums.items():
            if by := divisor_of(key, self._sums, self.kinds):
                colour = self._sums[by]
                np.divide(sums, colour, out=sums, where=colour != 0.0)
                sums[colour == 0.0] = 0.0
        for key, sums in self._sums.items():
            kind = self.kinds[key[0]]
            if kind is Kind.SAMPLE_COUNT:
                sums[...] = self.counts / self.counts.max()
            elif kind not in {Kind.FIRST_SAMPLE, Kind.CRYPTOMATTE} and not divisor_of(key, self._sums, self.kinds):
                sums /= self.counts
        passes = {key: pixels.reshape(-1, pixels.shape[2]) for key, pixels in self._sums.items()}
        return Picture(passes, self.kinds, self.size, parts, errors)
