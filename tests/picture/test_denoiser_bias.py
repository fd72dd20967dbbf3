# SPDX-License-Identifier: GPL-3.0-or-later
"""What a denoiser took comes back where samples agree on it, and noise does not."""

import numpy as np
import pytest

from addon.picture.denoiser_bias import reduced

SHAPE = 120, 160


def stripes(amount=0.3):
    """A grey picture with a texture, and the same blurred to plain grey."""
    x = np.arange(SHAPE[1])
    texture = 0.5 + amount * np.sin(2.0 * np.pi * x / 8.0)
    return np.broadcast_to(texture, (3, *SHAPE)).astype(np.float32), np.full((3, *SHAPE), 0.5, np.float32)


def noisy_parts(truth, deviation, seed):
    """The mean of two halves of samples, whose deviation in each pixel is told, and these."""
    rng = np.random.default_rng(seed)
    parts = [(truth + np.sqrt(2.0) * deviation * rng.normal(size=SHAPE)).astype(np.float32) for _ in range(2)]
    return sum(parts) / np.float32(2), parts


def square_error(picture, truth):
    return float(np.mean(np.square(picture - truth)))


def test_what_has_no_noise_comes_back():
    truth, blurred = stripes()
    found = reduced(truth, blurred, (truth, truth))
    assert square_error(found, truth) < 0.03 * square_error(blurred, truth)


@pytest.mark.parametrize("seed", range(8))
def test_noise_stays_away(seed):
    """Of noise that hides nothing so little comes back that it is not seen: a hundredth of its square error."""
    _, truth = stripes()
    noisy, parts = noisy_parts(truth, 0.1, seed)
    assert square_error(reduced(noisy, truth, parts), truth) < 0.01 * square_error(noisy, truth)


@pytest.mark.parametrize("deviation", [0.03, 0.1, 0.2])
def test_it_is_better_than_either(deviation):
    truth, blurred = stripes(0.14)
    noisy, parts = noisy_parts(truth, deviation, 1)
    found = square_error(reduced(noisy, blurred, parts), truth)
    assert found < 0.9 * min(square_error(noisy, truth), square_error(blurred, truth))


@pytest.mark.parametrize("where", [0, 1])
def test_a_firefly_stays_away(where):
    """Whichever samples have it, no pixel turns brighter by a hundredth."""
    _, truth = stripes()
    _, parts = noisy_parts(truth, 0.01, 2)
    parts[where][:, 60, 80] = 1e4
    found = reduced(sum(parts) / np.float32(2), truth, parts)
    assert np.abs(found - truth).max() < 0.01


def test_colours_keep_their_hue():
    truth, blurred = stripes(0.1)
    tint = np.array((1.0, 0.5, 0.1), np.float32)[:, None, None]
    noisy, parts = noisy_parts(truth, 0.02, 3)
    found = reduced(noisy * tint, blurred * tint, [part * tint for part in parts])
    np.testing.assert_allclose(found / tint, np.broadcast_to(found[:1], found.shape), rtol=1e-4)


@pytest.mark.parametrize("size", [(1, 1), (1, 7), (5, 2)])
@pytest.mark.parametrize("value", [0.0, 1.0, 1e30, np.nan, np.inf, -np.inf])
def test_odd_pictures_stay_finite(size, value):
    with np.errstate(over="ignore", invalid="raise"):
        clean = np.full((3, *size), 0.5, np.float32)
        noisy = clean.copy()
        noisy[:, 0, 0] = value
        found = reduced(noisy, clean, (noisy, noisy))
    assert np.isfinite(found).all()
    assert found.min() >= 0.0
