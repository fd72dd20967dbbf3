# SPDX-License-Identifier: GPL-3.0-or-later
"""Negative pixels are evened out, and light neither comes nor goes."""

import numpy as np
import pytest

from addon.picture.nonnegative import nonnegative


def test_nothing_happens_without_negative_pixels():
    picture = np.random.default_rng(0).random((3, 20, 30), np.float32)
    assert nonnegative(picture) is picture


@pytest.mark.parametrize("spread", [0.5, 1.5])
def test_the_mean_stays(spread):
    rng = np.random.default_rng(1)
    picture = (1.0 + spread * rng.normal(size=(3, 90, 120))).astype(np.float32)
    left = nonnegative(picture)
    assert left.min() >= 0.0
    assert left.mean() == pytest.approx(picture.mean(), rel=0.03)
    assert np.maximum(picture, 0.0).mean() > left.mean()


def test_other_parts_stay_as_they_are():
    picture = np.ones((3, 20, 20), np.float32)
    picture[:, 5, 5] = -3.0
    left = nonnegative(picture)
    np.testing.assert_allclose(left[:, 10:, :], 1.0, rtol=1e-6)
    np.testing.assert_allclose(left[:, :, 10:], 1.0, rtol=1e-6)
    assert left.min() == 0.0


def test_what_is_negative_all_over_becomes_black():
    with np.errstate(all="raise"):
        assert not nonnegative(np.full((3, 9, 9), -1.0, np.float32)).any()
