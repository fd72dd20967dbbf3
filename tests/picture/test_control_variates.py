# SPDX-License-Identifier: GPL-3.0-or-later
"""What the random numbers explain is taken out of a picture, and nothing else."""

import os
import tracemalloc

import bpy
import numpy as np
import pytest
from scipy.ndimage import distance_transform_edt

from addon.blender.region import Region
from addon.cycles.scene_analysis import SceneUse
from addon.picture import control_variates
from addon.plan import arranged_plan, modes, sample_plan
from tests import rendering

USE = SceneUse(motion_blur=True, lens=False, lights=2, bounces=False, glow=False)
HEIGHT, WIDTH = 96, 83


@pytest.fixture(scope="module")
def chosen():
    return list(arranged_plan.error_modes(tuple(arranged_plan.shares(USE)), 1, 8, 256))


def drawn(seed, samples=1, height=HEIGHT, width=WIDTH):
    """Independent random bytes for every pixel."""
    names = ("t", "light.u", "light.v", "light.pick")
    rng = np.random.default_rng(seed)
    return {name: rng.integers(0, 256, (samples, height, width), np.uint8) for name in names}


def cleaned(light, numbers, chosen, opacity=None):
    """One pass of three channels without its explained noise."""
    return control_variates.without_noise(
        [light], opacity, lambda pixels, _: {n: b[:, *pixels] for n, b in numbers.items()}, chosen
    )[0]


def grey(plane):
    return np.repeat(plane[None], 3, axis=0).astype(np.float32)


def wave_of(numbers):
    return modes.waves([(("t", 1),)], numbers)[0]


def content():
    """A picture with slopes, an edge and a texture; its channels differ."""
    y, x = np.mgrid[:HEIGHT, :WIDTH].astype(np.float32)
    shade = (1 + 0.01 * x + (x > 40)) * (2 + np.sin(y / 3)) * (1 + (x.astype(int) // 6 ^ y.astype(int) // 6) % 3)
    return (shade * [[[1.0]], [[0.7]], [[0.2]]]).astype(np.float32)


@pytest.mark.parametrize("samples", [1, 3])
def test_explained_noise_goes_and_the_rest_stays(chosen, samples):
    """Half of the variance follows one mode; with 900 pixels around that say so, nearly all of that half goes."""
    numbers = drawn(1, samples)
    wave = wave_of(numbers)
    white = np.random.default_rng(2).normal(size=(HEIGHT, WIDTH)) * wave.std()
    noisy = grey(1.0 + wave + white)
    left = np.square(cleaned(noisy, numbers, chosen) - 1.0).mean() / np.square(noisy - 1.0).mean()
    assert 0.49 < left < 0.56


def test_a_picture_without_noise_is_left_alone(chosen):
    picture = np.ones((3, HEIGHT, WIDTH), np.float32)
    picture[:, :, 40:] = 0.125
    for seed in range(5):
        assert np.array_equal(cleaned(picture, drawn(seed), chosen), picture)


def test_noise_of_other_numbers_is_left_alone(chosen):
    """Content and white noise: next to nothing is taken for explained."""
    for seed in range(5):
        white = np.random.default_rng(seed).normal(size=(HEIGHT, WIDTH))
        picture = (content() * (1 + 0.3 * white)).astype(np.float32)
        changed = cleaned(picture, drawn(100 + seed), chosen) - picture
        assert np.square(changed).mean() < 0.01 * np.square(picture - content()).mean()


def test_quiet_parts_stay_quiet(chosen):
    """Beside a noisy half, a half without noise gets none of it, not even at the edge."""
    numbers = drawn(3)
    picture = np.ones((HEIGHT, WIDTH))
    picture[:, :40] += wave_of(numbers)[:, :40]
    picture = grey(picture)
    changed = cleaned(picture, numbers, chosen) - picture
    assert np.abs(changed[:, :, :40]).max() > 0.5
    assert not changed[:, :, 40:].any()


def test_each_side_of_an_edge_has_its_own_noise(chosen):
    """A bright disc on a dark ground, noise in proportion, a slanted edge all round: both sides lose their own."""
    numbers = drawn(3)
    y, x = np.mgrid[:HEIGHT, :WIDTH]
    bright = np.hypot(y - 48, x - 40) < 25
    truth = np.where(bright, 1.0, 0.01)
    picture = grey(truth * (1.0 + 0.5 * wave_of(numbers)))
    left = np.square(cleaned(picture, numbers, chosen) - truth)[0] / np.square(picture - truth)[0].mean()
    before = np.square(picture - truth)[0] / np.square(picture - truth)[0].mean()
    for side in (bright, ~bright):
        assert left[side].mean() < 0.2 * before[side].mean()


def test_what_is_subtracted_has_the_colour_of_the_side(chosen):
    """Of noise in the brightness of a colour nothing is left in another one."""
    numbers = drawn(3)
    colour = np.float32([[[0.8]], [[0.4]], [[0.1]]])
    picture = colour * grey(1.0 + 0.5 * wave_of(numbers))
    left = cleaned(picture, numbers, chosen)
    assert left.std() < picture.std()
    np.testing.assert_allclose((left / colour)[1:], (left / colour)[:1].repeat(2, 0), rtol=1e-3)


def test_noise_on_a_film_that_is_seen_through_stays(chosen):
    """Where a pixel or one next to it is not opaque, neither colour comes where there is none nor does any go."""
    numbers = drawn(3)
    opacity = np.ones((HEIGHT, WIDTH), np.float32)
    opacity[:, 40:] = np.random.default_rng(1).random((HEIGHT, WIDTH - 40)) < 0.5
    picture = opacity * grey(1.0 + 0.5 * wave_of(numbers))
    changed = cleaned(picture, numbers, chosen, opacity) - picture
    assert changed[:, :, :39].any()
    assert not changed[:, opacity == 0.0].any()


def test_one_bright_sample_does_not_spread(chosen):
    """White under a firefly: pixels next to it change no more than others."""
    numbers = drawn(4)
    picture = 1 + 0.1 * wave_of(numbers) + 0.1 * np.random.default_rng(5).normal(size=(HEIGHT, WIDTH))
    picture[50, 30] = 1000.0
    changed = np.abs(cleaned(grey(picture), numbers, chosen) - grey(picture))
    assert changed.max() < 0.5


@pytest.mark.parametrize("value", [1e30, np.inf, -np.inf, np.nan])
def test_what_is_no_brightness_stays_where_it_is(chosen, value):
    """Passes may hold anything; the pixels around are not spoilt by it."""
    picture = grey(1 + 0.1 * wave_of(drawn(4)))
    picture[:, 50, 30] = value
    with np.errstate(all="raise", under="ignore"):
        left = cleaned(picture, drawn(4), chosen)
    assert np.array_equal(left[:, 50, 30], picture[:, 50, 30], equal_nan=True)
    left[:, 50, 30] = 1.0
    assert np.abs(left - 1.0).max() < 1.0


def test_the_mean_over_many_pictures_stays(chosen):
    """Noise that depends on the numbers in a bent way, over content, keeps its mean at every pixel."""
    truth, count = content(), 400
    total = np.zeros_like(truth)
    squares, change = np.zeros_like(truth), np.zeros_like(truth)
    for seed in range(count):
        numbers = drawn(seed)
        t, u = numbers["t"][0] / 255.0, numbers["light.u"][0] / 255.0
        # Mean 1, far from symmetric: mostly dark, seldom bright.
        factor = 3.0 * t**2 + 4.0 * (u**3 - 0.25)
        error = cleaned((truth * factor).astype(np.float32), numbers, chosen) - truth
        change += error - truth * (factor - 1.0)
        total += error
        squares += error**2
    standard_error = np.sqrt(squares) / count
    # 24,000 pixels: five standard errors for the worst; and their mean is as good as zero.
    byte_steps = 0.01  # a byte's steps move the means of t**2 and u**3
    assert (np.abs(total / count) < 5.0 * standard_error + byte_steps * truth).all()
    assert abs((change / count / truth).mean()) < 0.002


@pytest.mark.parametrize(("width", "height"), [(0, 0), (1, 1), (5, 3), (8, 8), (130, 2), (70, 67)])
def test_any_size(chosen, width, height):
    numbers = drawn(6, height=max(height, 1), width=max(width, 1))
    picture = np.random.default_rng(7).random((3, height, width), np.float32)
    with np.errstate(all="raise", under="ignore"):
        result = cleaned(picture, numbers, chosen)
    assert result.shape == picture.shape
    assert np.isfinite(result).all()


def test_parts_are_worked_at_as_the_whole(chosen, monkeypatch):
    """Several bands of rows give what one gives."""
    numbers = drawn(8)
    picture = content() * grey(1 + 0.5 * wave_of(numbers))
    whole = cleaned(picture, numbers, chosen)
    monkeypatch.setattr(control_variates, "_TOGETHER", 16 * WIDTH)
    np.testing.assert_allclose(cleaned(picture, numbers, chosen), whole, atol=1e-4)


def test_large_pictures_are_worked_at_in_parts(chosen, monkeypatch):
    """What two processors work at takes little beside the result's 12 bytes a pixel and pass."""
    monkeypatch.setattr(os, "process_cpu_count", lambda: 2)
    monkeypatch.setattr(control_variates, "_TOGETHER", 2**11)
    numbers = drawn(8, height=8192, width=64)
    picture = grey(1 + wave_of(numbers))

    tracemalloc.start()
    left = cleaned(picture, numbers, chosen)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert left[0].std() < 0.2 * picture[0].std()
    assert peak <= 2 * picture.nbytes


def in_place(scene_use, seed, samples, passes):
    """A picture of Cycles, (height, width, 4) with rows from the bottom, without the noise that its numbers explain."""
    height, width, _ = passes.shape
    region = Region((width, height), (0, 0), (width, height))
    ranks = sample_plan.Plan.in_place(seed, region).ranks_at_film(region)
    candidates = list(arranged_plan.error_modes(tuple(arranged_plan.shares(scene_use)), samples, 32, 256))
    planes = np.ascontiguousarray(passes.transpose(2, 0, 1), np.float32)

    def numbers(pixels, chosen):
        return arranged_plan.numbers(chosen, ranks[pixels], samples, samples)

    clean = control_variates.without_noise([planes[:3]], planes[3], numbers, candidates)
    return np.concatenate([clean[0], planes[3:]]).transpose(1, 2, 0)


def of_cycles(folder, seed, samples):
    """Cycles' picture by the numbers that are known, rows from the bottom."""
    bpy.context.scene.cycles.sampling_pattern = "BLUE_NOISE"
    return rendering.beauty(rendering.render(folder, "CYCLES", samples, seed))[::-1]


@pytest.mark.parametrize("samples", [1, 4])
def test_no_halo_round_a_bright_disc(tmp_path, samples):
    """White on a dark ground under three lamps: neither side becomes worse, near the edge or far from it."""
    rendering.empty_scene(160, 96)
    rendering.add_plane(30, rendering.diffuse((0.01, 0.01, 0.01)))
    angles = np.linspace(0, 2 * np.pi, 64, endpoint=False)
    mesh = bpy.data.meshes.new("Disc")
    mesh.from_pydata([(1.5 * np.cos(a), 1.5 * np.sin(a), 0.02) for a in angles], [], [tuple(range(64))])
    mesh.materials.append(rendering.diffuse((0.8, 0.8, 0.8)))
    rendering.add(mesh)
    for x, y in ((-3, 1), (3, 1.5), (0, -3)):
        rendering.add_light("POINT", 300, (x, y, 4), shadow_soft_size=0.3)
    rendering.add_camera((0, 0, 10))
    use = SceneUse(motion_blur=False, lens=False, lights=3, bounces=True, glow=False)
    truth = of_cycles(tmp_path, 99, 512)
    noisy = [of_cycles(tmp_path, seed, samples) for seed in range(4)]
    before = np.mean([np.square(picture - truth)[..., :3] for picture in noisy], axis=(0, 3))
    left = [np.square(in_place(use, seed, samples, picture) - truth)[..., :3] for seed, picture in enumerate(noisy)]
    left = np.mean(left, axis=(0, 3))
    bright = truth[..., 1] > 0.5 * truth[..., 1].max()
    away = distance_transform_edt(truth[..., 1] < 0.03 * truth[..., 1].max())
    for part, most in (((away >= 2) & (away <= 12), 0.4), (away > 20, 0.4), (bright, 0.4)):
        assert left[part].mean() <= most * before[part].mean()


def test_alpha_stays_in_range_and_colour_follows_it(tmp_path):
    """Transparent film, and a ball that moves across it under two lamps."""
    scene = rendering.empty_scene(96, 64)
    scene.render.film_transparent = True
    scene.render.use_motion_blur = True
    bpy.ops.mesh.primitive_uv_sphere_add(radius=1.5)
    ball = bpy.context.object
    ball.data.materials.append(rendering.diffuse())
    rendering.slide(ball, (-2, 0, 0), (2, 0, 0))
    for x in (-3, 3):
        rendering.add_light("POINT", 300, (x, 1, 4), shadow_soft_size=0.3)
    rendering.add_camera((0, 0, 10))
    picture = of_cycles(tmp_path, 0, 1)
    left = in_place(SceneUse(True, False, 2, True, False), 0, 1, picture)
    assert np.abs(left - picture).max() > 0.01
    assert np.array_equal(left[..., 3], picture[..., 3].astype(np.float32))
    assert not left[left[..., 3] == 0.0].any()


@pytest.mark.parametrize("method", ["GATHER", "IN_PLACE"])
def test_renders_are_closer_to_the_truth(tmp_path, method):
    """A floor under two lamps: which is chosen makes most of the noise, and that goes."""
    scene = rendering.empty_scene(64, 64)
    scene.spectral_tiles.method = method
    rendering.add_camera((0, 0, 5))
    rendering.add_plane(20, rendering.diffuse())
    rendering.add_light("AREA", 100, (-2, 0, 3), size=0.5)
    rendering.add_light("AREA", 300, (2, 0, 3), size=0.5)
    scene.cycles.max_bounces = 0
    truth = rendering.beauty(rendering.render(tmp_path, "CYCLES", samples=256))
    errors = {}
    for switched_on in (False, True):
        scene.spectral_tiles.noise_reduction = switched_on
        pictures = rendering.stack(tmp_path, "SPECTRAL_TILES", range(4))
        errors[switched_on] = ((pictures - truth) ** 2).mean()
    assert errors[True] < 0.5 * errors[False]
