# SPDX-License-Identifier: GPL-3.0-or-later
"""Rounds of rectangles on made-up noise: unbiased, complete, within their bounds, and better where they should be."""

import numpy as np
import pytest

from addon.plan import rates, rounds
from addon.plan.costs import Costs, Counted
from addon.plan.rates import Squares
from addon.plan.rounds import FEWEST, Goal, Shot

WIDTH, HEIGHT = 72, 40
SIZE = WIDTH, HEIGHT
SEEDS = 96
CALL, SAMPLE = 1e-6, 1e-6

# Two flat areas with an edge between them: quiet, and noisy; fireflies in a corner of the quiet one.
X, Y = np.meshgrid(np.arange(WIDTH), np.arange(HEIGHT))
LIGHT = np.where(X < 35, 0.5, 0.3)
NOISE = np.where(X < 35, 0.02, 0.5)
FIREFLIES = (X < 20) & (Y > 25)
CHANCE, FLASH = 0.002, 30.0
TRUTH = LIGHT + np.where(FIREFLIES, CHANCE * FLASH, 0.0)
REGIONS = {
    "quiet": (X < 35) & ~FIREFLIES,
    "noisy": X >= 35,
    "fireflies": FIREFLIES,
    "edge": abs(X - 35) < 3,
    "border of the fireflies": (abs(X - 20) < 3) & (Y > 22),
    "seams": (X % 8 % 7 == 0) | (Y % 8 % 7 == 0),
    "everywhere": np.ones((HEIGHT, WIDTH), bool),
}


class Noise:
    """A picture of made-up samples, as the driver holds one of Cycles'."""

    size = SIZE

    def __init__(self, seed, noise=NOISE, fireflies=FIREFLIES, speed=1.0, is_timed=True):
        self._is_timed = is_timed
        self._random = np.random.default_rng(seed)
        self._noise, self._fireflies = noise, fireflies
        self._speeds = np.broadcast_to(speed, (HEIGHT, WIDTH))
        self.cost = 0.0
        self.sums, self.first_half, self.counts, self._lengths = (np.zeros((HEIGHT, WIDTH)) for _ in range(4))
        self.costs = Costs(SIZE) if is_timed else Counted(SIZE)
        self.costs.call = CALL if is_timed else 1
        self.seconds = 0.0

    @property
    def mean(self):
        return np.repeat((self.sums / self.counts)[..., None], 3, axis=2).astype(np.float32)

    @property
    def half(self):
        return np.repeat(self.first_half[..., None], 3, axis=2).astype(np.float32)

    def _sum(self, part, count):
        shape = self.counts[part].shape
        flashes = self._random.poisson(CHANCE * count, shape) * self._fireflies[part]
        # Skewed, as light is: many small values, few large ones.
        skewed = self._random.gamma(count / 4.0, 4.0, shape) - count
        return count * LIGHT[part] + 0.5 * self._noise[part] * skewed + FLASH * flashes

    def spent(self):
        return self.seconds if self._is_timed else self.cost

    def shoot(self, shots):
        for (left, bottom, width, height), length, first, count in shots:
            part = slice(bottom, bottom + height), slice(left, left + width)
            assert first + count <= length
            if first == 0:
                self.sums[part], self.counts[part], self._lengths[part] = 0.0, 0, length
            assert (self.counts[part] == first).all(), "samples are missing or taken twice"
            assert (self._lengths[part] == length).all(), "sequences are mixed"
            if first == count:
                self.first_half[part] = self.sums[part] / count
            self.sums[part] += self._sum(part, count)
            self.counts[part] += count
            self.cost += count * self.costs.pixels[part].sum()
            taken = CALL + SAMPLE * count * self._speeds[part].sum()
            self.seconds += taken
            self.costs.learn(part, count, taken)


def rendered(goal, seed, **given):
    return finished(goal, Noise(seed, is_timed=goal.seconds is not None, **given))


def finished(goal, picture, is_weighed=False):
    picture.shoot([Shot((0, 0, *SIZE), goal.length, 0, goal.first)])
    base = goal.base(picture.costs.sample)
    for shots in rounds.opening(goal, base, SIZE, picture.costs):
        picture.shoot(shots)
    if is_weighed:
        picture.costs.weigh(CALL, SAMPLE, np.zeros((HEIGHT, WIDTH), bool))
        picture.costs.call = 1
    for shots in rounds.rounds(goal, base, picture, picture.costs, picture.spent):
        picture.shoot(shots)
    return picture


def bias(goal):
    """By region: mean error over pixels and seeds, in its standard errors."""
    errors = np.array([[(rendered(goal, seed).mean[..., 0] - TRUTH)[where].mean() for where in REGIONS.values()]
                       for seed in range(SEEDS)])  # fmt: skip
    return dict(zip(REGIONS, errors.mean(axis=0) / (errors.std(axis=0, ddof=1) / np.sqrt(SEEDS)), strict=True))


GOALS = {
    "mean": Goal(16),
    "threshold": Goal(256, threshold=0.05),
    "time": Goal(1024, seconds=SAMPLE * 40 * WIDTH * HEIGHT),
}


@pytest.mark.parametrize("goal", GOALS.values(), ids=GOALS)
def test_rounds_are_unbiased(goal):
    assert max(map(abs, bias(goal).values())) < 4.0


def test_a_square_that_decides_by_its_own_samples_is_seen_to_be_biased(monkeypatch):
    monkeypatch.setattr(rates, "around", lambda sums, areas: sums / areas)
    assert bias(GOALS["threshold"])["fireflies"] < -4.0


def test_the_mean_takes_the_time_of_the_same_samples_everywhere():
    seconds = np.mean([rendered(Goal(64), seed).seconds for seed in range(8)])
    assert seconds == pytest.approx(SAMPLE * 64 * WIDTH * HEIGHT, rel=0.1)


def test_noisy_pixels_take_more_and_the_error_falls():
    pictures = [rendered(Goal(64), seed, fireflies=np.zeros_like(FIREFLIES)) for seed in range(8)]
    assert all(picture.counts[NOISE > 0.1].mean() > 2.0 * picture.counts[X < 20].mean() for picture in pictures)
    error = np.mean([np.square(picture.mean[..., 0] - LIGHT) for picture in pictures])
    assert error < 0.85 * np.mean(np.square(NOISE)) / 64


def test_where_all_pixels_are_alike_they_go_on_together():
    even = rendered(Goal(64), 0, noise=np.full_like(NOISE, 0.3), fireflies=np.zeros_like(FIREFLIES))
    assert (even.counts == 64).all()


def test_a_threshold_tells_how_many_samples_are_needed():
    inside, quiet = X > 48, X < 20
    for threshold, most in ((2.0, 32), (0.1, 200), (0.05, 500)):
        picture = rendered(Goal(4096, threshold=threshold), 1, fireflies=np.zeros_like(FIREFLIES))
        taken = picture.counts[inside].mean()
        # Half of the difference of halves has the deviation of the mean.
        other = TRUTH + NOISE / np.sqrt(picture.counts) * np.random.default_rng(2).standard_normal(TRUTH.shape)
        truth, other = (np.repeat(each[..., None], 3, axis=2) for each in (TRUTH, other))
        error = np.sqrt(np.square(rates.cycles_error(truth, other))[inside].mean())
        # As far from it as pixels are that Cycles stops by chance.
        assert taken <= most and error < 2.5 * threshold
        assert picture.counts[quiet].max() <= max(taken / 2, 24)


def test_samples_that_take_long_are_fewer():
    for speeds, near in ((np.ones_like(NOISE), 0.1), (np.where(NOISE > 0.1, 5.0, 1.0), 0.2)):
        picture = Noise(0, fireflies=np.zeros_like(FIREFLIES), speed=speeds, is_timed=False)
        finished(Goal(64), picture, is_weighed=True)
        as_many = picture.costs.at_once * 64
        assert 0.5 < picture.costs.at_once < 1.0
        assert (picture.counts * speeds).sum() == pytest.approx(as_many * speeds.sum(), rel=near)


def test_what_is_denoised_is_judged_by_where_most_noise_is():
    """A few squares of it are worth rates for a denoiser only; where all err alike, they are for neither."""
    noise = np.where(X > 60, 0.28, 0.1)
    for truth, wanted in ((noise, [64, 32]), (np.full_like(noise, 0.1), [64, 64])):
        least = [
            rendered(Goal(64, worth=worth), 0, noise=truth, fireflies=np.zeros_like(FIREFLIES)).counts.min()
            for worth in (rounds.NOISY, rounds.NOISY._replace(rise=rounds.DENOISED.rise))
        ]
        assert least == wanted


@pytest.mark.parametrize("call", [1e-6, 1.0], ids=["quick calls", "slow calls"])
def test_of_more_threads_a_call_takes_as_long_as_more_samples(call):
    """All of them wait for what one does."""
    few, many = Counted(SIZE), Counted(SIZE, 32)
    for costs in (few, many):
        costs.weigh(call, SAMPLE, np.zeros((HEIGHT, WIDTH), bool))
    assert many.call == 16 * few.call
    assert few.call >= call / SAMPLE / 2


@pytest.mark.parametrize("goal", [Goal(1024, threshold=0.0), Goal(24, threshold=1e-6), Goal(20, threshold=0.0)])
def test_no_pixel_takes_more_than_the_most(goal):
    assert (rendered(goal, 0).counts == goal.samples).all()


@pytest.mark.parametrize(("least", "most"), [(64, 256), (150, 200), (300, 200)])
def test_least_samples_are_taken(least, most):
    counts = rendered(Goal(most, threshold=10.0, least=least), 0).counts
    assert min(least, most) <= counts.min() <= counts.max() <= most


@pytest.mark.parametrize("speed", [0.3, 1.0, 3.0])
def test_a_time_limit_is_used_and_kept(speed):
    seconds = SAMPLE * 100 * WIDTH * HEIGHT
    spent = [rendered(Goal(4096, seconds=seconds), seed, speed=speed).seconds for seed in range(4)]
    assert max(spent) <= 1.05 * seconds and min(spent) > 0.7 * seconds


@pytest.mark.parametrize("samples", [0.5, 1.0, 3.0, 9.0])
def test_a_short_time_gives_a_complete_picture(samples):
    seconds = SAMPLE * samples * WIDTH * HEIGHT
    picture = rendered(Goal(4096, seconds=seconds), 0)
    assert picture.counts.min() == picture.counts.max() >= max(1, int(0.6 * samples))
    assert picture.seconds <= max(1.05 * seconds, 1.1 * SAMPLE * WIDTH * HEIGHT)


@pytest.mark.parametrize("samples", [1, 2, 3, 4, 5, 7])
def test_few_samples_are_taken_by_all(samples):
    assert rendered(Goal(samples), 0).counts.mean() == pytest.approx(samples, rel=0.3)


def test_pixels_that_are_not_finite_decide_nothing():
    picture = Noise(0, is_timed=False)
    picture.sums[3, 5], picture.sums[20, 60] = np.nan, np.inf
    finished(Goal(64, worth=rounds.DENOISED), picture)
    assert 16 <= picture.counts.min() < picture.counts.max()


@pytest.mark.parametrize("goal", [Goal(64), Goal(64, threshold=0.01), Goal(64, seconds=1.0)])
def test_black_frames_end(goal):
    picture = Noise(0, is_timed=goal.seconds is not None)
    picture._sum = lambda part, count: np.zeros(picture.counts[part].shape)
    finished(goal, picture)
    assert picture.counts.min() >= FEWEST and picture.counts.max() <= goal.most


def test_rectangles_cover_exactly_what_is_wanted():
    squares = Squares((37, 21), 8)
    wanted = np.random.default_rng(3).random(squares.areas.shape) < 0.5
    covered = np.zeros((21, 37), int)
    for left, bottom, width, height in squares.rectangles(wanted):
        covered[bottom : bottom + height, left : left + width] += 1
    assert (covered == wanted.repeat(8, axis=0).repeat(8, axis=1)[:21, :37]).all()
