"""The spectral optimiser: its gradient, its strata, its figures."""

import numpy as np
import pytest

from generator import make_tile
from generator.equal_strata import stratify_line, stratify_square
from generator.plane_waves import draw_waves
from generator.spectral import filtered_gradient
from generator.step_test import step_test


def power(points, waves, passband):
    images = np.exp(1j * waves.frequencies @ points[:, waves.columns].T) - waves.mean[:, None]
    spectra = np.abs(np.fft.fft2(images.reshape(-1, *passband.shape))) ** 2
    return (spectra * passband).sum()


def test_gradient_is_that_of_the_power():
    rng = np.random.default_rng(1)
    points = rng.random((64, 3)).astype(np.float32)
    waves = draw_waves((0, 2), 5, rng)
    passband = rng.random((8, 8)).astype(np.float32)
    passband = (passband + np.roll(passband[::-1, ::-1], (1, 1), axis=(0, 1))) / 2  # that of a real filter
    gradient = filtered_gradient(points, waves, passband)
    differences = np.empty((64, 2))
    for index, column in enumerate(waves.columns):
        for point in range(64):
            step = np.zeros(points.shape)
            step[point, column] = 1e-4
            above, below = power(points + step, waves, passband), power(points - step, waves, passband)
            differences[point, index] = (above - below) / 2e-4
    ratio = (differences * gradient).sum() / (gradient**2).sum()
    assert ratio > 0
    assert np.allclose(differences, ratio * gradient, atol=1e-3 * np.abs(differences).max())


def test_waves_have_the_expectation_they_claim():
    rng = np.random.default_rng(2)
    waves = draw_waves((0, 1), 50, rng)
    points = rng.random((100_000, 2))
    assert np.allclose(np.exp(1j * points @ waves.frequencies.T).mean(axis=0), waves.mean, atol=0.02)


def test_strata_are_exact_and_nearby():
    points = np.random.default_rng(3).random((256, 2))
    line = stratify_line(points[:, 0])
    assert np.array_equal(np.sort((line * 256).astype(int)), np.arange(256))
    assert np.array_equal(np.argsort(line), np.argsort(points[:, 0]))
    u, v = stratify_square(points).T
    for axis in (u, v):
        assert np.array_equal(np.sort((axis * 256).astype(int)), np.arange(256))
    assert np.array_equal(np.sort((u * 16).astype(int) * 16 + (v * 16).astype(int)), np.arange(256))
    assert np.abs(np.stack([u, v], axis=1) - points).mean() < 0.1


@pytest.fixture(scope="module")
def tile():
    return make_tile("spectral", 32, ("t", "lens.u", "lens.v", "light.u", "light.v"), seed=1, steps=300)


def test_every_cell_of_the_table_beats_white_noise_by_far(tile):
    limits = {"t": 0.3, "lens": 0.45, "light": 0.45, "t+lens": 0.5, "t+light": 0.5, "lens+light": 0.55, "all": 0.55}
    for label, errors in step_test(tile, functions=100, seed=77).items():
        assert errors[0] < limits[label], label
        assert errors[2] < errors[0], label


def test_values_are_stratified(tile):
    values = tile.values.reshape(-1, 5).astype(np.float64)
    for column in values.T:
        assert np.array_equal(np.sort((column * 1024).astype(int)), np.arange(1024))


def test_deterministic(tile):
    again = make_tile("spectral", 32, tile.dims, seed=1, steps=300)
    assert np.array_equal(again.values, tile.values)
