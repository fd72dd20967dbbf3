# SPDX-License-Identifier: GPL-3.0-or-later
"""Our pictures have native Cycles' expectation: the mean over many cheap seeds is the same."""

import bpy
import numpy as np
import pytest

from demo_blend import spinning_wheels
from tests import rendering

SEEDS = range(40)


def static_scene():
    rendering.empty_scene(24, 24)
    rendering.add_camera((0, -5, 5), (np.radians(45), 0, 0))
    rendering.add_plane(8, rendering.diffuse())
    rendering.add_plane(1, rendering.diffuse((0.7, 0.3, 0.2)), (0, 0, 0.8), (0.4, 0.2, 0))
    rendering.add_light("AREA", 300, (1, -1, 4), size=2)


def moving_camera_with_open_lens():
    static_scene()
    scene = bpy.context.scene
    scene.render.use_motion_blur = True
    scene.camera.data.dof.use_dof = True
    scene.camera.data.dof.focus_distance = 4.0
    scene.camera.data.dof.aperture_fstop = 0.05
    rendering.slide(scene.camera, (-0.4, -5, 5), (0.4, -5, 5))


def glossy_two_lights_and_world():
    rendering.empty_scene(24, 24)
    rendering.add_camera((0, -5, 5), (np.radians(45), 0, 0))
    rendering.add_plane(8, rendering.glossy(0.3))
    rendering.add_plane(1, rendering.diffuse(), (0, 1, 0.8), (1.2, 0.2, 0))
    rendering.add_light("AREA", 200, (1, -1, 4), size=2)
    rendering.add_light("POINT", 150, (-2, 1, 3), shadow_soft_size=0.5)
    rendering.set_world((0.2, 0.3, 0.5))


def non_uniform_shutter():
    """A bar that moves while the shutter opens slowly and shuts fast."""
    scene = rendering.empty_scene(32, 8)
    rendering.add_camera(type="ORTHO", ortho_scale=8)
    bar = rendering.add_plane(1.5, rendering.emission())
    rendering.slide(bar, (-4, 0, 0), (4, 0, 0))
    scene.render.use_motion_blur = True
    scene.render.motion_blur_shutter = 1.2
    scene.render.motion_blur_position = "START"
    curve = scene.render.motion_blur_shutter_curve
    for point, (time, opening) in zip(curve.curves[0].points, ((0.0, 0.0), (0.9, 1.0), (1.0, 0.0)), strict=False):
        point.location = (time, opening)
    curve.update()


def wheels():
    scene = spinning_wheels.build()
    scene.render.resolution_x = scene.render.resolution_y = 32
    scene.cycles.use_adaptive_sampling = scene.cycles.use_denoising = False
    scene.cycles.use_animated_seed = False
    # Single bright paths would need thousands of seeds to average out.
    scene.cycles.sample_clamp_indirect = 0.5


SCENES = (static_scene, moving_camera_with_open_lens, glossy_two_lights_and_world, non_uniform_shutter, wheels)


@pytest.mark.parametrize("build", SCENES, ids=lambda build: build.__name__)
@pytest.mark.parametrize("samples", [1, 3])
def test_mean_over_seeds_is_native(tmp_path, build, samples):
    build()
    ours, native = (rendering.stack(tmp_path, engine, SEEDS, samples) for engine in reversed(rendering.ENGINES))
    rendering.assert_same_expectation(ours, native)


def test_blackman_harris_filter(tmp_path):
    """A filter wider than a pixel spreads an edge as native Cycles does."""
    scene = rendering.empty_scene(16, 16)
    scene.cycles.pixel_filter_type, scene.cycles.filter_width = "BLACKMAN_HARRIS", 1.8
    rendering.add_camera(type="ORTHO", ortho_scale=16)
    rendering.add_plane(7.3, rendering.emission())
    ours, native = (rendering.stack(tmp_path, e, range(12), samples=32) for e in reversed(rendering.ENGINES))
    rendering.assert_same_expectation(ours, native, block=1)


def test_samples_differ_between_frames_and_seeds(tmp_path):
    static_scene()
    scene = bpy.context.scene
    scene.cycles.use_animated_seed = True
    images = []
    for frame in (1, 2):
        scene.frame_set(frame)
        images.append(rendering.beauty(rendering.render(tmp_path, "SPECTRAL_TILES")))
    scene.cycles.use_animated_seed = False
    still = [rendering.beauty(rendering.render(tmp_path, "SPECTRAL_TILES")) for _ in range(2)]
    assert not np.array_equal(*images)
    assert np.array_equal(*still)
