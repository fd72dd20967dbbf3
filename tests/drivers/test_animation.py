# SPDX-License-Identifier: GPL-3.0-or-later
"""Animations through real files: every frame once, with a pattern of its own, and the scene left at its frame."""

import bpy
import numpy as np
import pytest

from addon.cycles import random_numbers
from tests import rendering
from tests.drivers import test_expectation as scenes


@pytest.fixture(params=["GATHER", "IN_PLACE"])
def scene(request, tmp_path):
    """Three frames of a scene at rest, to be written to `tmp_path`."""
    scenes.static_scene()
    scene = bpy.context.scene
    scene.spectral_tiles.enabled = True
    scene.spectral_tiles.method = request.param
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.image_settings.color_depth = "32"
    scene.render.filepath = f"{tmp_path}/frame_"
    scene.frame_start, scene.frame_end = 5, 7
    scene.frame_set(6, subframe=0.25)
    return scene


def rendered(folder):
    """Pictures that were written, by file name."""
    return {path.name: next(iter(rendering.read_exr(path).values())) for path in sorted(folder.iterdir())}


def test_every_frame_has_its_own_pattern(scene, tmp_path):
    scene.cycles.use_animated_seed = True
    bpy.ops.render.render(animation=True)
    pictures = rendered(tmp_path)
    assert list(pictures) == [f"frame_000{frame}.exr" for frame in (5, 6, 7)]
    first, second, third = pictures.values()
    assert not (np.array_equal(first, second) or np.array_equal(second, third) or np.array_equal(first, third))
    assert (scene.frame_current, scene.frame_subframe) == (6, 0.25)


def test_fixed_seed_gives_a_fixed_pattern(scene, tmp_path):
    scene.cycles.use_animated_seed = False
    bpy.ops.render.render(animation=True)
    first, *others = rendered(tmp_path).values()
    assert all(np.array_equal(first, other) for other in others)


def test_a_frame_is_the_same_alone(scene, tmp_path):
    """A farm renders frames one by one; persistent data may carry over from the frame before."""
    scene.cycles.use_animated_seed = True
    scene.render.use_persistent_data = True
    bpy.ops.render.render(animation=True)
    wanted = rendered(tmp_path)["frame_0007.exr"]
    scene.render.use_persistent_data = False
    scene.frame_set(7)
    scene.render.filepath = f"{tmp_path}/alone.exr"
    bpy.ops.render.render(write_still=True)
    assert np.array_equal(rendered(tmp_path)["alone.exr"], wanted)


def test_step_placeholders_and_no_overwrite(scene, tmp_path):
    scene.frame_step = 2
    scene.render.use_placeholder, scene.render.use_overwrite = True, False
    (tmp_path / "frame_0007.exr").write_bytes(b"kept")
    bpy.ops.render.render(animation=True)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["frame_0005.exr", "frame_0007.exr"]
    assert (tmp_path / "frame_0007.exr").read_bytes() == b"kept"
    assert rendering.read_exr(tmp_path / "frame_0005.exr")


def test_a_frame_whose_seed_no_setting_can_hold(scene, tmp_path):
    """Half of all animated seeds are beyond the largest that one can enter."""
    scene.spectral_tiles.method, scene.spectral_tiles.distribution = "IN_PLACE", "BY_NOISE"
    scene.cycles.use_animated_seed = True
    scene.cycles.samples = 16
    seed = scene.cycles.seed
    scene.frame_set(next(frame for frame in range(1, 99) if random_numbers.animated_seed(seed, frame) >= 2**31))
    bpy.ops.render.render(write_still=True)
    assert len(rendered(tmp_path)) == 1
    assert (scene.cycles.seed, scene.cycles.use_animated_seed) == (seed, True)
