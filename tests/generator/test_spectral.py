"""The spectral optimiser: its gradient, its strata, its figures."""

import numpy as np
import pytest

from generator import make_tile
from generator.equal_strata import stratify_line, stratify_square
from generator.layer_views import coupling, frame_views, prefix_views
from generator.owen_nets import OwenNets, nested_shuffles, sobol_cells
from generator.plane_waves import draw_waves
from generator.spectral import SCALES
from generator.step_test import relative_error, step_test
from generator.visible_error import filtered_gradient, passbands


def power(points, waves, passed):
    """The energy whose gradient is asked for, in double precision and without tricks."""
    errors = np.exp(1j * np.einsum("wd,npd->wnp", waves.frequencies, points[..., list(waves.columns)]))
    errors -= waves.mean[:, None, None]
    errors = errors.reshape(*errors.shape[:2], *passed.band.shape)
    spectra = np.fft.fft2(np.einsum("rn,wnyx->wryx", passed.mixtures, errors))
    result = np.einsum("w,wryx,yx->", waves.weight, np.abs(spectra) ** 2, passed.band) / passed.band.size
    if passed.unfiltered is not None:
        result += np.einsum("w,kl,wkyx,wlyx->", waves.weight, passed.unfiltered, errors.conj(), errors).real
    return result


def test_mixtures_have_the_power_of_the_views():
    for views, count in ((prefix_views(16), 5), (frame_views(8), 8)):
        mixtures = passbands(8, views, SCALES).mixtures
        assert len(mixtures) == count
        assert np.allclose(mixtures.T @ mixtures, coupling(views), atol=1e-5)


@pytest.mark.parametrize("views", [prefix_views(1), prefix_views(2), frame_views(4)])
def test_gradient_is_that_of_the_power(views):
    rng = np.random.default_rng(1)
    layers = views.shape[1]
    points = rng.random((layers, 64, 3)).astype(np.float32)
    waves = draw_waves((0, 2), 5, rng)
    passed = passbands(8, views, SCALES)
    gradient = filtered_gradient(points, waves, passed)
    differences = np.empty(gradient.shape)
    for layer, point, column in np.ndindex(differences.shape):
        step = np.zeros(points.shape)
        step[layer, point, waves.columns[column]] = 1e-4
        above, below = power(points + step, waves, passed), power(points - step, waves, passed)
        differences[layer, point, column] = (above - below) / 2e-4
    ratio = (differences * gradient).sum() / (gradient**2).sum()
    assert ratio > 0
    assert np.allclose(differences, ratio * gradient, atol=1e-3 * np.abs(differences).max())


def test_waves_have_the_expectation_they_claim():
    rng = np.random.default_rng(2)
    waves = draw_waves((0, 1), 50, rng)
    points = rng.random((100_000, 2))
    assert np.allclose(np.exp(1j * points @ waves.frequencies.T).mean(axis=0), waves.mean, atol=0.02)
    assert np.sum(waves.weight * (1 - np.abs(waves.mean) ** 2)) == pytest.approx(1, rel=1e-5)


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


def test_pairs_have_one_point_in_each_cell(tile):
    u, v = (tile.columns("light.u", "light.v").reshape(-1, 2) * 32).astype(int).T
    assert np.array_equal(np.sort(32 * u + v), np.arange(1024))


def test_deterministic(tile):
    again = make_tile("spectral", 32, tile.dims, seed=1, steps=300)
    assert np.array_equal(again.values, tile.values)


def test_a_subset_without_weight_is_left_alone():
    """With only t+lens, t alone is much worse than with t alone."""
    dims = ("t", "lens.u", "lens.v")
    joint, single = (
        make_tile("spectral", 16, dims, seed=1, steps=300, weights=dict.fromkeys(off, 0)).columns("t")
        for off in (("t", "lens"), ("lens", "t+lens"))
    )
    assert relative_error(single, (1.0,))[0] < 0.6 * relative_error(joint, (1.0,))[0]


def elementary_intervals(cells, bits):
    """How often each elementary interval of each shape is hit by a pixel's pair: counts, all of them 1 in a net."""
    u, v = cells
    for split in range(bits + 1):
        yield np.bincount(u >> (bits - split) << (bits - split) | v >> split, minlength=2**bits)


def test_two_sobol_dimensions_are_a_net_after_every_shuffle():
    cells = sobol_cells(4)
    assert np.array_equal(np.sort(cells, axis=0), np.tile(np.arange(16)[:, None], (1, 3)))
    for order in nested_shuffles(20, 4, np.random.default_rng(5)):
        assert np.array_equal(np.sort(order), np.arange(16))
        for prefix in (2, 4, 8):
            assert len(set(order[:prefix] // prefix)) == 1, "a prefix is an aligned block"
    for counts in elementary_intervals(cells[:, :2].T, 4):
        assert np.all(counts == 1)


def test_nearest_nets_are_nets_and_near():
    rng = np.random.default_rng(6)
    nets = OwenNets(100, 8, ("t", "light.u", "light.v"), rng)
    points = rng.random((100, 8, 3))
    nearest = nets.nearest(points)
    another = nets.nearest(rng.random((100, 8, 3)))
    assert np.abs(nearest - points).mean() < 0.8 * np.abs(another - points).mean()
    assert np.allclose(nets.nearest(nearest), nearest), "nets are their own nearest nets"
    for pixel in (nearest * 8).astype(int):
        assert np.array_equal(np.sort(pixel, axis=0), np.tile(np.arange(8)[:, None], (1, 3)))
        for counts in elementary_intervals(pixel[:, 1:].T, 3):
            assert np.all(counts == 1)
    assert np.array_equal(np.sort((nearest * 800).astype(int), axis=None), np.repeat(np.arange(800), 3))


@pytest.fixture(scope="module")
def samples_tile():
    return make_tile("spectral", 16, ("t", "light.u", "light.v"), seed=2, samples=4, steps=100)


def test_samples_are_stratified_in_the_pixel_after_every_power_of_two(samples_tile):
    for prefix in (2, 4):
        strata = np.sort((samples_tile.values[:, :, :prefix] * prefix).astype(int), axis=2)
        assert np.all(strata == np.arange(prefix)[:, None])
    light = (samples_tile.columns("light.u", "light.v") * 2).astype(int)
    assert np.all(np.sort(light[..., 0] * 2 + light[..., 1], axis=2) == np.arange(4))


def test_pixel_means_are_blue_after_every_power_of_two(samples_tile):
    independent = make_tile("n-rooks", 16, samples_tile.dims, seed=2, samples=4)
    for prefix in (1, 2, 4):
        for columns in ([0], [1, 2], [0, 1, 2]):
            ours = relative_error(samples_tile.values[:, :, :prefix, columns], (0.0, 1.0, 2.0))
            assert ours[2] < 0.8 * ours[0], (prefix, columns)
    assert relative_error(samples_tile.values, (1.0,))[0] < 0.7 * relative_error(independent.values, (1.0,))[0]


def test_frames_are_blue_alone_and_converge_together():
    tile = make_tile("spectral", 16, ("t", "lens.u", "lens.v"), seed=3, frames=8, steps=100)
    assert tile.values.shape == (16, 16, 8, 3)
    for frame in range(8):
        single = relative_error(tile.values[:, :, [frame]], (1.0,), functions=100)[0]
        assert single < 0.75
        assert np.array_equal(np.sort((tile.values[:, :, frame, 0] * 256).astype(int), axis=None), np.arange(256))
    for start in (0, 3):
        assert relative_error(tile.values[:, :, start : start + 4], (0.0,), functions=100)[0] < 0.7
