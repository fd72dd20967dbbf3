# SPDX-License-Identifier: GPL-3.0-or-later
"""The method Rounds, as scenes ask for it by Cycles' settings."""

import bpy
import numpy as np
import pytest

from tests import rendering


def sample_counts(folder):
    """Samples of each pixel, and the picture."""
    scene = bpy.context.scene
    scene.view_layers[0].cycles.pass_debug_sample_count = True
    scene.render.filepath = str(folder / "picture.exr")
    image = scene.render.image_settings
    image.media_type, image.file_format, image.color_depth = "MULTI_LAYER_IMAGE", "OPEN_EXR_MULTILAYER", "32"
    bpy.ops.render.render(write_still=True)
    found = rendering.read_exr(folder / "picture.exr")
    return next(np.asarray(pixels) for name, pixels in found.items() if "Sample Count" in str(name))


@pytest.mark.parametrize("threshold", [0.1, None])
def test_denoiser_has_no_say_in_samples(extension, tmp_path, threshold):
    """With it on Cycles keeps the noisy picture in another pass."""
    scene = rendering.empty_scene(48, 32)
    rendering.add_plane(20, rendering.diffuse())
    rendering.add_light("AREA", 500, (2, 2, 5), size=4.0)
    rendering.add_camera()
    scene.spectral_tiles.enabled = True
    scene.cycles.samples, scene.cycles.adaptive_min_samples = 128, 0
    scene.cycles.use_adaptive_sampling = threshold is not None
    if threshold is not None:
        scene.cycles.adaptive_threshold = threshold
    counts = []
    for scene.cycles.use_denoising in (False, True):
        counts.append(sample_counts(tmp_path))
    if threshold is not None:
        np.testing.assert_array_equal(*counts)
        assert counts[1].max() < 128
    else:  # how many samples are spent depends on time, too
        assert abs(counts[1].mean() / counts[0].mean() - 1.0) < 0.5
