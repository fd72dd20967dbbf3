# SPDX-License-Identifier: GPL-3.0-or-later
"""Plans are permutations, keep Cycles' blocks together, and lower the visible error."""

import itertools
import tracemalloc

import numpy as np
import pytest

from addon.blender.refusal import Cancelled
from addon.blender.region import Region
from addon.cycles import plan_image, random_numbers
from addon.cycles.scene_analysis import SceneUse
from addon.plan import arranged_plan, modes, pattern_plan, sample_plan
from addon.plan.matching import match
from generator import Tile

MOTION = SceneUse(motion_blur=True, lens=False, lights=1, bounces=False, glow=False)
ROOM = SceneUse(motion_blur=False, lens=False, lights=3, bounces=True, glow=False)

NOTHING = SceneUse(motion_blur=False, lens=False, lights=0, bounces=False, glow=False)


def region(width, height, corner=(0, 0)):
    return Region((width + corner[0], height + corner[1]), corner, (width, height))


def visible_error(values, film, shape, sigma=1.0):
    """Mean square of a step function's error after a Gaussian of `sigma` pixels, over many thresholds."""
    frequencies = np.fft.fftfreq(shape[0])[:, None] ** 2 + np.fft.fftfreq(shape[1]) ** 2
    low_pass = np.exp(-2 * np.pi**2 * sigma**2 * frequencies)
    total = 0.0
    for threshold in np.linspace(0.1, 0.9, 9):
        image = np.empty(shape)
        image.ravel()[film] = (values > threshold) - (values > threshold).mean()
        total += np.mean(np.abs(np.fft.fft2(image) * low_pass) ** 2)
    return total


@pytest.mark.parametrize("size", [(1, 1), (7, 3), (64, 64), (101, 259), (300, 260)])
@pytest.mark.parametrize("samples", [1, 4])
def test_every_film_pixel_is_served_once(size, samples):
    made = arranged_plan.make(ROOM, region(*size, corner=(5, 2)), samples, seed=3)
    assert np.array_equal(np.sort(made.film), np.arange(size[0] * size[1]))


def cut(grid, side, start):
    """A periodic grid's blocks of `side` x `side` that start at one corner: (blocks, side * side, ...)."""
    moved = np.roll(grid, tuple(-corner for corner in start), axis=(0, 1))
    rows, columns = (length // side for length in grid.shape[:2])
    return moved.reshape(rows, side, columns, side, *grid.shape[2:]).swapaxes(1, 2).reshape(rows * columns, side**2, -1)


def test_blocks_of_the_sequence_stay_together():
    """Each 2 x 2, 4 x 4, ... block of the film, wherever they start, shows one block of consecutive points."""
    side = 64
    made = arranged_plan.make(MOTION, region(side, side), 1, seed=1)
    y, x = np.mgrid[0:side, 0:side]
    on_film = np.empty(side * side, np.uint32)
    on_film[made.film] = random_numbers.pixel_ranks(x, y, made.seed).ravel()
    on_film = on_film.reshape(side, side)

    def are_together(start):
        return all((np.ptp(cut(on_film, 2**k, start) >> np.uint32(2 * k), axis=1) == 0).all() for k in (1, 2, 3))

    (start,) = filter(are_together, itertools.product(range(8), repeat=2))
    # Points 2k and 2k + 1 share an edge.
    quads = cut(on_film, 2, start)[..., 0]
    assert (quads[:, 0] ^ quads[:, 3] != 1).all()


@pytest.mark.parametrize(
    ("use", "name", "at_most"),
    [
        (MOTION, "t", 0.65),
        (MOTION, "light.u", 0.85),
        (ROOM, "light.pick", 0.97),
        (ROOM, "light2.u", 1.0),
    ],
)
def test_less_visible_error_than_cycles_order(use, name, at_most):
    """Used dimensions gain, and no dimension loses."""
    side = 256
    made = arranged_plan.make(use, region(side, side), 1, seed=2)
    y, x = np.mgrid[0:side, 0:side]
    values = random_numbers.sequence_values(random_numbers.pixel_ranks(x, y, made.seed).ravel(), (name,))[:, 0]
    ours = visible_error(values, made.film, (side, side))
    assert ours <= at_most * visible_error(values, np.arange(side * side), (side, side))


@pytest.mark.parametrize("name", ["t", "light.u"])
def test_no_frequency_stands_out(name):
    """Averaged over seeds, no bin of the error's periodogram is 6 dB above its ring."""
    side, seeds = 64, 24
    y, x = np.mgrid[0:side, 0:side]
    power = np.zeros((side, side))
    for seed in range(seeds):
        made = arranged_plan.make(MOTION, region(side, side), 1, seed)
        values = random_numbers.sequence_values(random_numbers.pixel_ranks(x, y, made.seed).ravel(), (name,))[:, 0]
        for threshold in (0.25, 0.5, 0.7):
            image = np.empty(side * side)
            image[made.film] = values > threshold
            power += np.abs(np.fft.fft2((image - image.mean()).reshape(side, side))) ** 2
    frequency = np.fft.fftfreq(side, 1 / side)
    ring = np.rint(np.hypot(frequency[:, None], frequency)).astype(int)
    mean = np.bincount(ring.ravel(), power.ravel()) / np.bincount(ring.ravel())
    judged = (ring > 2) & (ring <= side // 2)
    assert (power / np.maximum(mean[ring], 1e-12))[judged].max() < 10**0.6


def test_large_regions_reuse_one_plan():
    sample_plan._plans.clear()
    large = region(512, 300)
    first, second = arranged_plan.make(MOTION, large, 1, seed=1), arranged_plan.make(MOTION, large, 1, seed=2)
    assert first.seed == second.seed
    assert not np.array_equal(first.film, second.film)
    assert np.array_equal(np.sort(second.film), np.arange(512 * 300))


def test_pixels_at_the_edge_see_all_numbers_alike():
    """Over many plans they get no number more often than others, though nothing is arranged beyond them."""
    lights = SceneUse(motion_blur=False, lens=False, lights=2, bounces=False, glow=False)
    seen, wave = region(24, 24), (("light.u", 2),)
    means = []
    for seed in range(400):
        plan = arranged_plan.make(lights, seen, 2, 5 * seed)
        rows, columns = np.divmod(np.arange(seen.pixels), plan.width)
        ranks = np.empty((24, 24), np.uint32)
        ranks.flat[plan.film] = random_numbers.pixel_ranks(columns, rows, plan.seed)
        (found,) = modes.waves([wave], arranged_plan.numbers([wave], ranks, 2, 2))
        means.append((found[0].mean(), found[1].mean()))
    error = np.mean(means, axis=0) / (np.std(means, axis=0) / len(means) ** 0.5)
    assert np.abs(error).max() < 4.5


def test_match_is_a_close_permutation():
    rng = np.random.default_rng(0)
    points, targets = rng.random((2, 5000, 2), dtype=np.float32)
    pairs = match(points, targets)
    assert np.array_equal(np.sort(pairs), np.arange(5000))
    # 5000 points in the unit square are 0.014 apart.
    assert np.abs(points - targets[pairs]).mean() < 0.02


def test_tile_plan_follows_the_tile():
    values = np.random.default_rng(1).random((32, 32, 1, 3), dtype=np.float32)
    tile = Tile(("t", "lens.u", "lens.v"), values, {"method": "white", "seed": 1})
    made = pattern_plan.make(tile, tile.dims, region(128, 128), 1, seed=4)
    assert np.array_equal(np.sort(made.film), np.arange(128 * 128))
    assert made.errors["t"] < 0.01 and made.miss.startswith("t 0.0")
    y, x = np.mgrid[0:128, 0:128]
    lens = random_numbers.sequence_values(random_numbers.pixel_ranks(x, y, 4).ravel(), ("lens.u", "lens.v"))
    reached = np.mod(lens + made.lens_shift, 1.0)
    wanted = np.sort(values[..., 0, 1].ravel())
    nearest = np.abs(reached[:, :1] - wanted[np.searchsorted(wanted, reached[:, 0]).clip(0, 1023)][:, None])
    assert np.median(nearest) < 1e-6


def test_a_plan_takes_few_bytes_a_pixel(tmp_path):
    """Made, moved and written; a plan that stays takes 4."""
    sample_plan._plans.clear()
    planned = region(1024, 768)
    plan_image.write(arranged_plan.make(MOTION, region(64, 64), 1, seed=1), str(tmp_path / "plan.tif"))
    tracemalloc.start()
    plan_image.write(arranged_plan.make(MOTION, planned, 1, seed=1), str(tmp_path / "plan.tif"))
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak / planned.pixels <= 24


def test_windows_cover_the_region_once():
    cut = Region((1000, 700), (130, 250), (700, 300))
    seen = np.zeros((300, 700), int)
    for window in cut.windows(256):
        seen[window] += 1
    assert (seen == 1).all()


@pytest.mark.parametrize("follow", [False, True], ids=["automatic", "tile"])
def test_a_cancelled_plan_is_not_kept(follow):
    """It is given up after the piece at work, and made anew when it is asked for again."""
    region = Region((900, 700), (0, 0), (900, 700))
    tile = Tile(("light.u", "light.v"), np.random.default_rng(2).random((16, 16, 1, 2), dtype=np.float32))
    asked = []

    def is_cancelled():
        asked.append(True)
        return len(asked) > 2

    def make(*cancelled):
        if follow:
            return pattern_plan.make(tile, tile.dims, region, 1, 5, *cancelled)
        return arranged_plan.make(SceneUse(False, False, 1, False, False), region, 1, 5, *cancelled)

    sample_plan._plans.clear()
    with pytest.raises(Cancelled):
        make(is_cancelled)
    assert len(asked) < 30
    again = make()
    assert np.array_equal(np.sort(again.film), np.arange(region.pixels))
    assert make(lambda: pytest.fail("made again")) is not None
