# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np
import pytest

from bench.flicker import Effort, flicker
from bench.jobs import FILM_SEED
from bench.metrics import Reference

SHAPE = (96, 96, 3)


@pytest.fixture
def chance():
    return np.random.default_rng(1)


@pytest.fixture
def film(chance):
    """Converged frames of something that moves."""
    frames = [np.roll(chance.random(SHAPE), 3 * i, axis=1) for i in range(4)]
    return [Reference(frame, frame) for frame in frames]


def _noise(chance, scale):
    # The same in all channels, so that its luminance is as strong as its colour.
    return np.repeat(chance.normal(scale=scale, size=(*SHAPE[:2], 1)), 3, axis=-1)


def test_what_moves_does_not_flicker(film):
    assert flicker([each.mean for each in film], film, 1) == 0


def test_an_error_that_stays_does_not_flicker(chance, film):
    error = _noise(chance, 1.0)
    assert flicker([each.mean + error for each in film], film, 1) == pytest.approx(0, abs=1e-12)


def test_independent_errors_flicker_by_twice_their_variance(chance, film):
    frames = [each.mean + _noise(chance, 0.1) for each in film]
    assert flicker(frames, film, 0) == pytest.approx(2 * 0.1**2, rel=0.05)


def test_noise_of_references_does_not_count(chance, film):
    noisy = [Reference(*(each.mean + _noise(chance, 0.1) for _ in range(2))) for each in film]
    assert flicker([each.mean for each in film], noisy, 0) == pytest.approx(0, abs=0.002)


def test_films_of_other_seeds_share_no_image():
    effort = Effort(frames=8)
    assert effort.images(0) == list(range(9, 17))
    assert not {*effort.images(0)} & {*effort.images(1)}
    assert {number % FILM_SEED for number in effort.images(70)} == {*effort.images(0)}


def test_users_settings_are_the_default_and_can_be_changed():
    options = Effort(options=(("method", "IN_PLACE"), ("distribution", "EVEN"))).settings("moving").options
    assert dict(options) == {"distribution": "EVEN", "method": "IN_PLACE"}
    assert dict(Effort().settings("at_rest").options) == {"distribution": "BY_NOISE"}
