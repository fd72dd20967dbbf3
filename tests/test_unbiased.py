# SPDX-License-Identifier: GPL-3.0-or-later
"""Samples by noise, in the demo scenes and over many seeds: their mean is Cycles' own picture, everywhere."""

from pathlib import Path

import bpy
import numpy as np
import pytest

import demo_blend
from addon.drivers import rounds as driver
from addon.plan import costs, rounds
from tests import rendering

SEEDS = 96
NATIVE_SEEDS, NATIVE_SAMPLES = 12, 256
WIDTH, HEIGHT = 64, 36

#: Samples in the mean, or the most with a noise threshold.
SCENES = {
    "interior": (16, None),
    "glossy_reflection": (128, 0.05),
    "moving_penumbra": (16, None),
    "round_lens": (128, 0.05),
    "spinning_wheels": (16, None),
    "square_lens": (128, 0.05),
}


def luminance(pixels):
    return np.clip(pixels[..., :3] @ (0.2126, 0.7152, 0.0722), 0.0, 100.0)


def regions(truth):
    """Edges, the brightest and the darkest parts, and all."""
    steepness = np.hypot(*np.gradient(truth))
    return {
        "all": np.ones(truth.shape, bool),
        "edges": steepness >= np.quantile(steepness, 0.9),
        "bright": truth >= np.quantile(truth, 0.9),
        "dark": truth <= np.quantile(truth, 0.5),
    }


@pytest.mark.fuzz
@pytest.mark.parametrize("name", SCENES)
def test_samples_by_noise_are_unbiased(extension, tmp_path, monkeypatch, name):
    monkeypatch.setattr(driver.Growing, "weigh", lambda growing: True)
    monkeypatch.setattr(costs, "_CALL", 4)
    bpy.ops.wm.open_mainfile(filepath=str(Path(demo_blend.__file__).with_name(f"{name}.blend")), load_ui=False)
    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = WIDTH, HEIGHT, 100
    scene.cycles.use_denoising, scene.cycles.time_limit = False, 0.0
    # Cycles takes a pixel's first sample in its middle, so with a wider filter its own mean depends on their number.
    scene.cycles.pixel_filter_type, scene.cycles.filter_width = "GAUSSIAN", 0.01
    scene.render.use_persistent_data = True
    samples, threshold = SCENES[name]

    def picture(engine, count, seed):
        return luminance(rendering.beauty(rendering.render(tmp_path, engine, count, seed)))

    scene.cycles.use_adaptive_sampling = False
    # Parts are told by a picture that has no say in the mean.
    parts = regions(picture("CYCLES", NATIVE_SAMPLES, 999))
    native = np.array([picture("CYCLES", NATIVE_SAMPLES, seed) for seed in range(1000, 1000 + NATIVE_SEEDS)])
    scene.cycles.use_adaptive_sampling = threshold is not None
    if threshold is not None:
        scene.cycles.adaptive_threshold, scene.cycles.adaptive_min_samples = threshold, 0
    spread = []
    planned = rounds._planned

    def watched(*given):
        levels = planned(*given)
        spread.append(levels.max() - levels.min())
        return levels

    monkeypatch.setattr(rounds, "_planned", watched)
    ours = np.array([picture("SPECTRAL_TILES", samples, seed) for seed in range(SEEDS)])
    assert max(spread, default=0) > 0, "all pixels take the same samples, so nothing is tested"
    for part, where in parts.items():
        mean, truth = (pictures[:, where].mean(axis=1) for pictures in (ours, native))
        chance = np.sqrt(mean.var(ddof=1) / len(mean) + truth.var(ddof=1) / len(truth))
        error = mean.mean() - truth.mean()
        assert abs(error) < 4.0 * chance + 1e-4 * truth.mean(), f"{part}: {error / truth.mean():.2%} of the light"
