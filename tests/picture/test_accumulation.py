# SPDX-License-Identifier: GPL-3.0-or-later
"""A picture that grows keeps two parts of different samples."""

import numpy as np
import pytest

from addon.cycles.passes import Kind
from addon.picture.accumulation import Accumulation

EVERYTHING = slice(0, 2), slice(0, 3)
LEFT, RIGHT = (slice(0, 2), slice(0, 1)), (slice(0, 2), slice(2, 3))


def light(value, width):
    return {("Combined", ""): np.full((2, width, 4), value, np.float32)}


def grown(*shots):
    sums = Accumulation((3, 2), {"Combined": Kind.COLOUR}, "Combined")
    for part, value, first, count in shots:
        sums.add(part, light(value, part[1].stop - part[1].start), first, count)
    return sums


def test_parts_are_those_that_go_on_those_that_begin_anew_and_halves():
    sums = grown(
        (EVERYTHING, 1.0, 0, 8), (EVERYTHING, 3.0, 8, 8), (LEFT, 6.0, 16, 48), (RIGHT, 5.0, 0, 128)
    )  # fmt: skip
    some, others = sums.parts
    # 16 of mean 2 and 48 of mean 6; halves of 8; 16 of mean 2 that are replaced by 128.
    np.testing.assert_allclose(some[0], [[2.0, 1.0, 2.0]] * 2)
    np.testing.assert_allclose(others[0], [[6.0, 3.0, 5.0]] * 2)
    np.testing.assert_allclose(sums.picture().passes["Combined", ""][:3, 0], [5.0, 2.0, 5.0])


def test_a_few_more_samples_are_no_part_of_their_own():
    some, others = grown((EVERYTHING, 1.0, 0, 16), (EVERYTHING, 2.0, 16, 16), (LEFT, 4.0, 32, 8)).parts
    assert some[0, 0, 0] == pytest.approx(1.0) and others[0, 0, 0] == pytest.approx((2.0 * 16 + 4.0 * 8) / 24)


def test_errors_are_those_of_the_means():
    """Of samples that differ by chance, however they were taken: at once, going on or anew."""
    rng = np.random.default_rng(1)
    deviation, guide = 0.5, "Denoising Normal"
    everything, left = (slice(0, 64), slice(0, 64)), (slice(0, 64), slice(0, 32))
    sums = Accumulation((64, 64), {"Combined": Kind.COLOUR, guide: Kind.COLOUR}, "Combined")
    found = []
    for part, first, count in ((everything, 0, 8), (everything, 8, 8), (left, 16, 16), (left, 0, 64)):
        shape = (64, part[1].stop, 3)
        noise = rng.normal(0.0, deviation / np.sqrt(count), shape).astype(np.float32)
        sums.add(part, {("Combined", ""): 1.0 + noise[:, :, :1].repeat(4, 2), (guide, ""): noise}, first, count)
        found.append(sums.errors)
    assert found[0] is None
    for (guides, light), samples in zip(found[1:], (16, 32, 64), strict=True):
        error = deviation**2 * (1 / 16 + 1 / samples) / 2
        assert guides == pytest.approx(3 * error, rel=0.1)
        # Of luminance 1 about; of samples that are taken anew it is overrated.
        assert samples == 64 or light == pytest.approx(error, rel=0.1)


@pytest.mark.parametrize(
    "shots",
    [
        [(EVERYTHING, 1.0, 0, 64)],
        [(EVERYTHING, 1.0, 0, 32), (LEFT, 1.0, 32, 32)],
    ],
    ids=["at once", "some pixels at once"],
)
def test_there_are_no_parts(shots):
    assert grown(*shots).parts is None


def test_cryptomattes_are_ranked_by_all_samples():
    name = "CryptoObject00"
    sums = Accumulation((2, 1), {"Combined": Kind.COLOUR, name: Kind.CRYPTOMATTE}, "Combined")
    whole, left = (slice(0, 1), slice(0, 2)), (slice(0, 1), slice(0, 1))
    for part, first, count, ranks in (
        (whole, 0, 4, (7.0, 0.75, 5.0, 0.25)),
        (whole, 4, 4, (5.0, 1.0, 0.0, 0.0)),
        (left, 0, 16, (9.0, 1.0, 0.0, 0.0)),
    ):
        width = part[1].stop
        passes = {("Combined", ""): np.ones((1, width, 4), np.float32)}
        passes[name, ""] = np.tile(np.array(ranks, np.float32), (1, width, 1))
        sums.add(part, passes, first, count)
    found = sums.picture().passes[name, ""]
    np.testing.assert_allclose(found, [[9.0, 1.0, 0.0, 0.0], [5.0, 0.625, 7.0, 0.375]])
