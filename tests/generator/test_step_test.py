"""The step test measures what it says."""

import numpy as np
import pytest

from generator import Tile
from generator.low_pass import filtered_power, gaussian_response
from generator.step_test import relative_error, step_test
from generator.test_functions import draw


@pytest.mark.parametrize("kind", ["step", "bump", "product"])
@pytest.mark.parametrize("samples", [1, 4])
def test_white_noise_scores_one(kind, samples):
    values = np.random.default_rng(1).random((64, 64, samples, 2))
    assert np.allclose(relative_error(values, functions=100, kind=kind), 1, atol=0.25)


def test_the_score_is_that_of_a_spatial_filter():
    """Against a plain convolution with the periodic Gaussian, one step in t."""
    size, sigma = 16, 1.5
    t = np.random.default_rng(2).random((size, size))
    family = draw("step", 1, 1, np.random.default_rng(5))
    error = family.evaluate(t.reshape(-1, 1)).reshape(size, size) - family.mean[0]
    distance = np.minimum(np.arange(size), size - np.arange(size))
    kernel = np.exp(-0.5 * (distance[:, None] ** 2 + distance**2) / sigma**2)
    kernel /= kernel.sum()
    blurred = sum(kernel[dy, dx] * np.roll(error, (dy, dx), axis=(0, 1)) for dy in range(size) for dx in range(size))
    expected = np.mean(blurred**2) / (family.variance[0] * np.sum(kernel**2))
    assert relative_error(t[:, :, None, None], (sigma,), functions=1, seed=5)[0] == pytest.approx(expected, rel=2e-3)


def test_expectations_agree_with_random_points():
    points = np.random.default_rng(3).random((200_000, 3))
    for kind in ("step", "bump", "product"):
        family = draw(kind, 20, 3, np.random.default_rng(4))
        assert np.allclose(family.evaluate(points).mean(axis=1), family.mean, atol=5e-3)


def test_filtered_power_without_a_filter_is_the_mean_square():
    image = np.random.default_rng(6).standard_normal((8, 8))
    assert filtered_power(image, gaussian_response(8, 0)) == pytest.approx(np.mean(image**2))


def test_bad_arguments_are_refused():
    tile = Tile(("t",), np.zeros((4, 4, 1, 1)))
    with pytest.raises(ValueError, match="from 1 to 100000, got 0"):
        step_test(tile, functions=0)
    with pytest.raises(ValueError, match="'ramp'"):
        step_test(tile, kind="ramp")
