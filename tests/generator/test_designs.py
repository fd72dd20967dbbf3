"""Each design that the paper names has its defining property."""

import numpy as np
import pytest

from generator import METHODS, make_tile
from generator.best_candidate import best_candidates, best_candidates_on_sphere
from generator.cook import cook
from generator.dart_throwing import poisson_disk_count, poisson_disk_radius, toroidal_distance
from generator.film_positions import film_positions
from generator.jittered import jittered_grid
from generator.joint_scanning import scan_jointly
from generator.n_rooks import n_rooks
from generator.scanning import neighbour_offsets, scan_group, smallest_distance
from generator.step_test import relative_error


@pytest.fixture
def rng():
    return np.random.default_rng(11)


def nearest_distances(points):
    """Distance of each point to its nearest neighbour on the torus."""
    return np.array([np.sort(toroidal_distance(points, point))[1] for point in points])


@pytest.mark.parametrize("method", METHODS)
def test_every_method_depends_on_nothing_but_its_seed(method):
    dims = ("film.x", "film.y") if method == "film-positions" else ("t", "light.u", "light.v")
    few = {"steps": 3} if method == "spectral" else {}
    one, same, other = (make_tile(method, 7, dims, seed, samples=4, **few).values for seed in (1, 1, 2))
    assert one.shape == (7, 7, 4, len(dims))
    assert np.array_equal(one, same) and not np.array_equal(one, other)


def test_jitter_puts_one_point_in_every_block(rng):
    points = jittered_grid((4, 3, 2), rng)
    blocks = {tuple(block) for block in (points * (4, 3, 2)).astype(int)}
    assert len(blocks) == len(points) == 24


def test_stratified_fills_every_stratum_and_every_cell_once():
    tile = make_tile("stratified", 8, ("t", "lens.u", "lens.v"), seed=1, samples=4)
    t, u, v = tile.values.reshape(-1, 3).astype(np.float64).T
    assert np.array_equal(np.sort((t * 256).astype(int)), np.arange(256))
    assert np.array_equal(np.sort((u * 16).astype(int) * 16 + (v * 16).astype(int)), np.arange(256))


def test_n_rooks_hits_every_level_of_every_axis_once(rng):
    levels = (n_rooks(8, 3, rng) * 8).astype(int)
    assert np.array_equal(np.sort(levels, axis=0), np.tile(np.arange(8)[:, None], (1, 3)))
    tile = make_tile("n-rooks", 3, ("t", "light.pick"), seed=1, samples=5)
    assert np.array_equal(np.sort((tile.values * 5).astype(int), axis=2)[1, 2, :, 1], np.arange(5))


def test_cook_fills_every_stratum_of_every_marginal_once(rng):
    t, u, v = cook(16, ("t", "lens.u", "lens.v"), rng).T
    assert np.array_equal(np.sort((t * 16).astype(int)), np.arange(16))
    assert np.array_equal(np.sort((u * 4).astype(int) * 4 + (v * 4).astype(int)), np.arange(16))
    with pytest.raises(ValueError, match="square number"):
        make_tile("cook", 2, ("t",), seed=1, samples=5)


def test_cooks_marginals_are_uncorrelated():
    """Section 2: linear correlation between parameters must be avoided."""
    values = make_tile("cook", 16, ("t", "lens.u", "lens.v"), seed=2, samples=16).values.reshape(-1, 3)
    correlation = np.corrcoef(values.T)
    assert np.abs(correlation - np.eye(3)).max() < 5 / np.sqrt(len(values))


def test_darts_keep_their_distance_and_leave_no_large_hole(rng):
    points = poisson_disk_radius(0.08, rng)
    assert nearest_distances(points).min() >= 0.08
    probes = rng.random((2000, 2))
    assert np.mean([toroidal_distance(points, probe).min() > 0.08 for probe in probes]) < 0.01
    with pytest.raises(ValueError, match="radius"):
        poisson_disk_radius(0, rng)


def test_darts_reach_a_wanted_count(rng):
    points, radius = poisson_disk_count(150, rng)
    assert len(points) == 150 and nearest_distances(points).min() >= radius
    assert radius > 0.65 / np.sqrt(150)  # the densest packing has 1.07, a full Poisson disk about 0.75
    assert len(poisson_disk_count(1, rng, d=3)[0]) == 1


def test_best_candidates_spread_in_every_prefix(rng):
    """Uniform points have a mean nearest distance of 0.5 / sqrt(n), best candidates one above 0.7 / sqrt(n)."""
    points = best_candidates(256, 2, rng)
    for count in (16, 64, 256):
        assert nearest_distances(points[:count]).mean() * np.sqrt(count) > 0.7


def test_more_candidates_make_a_better_pattern(rng):
    quality = [nearest_distances(best_candidates(150, 2, rng, m=m)).mean() for m in (1, 4, 16)]
    assert quality[0] < quality[1] < quality[2]


@pytest.mark.parametrize(
    ("toroidal", "norm", "axes"), [(True, 2, (1, 1)), (False, 1, (1, 1)), (True, 3, (2, 0.5)), (True, 2, (1, 1, 1))]
)
def test_the_grid_changes_nothing_but_the_time(toroidal, norm, axes):
    """The same random numbers, all distances by brute force."""
    d = len(axes)
    points = best_candidates(200, d, np.random.default_rng(7), m=1, toroidal=toroidal, norm=norm, axes=axes)
    rng = np.random.default_rng(7)
    expected = [rng.random(d)]
    for existing in range(1, 200):
        candidates = rng.random((existing, d))
        difference = np.abs(candidates[:, None] - np.array(expected))
        if toroidal:
            difference = np.minimum(difference, 1 - difference)
        distance = ((difference / axes) ** norm).sum(axis=2).min(axis=1)
        expected.append(candidates[np.argmax(distance)])
    assert np.array_equal(points, expected)


def test_a_diamond_leaves_more_room_along_the_axes(rng):
    """The L1 ball of radius r reaches r along the axes and 0.7 r along diagonals."""
    points = best_candidates(300, 2, rng, norm=1)
    difference = points[:, None] - points
    difference = np.abs(difference - np.round(difference))
    nearest = np.argsort(difference.sum(axis=2), axis=1)[:, 1]
    assert difference[np.arange(300), nearest].sum(axis=1).mean() * np.sqrt(300) > 0.85
    with pytest.raises(ValueError, match="norm"):
        best_candidates(4, 2, rng, norm=0.5)
    with pytest.raises(ValueError, match="norm"):
        best_candidates(4, 2, rng, norm=np.nan)
    with pytest.raises(ValueError, match="axes"):
        best_candidates(4, 2, rng, axes=(1, 0))


def test_best_candidates_on_the_sphere_are_isotropic(rng):
    points = best_candidates_on_sphere(200, rng)
    assert np.allclose(np.linalg.norm(points, axis=1), 1)
    cosine = points @ points.T - 2 * np.eye(200)
    nearest = np.arccos(cosine.max(axis=1))
    assert nearest.min() > 0.5 * np.sqrt(4 * np.pi / 200)
    assert np.allclose(points.T @ points / 200, np.eye(3) / 3, atol=0.03)


def test_film_positions_are_in_their_pixels_and_spread():
    dims = ("film.x", "film.y")
    spread, jitter = (film_positions(12, dims, 2, np.random.default_rng(1), candidates) for candidates in (32, 1))
    assert spread.min() >= 0 and spread.max() < 1

    def nearest(values):
        corner = np.stack(np.meshgrid(np.arange(12), np.arange(12)), axis=-1)[:, :, None]
        return nearest_distances(((values + corner) / 12).reshape(-1, 2))

    assert nearest(spread).min() > 3 * nearest(jitter).min()
    with pytest.raises(ValueError, match=r"film\.x, film\.y"):
        make_tile("film-positions", 8, ("t",), seed=1)
    assert nearest(spread).mean() > 1.3 * nearest(jitter).mean()


def test_figure_7_has_8_primary_and_16_secondary_cells():
    primary, secondary = neighbour_offsets()
    assert len(primary) == 8 and len(secondary) == 16
    assert np.abs(primary).max() == 1 and np.all(np.abs(secondary).max(axis=1) == 2)


def test_impossible_counts_are_refused(rng):
    with pytest.raises(ValueError, match="secondary: expected an integer from 1 to 5"):
        scan_group(4, 1, 1, rng, candidates=5, secondary=6)
    with pytest.raises(ValueError, match="count"):
        n_rooks(0, 2, rng)


def test_scanning_distances_wrap_around():
    """Section 6: "so the pattern can be used periodically from frame to frame"."""
    assert np.allclose(smallest_distance(np.array([[0.05]]), np.array([[0.9], [0.5]])), 0.15)


def test_scanning_reproduces_the_papers_spectra():
    """Section 7: time errors at most 0.55 of white noise under sigma = 1, lens errors clearly better than white."""
    tile = make_tile("scanning", 32, ("t", "lens.u", "lens.v"), seed=1)
    assert relative_error(tile.columns("t"), (1.0,))[0] < 0.3
    assert relative_error(tile.columns("lens.u", "lens.v"), (1.0,))[0] < 0.5


def test_more_candidates_scan_better():
    few, many = (make_tile("scanning", 16, ("t",), 1, candidates=m, secondary=m // 2).values for m in (2, 60))
    assert relative_error(many, (1.0,))[0] < 0.6 * relative_error(few, (1.0,))[0]


def test_scanned_tiles_join_seamlessly():
    """Neighbours across the tile's border differ in t as much as neighbours inside it."""
    t = make_tile("scanning", 32, ("t",), seed=2).values[:, :, 0, 0]
    for axis in (0, 1):
        difference = np.abs(t - np.roll(t, 1, axis=axis))
        distance = np.minimum(difference, 1 - difference)
        seam = np.take(distance, 0, axis=axis)
        assert abs(seam.mean() - distance.mean()) < 4 * distance.std() / np.sqrt(32)


def test_joint_and_marginal_scanning_wins_in_the_moving_penumbra():
    """Section 8: neither marginals alone nor the joint distribution alone are as good in (t, u, v)."""
    dims, everything = ("t", "light.u", "light.v"), (0, 1, 2)
    marginal = make_tile("scanning", 32, dims, seed=1).values
    both = make_tile("joint-scanning", 32, dims, seed=1).values
    joint = scan_jointly(32, dims, 1, np.random.default_rng(1), [(0, everything), (1, everything)])
    penumbra = [relative_error(values, (1.0,))[0] for values in (both, marginal, joint)]
    assert penumbra[0] < 0.98 * min(penumbra[1:])
    assert relative_error(both[..., :1], (1.0,))[0] < 0.7 * relative_error(joint[..., :1], (1.0,))[0]


@pytest.mark.parametrize("method", ["scanning", "joint-scanning"])
def test_scanning_reports_every_row_once_and_ends_complete(method):
    reported = []
    make_tile(method, 4, ("t", "lens.u", "lens.v"), 1, 2, lambda *numbers: reported.append(numbers))
    done, totals = zip(*reported, strict=True)
    assert len(set(totals)) == 1 and list(done) == list(range(1, totals[0] + 1))
