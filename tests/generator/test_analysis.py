"""Spectra, statistics, tables and pictures say what is known of simple patterns."""

import numpy as np
import pytest
from scipy.stats import qmc

from generator import Tile, cli, make_tile, save_tile
from generator.best_candidate import best_candidates
from generator.periodogram import cylinder_power, mode_periodogram, pattern_periodogram
from generator.statistics import (
    correlations,
    empty_cells,
    l2_star_discrepancy,
    neighbour_distances,
    star_discrepancy_1d,
)


@pytest.fixture
def rng():
    return np.random.default_rng(8)


def test_uniform_points_have_a_flat_spectrum(rng):
    spectrum = pattern_periodogram([rng.random((200, 2)) for _ in range(50)], size=32)
    assert np.allclose(spectrum.radial_mean, 1, atol=0.2)
    assert spectrum.anisotropy.mean() == pytest.approx(-10 * np.log10(50), abs=2)


def test_best_candidates_have_little_power_at_low_frequencies(rng):
    spectrum = pattern_periodogram([best_candidates(200, 2, rng, m=5) for _ in range(3)], size=64)
    assert spectrum.radial_mean[:6].mean() < 0.2  # the principal frequency is near sqrt(200) = 14
    assert spectrum.radial_mean[12:18].mean() > 1


def test_a_plane_wave_is_one_peak_and_anisotropic():
    values = np.zeros((16, 16, 1, 1))
    values[..., 0, 0] = np.arange(16) % 2  # cos(pi t) alternates from column to column
    spectrum = mode_periodogram(values, [1])
    assert np.unravel_index(np.argmax(spectrum.power), (16, 16)) == (8, 0)
    assert np.sort(spectrum.power, axis=None)[-2] < 1e-6 * spectrum.power.max()


def test_white_tiles_have_mode_and_cylinder_power_one():
    tile = make_tile("white", 64, ("t", "lens.u"), seed=4, samples=2)
    for mode in ([1, 0], [2, 3], [-1, 4]):
        assert mode_periodogram(tile.values, mode).radial_mean.mean() == pytest.approx(1, abs=0.1)
    assert np.allclose(cylinder_power(tile.values[..., 0]), 1, atol=0.35)


def test_cylinders_of_a_scanned_tile_are_vacant_as_figure_5_asks():
    power = cylinder_power(make_tile("scanning", 32, ("t",), seed=1).values[..., 0], 4, (4, 8))
    assert power[0, 0] < 0.1 and power[1, 0] < 0.15
    assert power[0, :3].mean() < power[1, :3].mean(), "the narrower cylinder is the emptier one"


def test_discrepancies_agree_with_scipy_and_with_theory(rng):
    points = rng.random((300, 3))
    expected = qmc.discrepancy(points, method="L2-star")
    assert l2_star_discrepancy(points) == pytest.approx(expected, rel=1e-9)
    assert star_discrepancy_1d((np.arange(50) + 0.5) / 50) == pytest.approx(0.01)
    assert star_discrepancy_1d([0.2]) == pytest.approx(0.8)


def test_statistics_of_simple_tiles(rng):
    white = rng.random((16, 16, 1, 2))
    distances = neighbour_distances(white)
    assert distances["smallest"] == pytest.approx(distances["white"], rel=0.15)
    assert neighbour_distances(make_tile("scanning", 16, ("t",), seed=1).values)["smallest"] > 0.05
    white[..., 1] = 1 - white[..., 0]
    assert np.allclose(correlations(white), [[1, -1], [-1, 1]])
    grid = np.stack(np.meshgrid(np.arange(8), np.arange(8)), axis=-1).reshape(-1, 2) / 8
    assert empty_cells(grid) == 0
    assert empty_cells(np.zeros((64, 2))) == 63 / 64


@pytest.fixture
def tile_path(tmp_path):
    save_tile(make_tile("stratified", 16, ("t", "lens.u", "lens.v"), seed=1, samples=2), tmp_path / "a.npz")
    return tmp_path / "a.npz"


def test_analyse_prints_its_tables(tile_path, capsys):
    assert cli.main(["analyse", str(tile_path)]) == 0
    text = capsys.readouterr().out
    for expected in ("lens: L2 discrepancy", "empty cells", "correlation", "up to"):
        assert expected in text


def test_compare_prints_markdown(tile_path, tmp_path, capsys):
    save_tile(make_tile("white", 16, ("lens.u", "lens.v", "film.x"), seed=1), tmp_path / "b.npz")
    assert cli.main(["compare", str(tile_path), str(tmp_path / "b.npz"), "--functions", "20"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].startswith("Step test: mean square error of 20 functions")
    assert lines[2] == "| sigma 1 / 2 / 4 | a | b |"
    assert [line.split("|")[1].strip() for line in lines[4:]] == ["lens"]
    assert all(lines[4].split("|")[column].count("**") % 2 == 0 for column in (2, 3)) and lines[4].count("**") == 6
    save_tile(make_tile("white", 16, ("film.x",), seed=1), tmp_path / "c.npz")
    assert cli.main(["compare", str(tile_path), str(tmp_path / "c.npz")]) == 2


def test_plot_writes_four_pictures(tile_path, capsys):
    assert cli.main(["plot", str(tile_path)]) == 0
    names = {"a-values.png", "a-spectra.png", "a-marginals.png", "a-neighbourhood.png"}
    assert {path.name for path in tile_path.parent.glob("*.png")} == names
    assert all(path.read_bytes().startswith(b"\x89PNG") for path in tile_path.parent.glob("*.png"))


def test_plot_of_a_single_dimension_works(tmp_path):
    save_tile(Tile(("t",), np.random.default_rng(1).random((8, 8, 1, 1))), tmp_path / "t.npz")
    assert cli.main(["plot", str(tmp_path / "t.npz"), "--out", str(tmp_path / "x")]) == 0
    assert (tmp_path / "x-spectra.png").exists()
