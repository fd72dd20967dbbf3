# SPDX-License-Identifier: GPL-3.0-or-later
"""Beside bright things and on a film that is seen through, ours is no worse than Cycles and of its range."""

import bpy
import numpy as np
import pytest
from scipy.ndimage import distance_transform_edt

from tests import rendering

#: Settings of ours, samples a pixel, and whether it is denoised.
WAYS = {
    "rounds": ({}, 16, False),
    "rounds, denoised": ({}, 16, True),
    "gather": ({"method": "GATHER"}, 4, False),
    "gather, denoised": ({"method": "GATHER"}, 4, True),
}


def prepared(scene, way):
    """Set a scene to one of the ways; return its samples."""
    settings, samples, scene.cycles.use_denoising = WAYS[way]
    for name, value in settings.items():
        setattr(scene.spectral_tiles, name, value)
    return samples


@pytest.mark.parametrize("way", WAYS)
def test_no_halo_round_a_bright_disc(tmp_path, way):
    """White on a dark ground under three lamps: neither side becomes worse, near the edge or far from it."""
    scene = rendering.empty_scene(160, 96)
    rendering.add_plane(30, rendering.diffuse((0.01, 0.01, 0.01)))
    angles = np.linspace(0, 2 * np.pi, 64, endpoint=False)
    mesh = bpy.data.meshes.new("Disc")
    mesh.from_pydata([(1.5 * np.cos(a), 1.5 * np.sin(a), 0.02) for a in angles], [], [tuple(range(64))])
    mesh.materials.append(rendering.diffuse((0.8, 0.8, 0.8)))
    rendering.add(mesh)
    for x, y in ((-3, 1), (3, 1.5), (0, -3)):
        rendering.add_light("POINT", 300, (x, y, 4), shadow_soft_size=0.3)
    rendering.add_camera((0, 0, 10))
    truth = rendering.beauty(rendering.render(tmp_path, "CYCLES", 512, seed=99))
    samples = prepared(scene, way)
    errors = {
        engine: np.square(rendering.stack(tmp_path, engine, range(6), samples) - truth).mean(axis=(0, 3))
        for engine in rendering.ENGINES
    }
    bright = truth[..., 1] > 0.5 * truth[..., 1].max()
    away = distance_transform_edt(truth[..., 1] < 0.03 * truth[..., 1].max())
    for part in ((away >= 2) & (away <= 12), away > 20, bright):
        ours, native = (errors[engine][part].mean() for engine in ("SPECTRAL_TILES", "CYCLES"))
        assert ours <= 1.15 * native


@pytest.mark.parametrize("way", WAYS)
def test_alpha_stays_in_range_and_colour_follows_it(tmp_path, way):
    """Transparent film, and a ball that moves across it under two lamps."""
    scene = rendering.empty_scene(96, 64)
    scene.render.film_transparent = scene.render.use_motion_blur = True
    bpy.ops.mesh.primitive_uv_sphere_add(radius=1.5)
    ball = bpy.context.object
    ball.data.materials.append(rendering.diffuse())
    rendering.slide(ball, (-2, 0, 0), (2, 0, 0))
    for x in (-3, 3):
        rendering.add_light("POINT", 300, (x, 1, 4), shadow_soft_size=0.3)
    rendering.add_camera((0, 0, 10))
    samples = prepared(scene, way)
    picture = rendering.render(tmp_path, "SPECTRAL_TILES", samples)["ViewLayer.Combined"]
    alpha = picture[..., 3]
    assert alpha.min() >= 0.0 and alpha.max() <= 1.0 + 1e-6 and 0.2 < (alpha > 0.0).mean() < 1.0
    assert (picture[..., :3] >= 0.0).all()
    if not scene.cycles.use_denoising:  # which spreads light over what is empty, as Cycles' own does
        assert not picture[alpha == 0.0].any()
