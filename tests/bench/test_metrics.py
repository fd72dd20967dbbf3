# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np
import pytest

from bench.metrics import Reference, mean_square_error, ratio

SHAPE = (128, 128, 3)


@pytest.fixture
def chance():
    return np.random.default_rng(1)


@pytest.mark.parametrize("sigma", [0, 1, 2])
def test_reference_noise_does_not_bias_the_error(chance, sigma):
    image = chance.normal(scale=0.1, size=SHAPE)
    exact = Reference(np.zeros(SHAPE), np.zeros(SHAPE))
    noisy = Reference(*chance.normal(scale=0.1, size=(2, *SHAPE)))
    assert mean_square_error(image, noisy, sigma) == pytest.approx(mean_square_error(image, exact, sigma), rel=0.15)


def test_noise_of_the_reference_is_that_of_the_mean_of_its_halves(chance):
    noisy = Reference(*chance.normal(scale=0.1, size=(2, *SHAPE)))
    assert noisy.noise(0, "RGB") == pytest.approx(0.01 / 2, rel=0.05)


def test_luminance_weighs_channels_and_rgb_does_not():
    zero = np.zeros(SHAPE, np.float32)
    green = zero.copy()
    green[..., 1] = 1.0
    truth = Reference(zero, zero)
    assert mean_square_error(green, truth, 0, "luminance") == pytest.approx(0.7152**2)
    assert mean_square_error(green, truth, 0, "RGB") == pytest.approx(1 / 3)


def test_low_pass_takes_out_fine_errors_only():
    checker = np.indices(SHAPE).sum(0) % 2 - 0.5
    flat = np.full(SHAPE, 0.5)
    zero = np.zeros(SHAPE)
    truth = Reference(zero, zero)
    assert mean_square_error(checker[..., :1].repeat(3, -1), truth, 2) < 1e-3
    assert mean_square_error(flat, truth, 2) == pytest.approx(0.25)


def test_ratio_spread_covers_the_truth(chance):
    within = 0
    for _ in range(200):
        found = ratio(chance.normal(0.8, 0.02, 8), chance.normal(1.0, 0.02, 8))
        within += abs(found.value - 0.8) < 2 * found.spread
    assert within > 170


def test_unknown_measure():
    zero = np.zeros(SHAPE)
    with pytest.raises(ValueError, match="no measure"):
        mean_square_error(zero, Reference(zero, zero), 0, "loudness")
