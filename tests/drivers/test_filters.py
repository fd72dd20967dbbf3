# SPDX-License-Identifier: GPL-3.0-or-later
"""Reconstruction filters: constants stay, edges have the filter's profile, expectations are native ones."""

import bpy
import numpy as np
import pytest

from addon.blender.region import Region
from addon.picture import reconstruction
from addon.picture.reconstruction import CUSTOMARY_WIDTHS, Filter, Reconstruction, positions
from tests import rendering


@pytest.mark.parametrize("kind", CUSTOMARY_WIDTHS)
@pytest.mark.parametrize("samples", [1, 3])
def test_constant_stays_constant_up_to_the_border(kind, samples):
    region = Region((40, 30), (0, 0), (40, 30))
    colour = np.array([0.2, 3.0, 1.0], np.float32)[:, None, None] * np.ones((30, 40), np.float32)
    sums = Reconstruction(Filter(kind, CUSTOMARY_WIDTHS[kind]), 3, 30, 40)
    for sample in range(samples):
        sums.add(colour, positions(region, sample, 5))
    assert np.allclose(sums.pixels(), colour, rtol=1e-4)


@pytest.mark.parametrize("kind", CUSTOMARY_WIDTHS)
def test_edge_has_the_profile_of_the_filter(kind):
    """Samples of a step at a known place: a row's mean is the filter's own integral up to the step."""
    width, height, samples, edge = 24, 300, 32, 12.3
    region = Region((width, height), (0, 0), (width, height))
    chosen = Filter(kind, CUSTOMARY_WIDTHS[kind])
    sums = Reconstruction(chosen, 1, height, width)
    for sample in range(samples):
        where = positions(region, sample, 1)
        x = np.arange(width) + (where[0] + 0.5) / 65536.0
        sums.add((x < edge).astype(np.float32)[None], where)
    steps = (np.arange(20000) + 0.5) / 1000.0 - 10.0
    expected = [chosen(steps)[steps < edge - (column + 0.5)].sum() / 1000.0 for column in range(width)]
    rows = sums.pixels()[0]
    error = rows.std(axis=0, ddof=1) / np.sqrt(height)
    # The ratio of two sums is off by a share of its variance, beside its standard error.
    assert np.all(np.abs(rows.mean(axis=0) - expected) <= 5.0 * error + rows.var(axis=0) + 1e-4)


def test_uneven_positions_cover_the_pixel():
    region = Region((64, 64), (0, 0), (64, 64))
    where = np.stack([positions(region, sample, 3) for sample in range(4)]) / 65536.0
    assert abs(where.mean() - 0.5) < 5.0 / np.sqrt(12 * where.size)
    distances = np.abs(where[:, None] - where[None])
    apart = np.hypot(*np.moveaxis(np.minimum(distances, 1.0 - distances), 2, 0))
    assert apart[np.triu_indices(4, 1)].min() > 0.25


def scene_with_edges(**camera):
    scene = rendering.empty_scene(24, 20)
    rendering.add_camera((0, -5, 5), (np.radians(45), 0, 0), **camera)
    rendering.add_plane(40, rendering.diffuse())
    rendering.add_plane(1, rendering.emission((0.9, 0.3, 0.2)), (0, 0, 0.8), (0.4, 0.2, 0.3))
    rendering.add_light("AREA", 300, (1, -1, 4), size=2)
    scene.cycles.pixel_filter_type = "GAUSSIAN"
    scene.cycles.filter_width = 2.0
    return scene


def test_expectation_is_that_of_the_same_filter_in_cycles(tmp_path):
    """Cycles' Gaussian has a standard deviation of a quarter of its width, ours of a sixth."""
    scene = scene_with_edges()
    native = rendering.stack(tmp_path, "CYCLES", range(16), 16)
    scene.spectral_tiles.filter = "GAUSSIAN"
    scene.spectral_tiles.filter_width = 3.0
    ours = rendering.stack(tmp_path, "SPECTRAL_TILES", range(16), 4)
    # At the border Cycles takes samples from beyond it.
    rendering.assert_same_expectation(ours[:, 4:-4, 4:-4], native[:, 4:-4, 4:-4])


def test_transparent_film_is_filtered_premultiplied(tmp_path):
    """A white emitter before nothing: colour and alpha are the same everywhere, and both have an edge's profile."""
    scene = rendering.empty_scene(16, 16)
    scene.render.film_transparent = True
    rendering.add_camera(type="ORTHO", ortho_scale=16)
    rendering.add_plane(7.3, rendering.emission())
    scene.spectral_tiles.filter = "MITCHELL_NETRAVALI"
    pixels = rendering.beauty(rendering.render(tmp_path, "SPECTRAL_TILES", 4))
    assert np.allclose(pixels[..., 0], pixels[..., 3], atol=1e-5)
    assert len(np.unique(pixels[..., 3].round(3))) > 4


@pytest.mark.parametrize("kind", ["TENT", "LANCZOS"])
def test_data_passes_are_not_mixed(tmp_path, kind):
    scene = scene_with_edges()
    layer = bpy.context.view_layer
    layer.use_pass_z = layer.use_pass_object_index = layer.use_pass_normal = True
    layer.use_pass_diffuse_direct = layer.use_pass_diffuse_color = layer.use_pass_emit = True
    for index, made in enumerate(bpy.data.objects):
        made.pass_index = 10 * index
    scene.cycles.max_bounces = 0
    scene.spectral_tiles.filter = kind
    passes = rendering.render(tmp_path, "SPECTRAL_TILES", 2)
    allowed = {float(made.pass_index) for made in bpy.data.objects if made.type == "MESH"}
    assert set(np.unique(passes["ViewLayer.Object Index"])) <= allowed
    # As Cycles has it, the mean of a pixel's samples, which a filter's lobes do not reach.
    normals = np.linalg.norm(passes["ViewLayer.Normal"], axis=-1)
    assert normals.max() < 1.0 + 1e-4 and np.median(normals) > 1.0 - 1e-4
    assert passes["ViewLayer.Depth"].max() < 100.0
    # The passes of the light add up to the picture, through the filter too.
    light = passes["ViewLayer.Diffuse Direct"] * passes["ViewLayer.Diffuse Color"] + passes["ViewLayer.Emission"]
    assert np.allclose(light, passes["ViewLayer.Combined"][..., :3], rtol=1e-3, atol=1e-4)


@pytest.mark.parametrize("persistent", [False, True])
def test_layers_frames_and_the_users_settings(tmp_path, persistent):
    """Several layers and frames in one go give what single renders give; the user's scene is as it was."""
    scene = scene_with_edges()
    scene.view_layers.new("Other")
    scene.render.use_persistent_data = persistent
    scene.spectral_tiles.filter = "GAUSSIAN"
    first, again = (rendering.render(tmp_path, "SPECTRAL_TILES", 2) for _ in range(2))
    assert np.array_equal(first["ViewLayer.Combined"], again["ViewLayer.Combined"])
    assert np.array_equal(first["ViewLayer.Combined"], first["Other.Combined"])
    assert scene.render.use_persistent_data is persistent
    assert scene.camera.data.type == "PERSP"
    scene.frame_start, scene.frame_end = 1, 2
    scene.render.filepath = str(tmp_path / "frame_")
    bpy.ops.render.render(animation=True)
    second = rendering.read_exr(tmp_path / "frame_0002.exr")
    assert np.array_equal(second["ViewLayer.Combined"], first["ViewLayer.Combined"])


def test_width_follows_the_filter():
    settings = rendering.empty_scene().spectral_tiles
    for kind, width in reconstruction.CUSTOMARY_WIDTHS.items():
        settings.filter = kind
        assert settings.filter_width == width
