# SPDX-License-Identifier: GPL-3.0-or-later
"""What the random numbers explain is taken out of a picture, and nothing else."""

import os
import tracemalloc

import bpy
import numpy as np
import pytest

from addon.cycles.scene_analysis import SceneUse
from addon.picture import control_variates
from addon.plan import arranged_plan, modes
from tests import rendering

USE = SceneUse(motion_blur=True, lens=False, lights=2, bounces=False, glow=False)
HEIGHT, WIDTH = 96, 83


@pytest.fixture(scope="module")
def chosen():
    return list(arranged_plan.error_modes(tuple(arranged_plan.shares(USE)), 1, 8))


def drawn(seed, samples=1, height=HEIGHT, width=WIDTH):
    """Independent random bytes for every pixel."""
    names = ("t", "light.u", "light.v", "light.pick")
    rng = np.random.default_rng(seed)
    return {name: rng.integers(0, 256, (samples, height, width), np.uint8) for name in names}


def repeated(numbers, period):
    """The first ones again after so many pixels; 0 leaves them."""
    y, x = np.mgrid[:HEIGHT, :WIDTH]
    return {name: byte[:, y % period, x % period] if period else byte for name, byte in numbers.items()}


def cleaned(planes, numbers, chosen, period=0, taken=None):
    return control_variates.without_noise(
        planes, lambda pixels, _: {n: b[:, *pixels] for n, b in numbers.items()}, chosen, period, taken
    )


def content():
    """A picture with slopes, an edge and a texture."""
    y, x = np.mgrid[:HEIGHT, :WIDTH].astype(np.float32)
    return np.stack([1 + 0.01 * x + (x > 40), 2 + np.sin(y / 3), 1 + (x.astype(int) ^ y.astype(int)) % 3])


@pytest.mark.parametrize("samples", [1, 3])
def test_explained_noise_goes_and_the_rest_stays(chosen, samples):
    """Half of the variance follows one mode; with 900 pixels around that say so, nearly all of that half goes."""
    numbers = drawn(1, samples)
    wave = modes.waves([(("t", 1),)], numbers)[0]
    white = np.random.default_rng(2).normal(size=(3, HEIGHT, WIDTH)) * wave.std()
    truth = np.ones((3, HEIGHT, WIDTH))
    noisy = (truth + wave + white).astype(np.float32)
    left = ((cleaned(noisy, numbers, chosen) - truth) ** 2).mean() / ((noisy - truth) ** 2).mean()
    assert 0.49 < left < 0.54


def test_numbers_that_repeat(chosen):
    """Blocks with other numbers tell what goes; where there are none, nobody does."""
    numbers = repeated(drawn(1), 16)
    wave = modes.waves([(("t", 1),)], numbers)[0][None].astype(np.float32)
    assert cleaned(wave, numbers, chosen, 16).var() < 0.15 * wave.var()
    assert control_variates.of_picture(USE, None, 8) is None


def test_blocks_do_not_listen_to_their_own_numbers(chosen):
    """Noise that every second block shows, with the same numbers each time, says nothing of itself."""
    y, x = np.mgrid[:HEIGHT, :WIDTH]
    shown = (y % 16 < 8) & (x % 16 < 8)
    left = {0: [], 16: []}
    for seed in range(8):
        numbers = repeated(drawn(seed), 16)
        wave = modes.waves([(("t", 1),)], numbers)[0]
        noise = np.random.default_rng(seed).normal(size=wave.shape) * wave.std()
        picture = np.where(shown, wave, noise)[None].astype(np.float32)
        for period, ratios in left.items():
            ratios.append(cleaned(picture, numbers, chosen, period)[0][shown].var() / wave[shown].var())
    assert np.mean(left[0]) < 0.9
    assert np.mean(left[16]) == pytest.approx(1.0, abs=0.03)


def test_noise_that_repeats_is_not_taken_for_explained(chosen):
    """The same in every period, of whatever the modes do not tell."""
    y, x = np.mgrid[:HEIGHT, :WIDTH]
    ratios = []
    for seed in range(20):
        noise = np.random.default_rng(seed).normal(size=(1, 16, 16))[:, y % 16, x % 16].astype(np.float32)
        ratios.append(cleaned(1 + noise, repeated(drawn(seed), 16), chosen, 16).var() / noise.var())
    assert np.mean(ratios) < 1.03


def test_only_some_pixels_are_meant(chosen, monkeypatch):
    """Half of the pixels, here and there, and none in one part; the others are noisier, and their numbers say so."""
    monkeypatch.setattr(control_variates, "_TOGETHER", 16 * WIDTH)
    taken = np.random.default_rng(3).random((HEIGHT, WIDTH)) < 0.5
    taken[:40] = False
    numbers = drawn(1)
    wave = modes.waves([(("t", 1),)], numbers)[0]
    picture = np.where(taken, 1.0 + wave, 1.0 - 3.0 * wave)[None].astype(np.float32)
    left = cleaned(picture, numbers, chosen, taken=taken)[0]
    assert np.array_equal(left[~taken], picture[0][~taken])
    assert left[taken].var() < 0.1 * picture[0][taken].var()


@pytest.mark.parametrize("columns", [slice(0, 0), slice(7, 8), slice(WIDTH - 2, WIDTH)])
def test_few_pixels_tell_nothing(chosen, columns):
    """None at all, one of a block, some of those that a survey's tiles leave over."""
    numbers = drawn(1)
    picture = 1.0 + modes.waves([(("t", 1),)], numbers).astype(np.float32)
    taken = np.zeros((HEIGHT, WIDTH), bool)
    taken[7, columns] = True
    with np.errstate(all="raise"):
        assert np.array_equal(cleaned(picture, numbers, chosen, taken=taken), picture)


def test_a_picture_without_noise_is_left_alone(chosen):
    picture = content().astype(np.float32)
    for seed in range(5):
        assert np.array_equal(cleaned(picture, drawn(seed), chosen), picture)


def test_quiet_parts_stay_quiet(chosen):
    """Beside a noisy half, a half without noise gets none of it."""
    numbers = drawn(3)
    wave = modes.waves([(("t", 1),)], numbers)[0]
    picture = np.ones((1, HEIGHT, WIDTH), np.float32)
    picture[:, :, :40] += wave[:, :40]
    changed = cleaned(picture, numbers, chosen) - picture
    assert np.abs(changed[:, :, :40]).max() > 0.5
    assert np.array_equal(changed[:, :, 47:], np.zeros_like(changed[:, :, 47:]))


def test_one_bright_sample_does_not_spread(chosen):
    numbers = drawn(4)
    picture = (1 + 0.1 * np.random.default_rng(5).normal(size=(1, HEIGHT, WIDTH))).astype(np.float32)
    picture[0, 50, 30] = 1000.0
    changed = np.abs(cleaned(picture, numbers, chosen) - picture)
    changed[0, 43:58, 23:38] = 0.0
    assert changed.max() < 0.1


@pytest.mark.parametrize("value", [1e30, np.inf, -np.inf, np.nan])
def test_what_is_no_brightness_stays_where_it_is(chosen, value):
    """Passes may hold anything; the pixels around are not spoilt by it."""
    picture = (1 + 0.1 * np.random.default_rng(5).normal(size=(1, HEIGHT, WIDTH))).astype(np.float32)
    picture[0, 50, 30] = value
    with np.errstate(all="raise"):
        left = cleaned(picture, drawn(4), chosen)
    assert np.array_equal(left[0, 50, 30], picture[0, 50, 30], equal_nan=True)
    left[0, 43:58, 23:38] = 1.0
    assert np.abs(left - 1.0).max() < 1.0


@pytest.mark.parametrize("period", [0, 16])
def test_the_mean_over_many_pictures_stays(chosen, period):
    """Noise that depends on the numbers in a bent way, over content, keeps its mean at every pixel."""
    truth, count = content(), 400
    total = np.zeros_like(truth)
    squares = np.zeros_like(truth)
    for seed in range(count):
        numbers = repeated(drawn(seed), period)
        t, u = numbers["t"][0] / 255.0, numbers["light.u"][0] / 255.0
        # Mean 1, far from symmetric: mostly dark, seldom bright.
        factor = 3.0 * t**2 + 4.0 * (u**3 - 0.25)
        error = cleaned((truth * factor).astype(np.float32), numbers, chosen, period) - truth
        total += error
        squares += error**2
    standard_error = np.sqrt(squares) / count
    # 24,000 pixels: five standard errors for the worst; and their mean is as good as zero.
    byte_steps = 0.01  # a byte's steps move the means of t**2 and u**3
    assert (np.abs(total / count) < 5.0 * standard_error + byte_steps * truth).all()


@pytest.mark.parametrize(("width", "height"), [(1, 1), (5, 3), (8, 8), (130, 2)])
def test_any_size(chosen, width, height):
    numbers = {name: byte[:, :1, :1].repeat(height, 1).repeat(width, 2) for name, byte in drawn(6).items()}
    picture = np.random.default_rng(7).random((4, height, width), np.float32)
    result = cleaned(picture, numbers, chosen)
    assert result.shape == picture.shape
    assert np.isfinite(result).all()


@pytest.mark.parametrize("driver", ["GATHER", "IN_PLACE", "SUBRENDER"])
def test_renders_are_closer_to_the_truth(tmp_path, driver):
    """A floor under two lamps: which is chosen makes most of the noise, and that goes."""
    scene = rendering.empty_scene(64, 64)
    scene.spectral_tiles.driver = driver
    rendering.add_camera((0, 0, 5))
    rendering.add_plane(20, rendering.diffuse())
    rendering.add_light("AREA", 100, (-2, 0, 3), size=0.5)
    rendering.add_light("AREA", 300, (2, 0, 3), size=0.5)
    scene.cycles.max_bounces = 0
    truth = rendering.beauty(rendering.render(tmp_path, "CYCLES", samples=256))
    errors = {}
    for switched_on in (False, True):
        bpy.context.scene.spectral_tiles.control_variates = switched_on
        pictures = rendering.stack(tmp_path, "SPECTRAL_TILES", range(4))
        errors[switched_on] = ((pictures - truth) ** 2).mean()
    assert errors[True] < 0.5 * errors[False]


def test_large_pictures_are_worked_at_in_parts(chosen, monkeypatch):
    """What two processors work at takes little beside the result's 4 bytes a pixel and plane."""
    monkeypatch.setattr(os, "process_cpu_count", lambda: 2)
    monkeypatch.setattr(control_variates, "_TOGETHER", 2**11)
    monkeypatch.setattr(control_variates, "_TILES_TOGETHER", 1)
    numbers = drawn(8, height=4096, width=64)
    wave = modes.waves([(("t", 1),)], numbers)[0]
    picture = np.stack([1 + wave, 2 + wave])

    tracemalloc.start()
    left = cleaned(picture, numbers, chosen)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert left[0].std() < 0.2 * picture[0].std()
    assert peak <= 2 * picture.nbytes
