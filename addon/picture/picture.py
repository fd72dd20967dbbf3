# SPDX-License-Identifier: GPL-3.0-or-later
"""A picture: the passes of a view layer with what their values are, and how pictures are put together."""

from dataclasses import dataclass, replace

import numpy as np

from ..cycles.passes import LARGEST_SUM, NOISY, Kind, divisor_of
from ..plan.sample_plan import scattered
from . import cryptomatte


@dataclass(frozen=True)
class Picture:
    """Passes of a view layer.

    Attributes
    ----------
    passes : dict
        (pass name, view name) -> float32 array (pixels, channels), rows from the bottom.
    kinds : dict of str to Kind
        By pass name.
    size : (int, int)
        Width and height in pixels.
    parts : pair of float32 array, shape (3, height, width), or None
        The light of the first view that a denoiser takes, by some of each pixel's samples, and by others.
    errors : (float, float) or None
        Mean square errors of what guides the denoiser, and of that light.
    """

    passes: dict
    kinds: dict
    size: tuple[int, int]
    parts: tuple | None = None
    errors: tuple[float, float] | None = None

    def of_kind(self, *kinds):
        """Keys of the passes of some kinds."""
        return [key for key in self.passes if self.kinds[key[0]] in kinds]

    def divisor(self, key):
        """Key of the pass that Cycles has divided this one by, if it was rendered."""
        return divisor_of(key, self.passes, self.kinds)

    @property
    def light_keys(self):
        """Keys of all passes that a filter may spread and a mean may mix as light."""
        return self.of_kind(Kind.COLOUR, Kind.DIVIDED)

    def light_of(self, key):
        """A pass as light, what Cycles divided multiplied again: (channels, height, width)."""
        width, height = self.size
        colour = self.divisor(key)
        light = self.passes[key] * self.passes[colour] if colour else self.passes[key]
        return np.ascontiguousarray(light.T).reshape(-1, height, width)

    @property
    def light(self):
        """All passes of light, one after the other: (channels, height, width)."""
        return np.concatenate([self.light_of(key) for key in self.light_keys])

    def with_light_of(self, lights):
        """The picture with the first channels of some passes replaced: key -> what `light_of` gives."""
        passes = dict(self.passes)
        for key, planes in lights.items():
            passes[key] = passes[key].copy()
            passes[key][:, : len(planes)] = planes.reshape(len(planes), -1).T
        for key in lights:
            if colour := self.divisor(key):
                light, by = passes[key], passes[colour]
                # Below zero where a filter's lobes are: the passes' product is to be the light there, too.
                passes[key] = np.divide(light, by, out=np.zeros_like(light), where=by != 0.0)
        return replace(self, passes=passes)

    def with_light(self, planes):
        """The picture with its light replaced by planes in the form of `light`."""
        keys = self.light_keys
        ends = np.cumsum([self.passes[key].shape[1] for key in keys])
        return self.with_light_of(dict(zip(keys, np.split(planes, ends[:-1]), strict=True)))

    def with_passes(self, passes):
        """The picture with some passes replaced or added, which must have a kind."""
        return replace(self, passes=self.passes | passes)

    def of_samples(self, count):
        """The picture of so many samples, whose sums are no larger than Cycles' can be."""
        most = LARGEST_SUM / np.float32(count)
        return self.with_passes({key: np.minimum(self.passes[key], most) for key in self.of_kind(Kind.MEAN)})

    @property
    def first_view(self):
        """Name of the first view."""
        return next(iter(self.passes))[1]

    @property
    def combined(self):
        """What is seen, (pixels, 4), before any denoiser."""
        view = self.first_view
        return self.passes.get((NOISY, view), self.passes["Combined", view])

    def with_noisy(self):
        """The picture whose Combined holds what Cycles has under the name of the noisy one."""
        return self.with_passes(
            {("Combined", view): pixels for (name, view), pixels in self.passes.items() if name == NOISY}
        )

    def moved(self, film):
        """The picture whose pixel `film[p]` is pixel p of this one, which is empty afterwards, for memory's sake."""
        return replace(self, passes={key: scattered(self.passes.pop(key), film) for key in list(self.passes)})


def mean(before, picture, count):
    """The picture of `count` samples, of which the last one's is `picture`, and the others' mean is `before`."""
    if count == 1:
        return picture
    light = before.light
    return mean_data(before, picture, count).with_light(light + np.float32(1.0 / count) * (picture.light - light))


def mean_data(before, picture, count):
    """As `mean`, but with the light of `before`."""
    share, data = np.float32(1.0 / count), {}
    for key in picture.of_kind(Kind.MEAN, Kind.SAMPLE_COUNT):
        data[key] = before.passes[key] + share * (picture.passes[key] - before.passes[key])
    ranked = {
        key: pixels for key, pixels in picture.passes.items() if cryptomatte.is_ranked(picture.kinds[key[0]], pixels)
    }
    mattes = cryptomatte.mixed(before.passes, ranked, (1.0 - share, share))
    return before.with_passes(data | {key: pixels.astype(np.float32) for key, pixels in mattes.items()})
