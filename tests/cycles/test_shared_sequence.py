# SPDX-License-Identifier: GPL-3.0-or-later
"""The sequence that all pixels share is the one that Cycles draws."""

import bpy
import numpy as np
import pytest

from addon.cycles import shared_sequence
from tests import rendering


def render_sample(folder, k, count, seed):
    """Native render of the k-th sample only, shared by all pixels: mean colour."""
    settings = bpy.context.scene.cycles
    settings.sampling_pattern = "TABULATED_SOBOL"
    settings.scrambling_distance, settings.auto_scrambling_distance = 0.0, False
    settings.use_sample_subset, settings.sample_subset_length, settings.sample_offset = True, 1, k
    image = rendering.beauty(rendering.render(folder, "CYCLES", samples=count, seed=seed))[..., :3]
    assert np.ptp(image, axis=(0, 1)).max() < 1e-3
    return image.mean(axis=(0, 1))


@pytest.mark.parametrize(("count", "seed"), [(256, 0), (256, 123456789), (1024, 7)])
def test_time(tmp_path, count, seed):
    """A ramp that slides by one unit during the shutter shows the time."""
    scene = rendering.empty_scene(4, 4)
    rendering.add_camera(type="ORTHO", ortho_scale=1e-4)
    material = rendering.emission()
    tree = material.node_tree
    ramp = tree.nodes.new("ShaderNodeTexCoord").outputs["Object"]
    tree.links.new(ramp, next(node for node in tree.nodes if node.type == "EMISSION").inputs["Color"])
    rendering.slide(rendering.add_plane(20, material), (-1, 0, 0), (-3, 0, 0))
    scene.render.use_motion_blur = True
    scene.render.motion_blur_shutter = 1.0
    scene.render.motion_blur_position = "START"
    wanted = shared_sequence.values(("t",), count, seed)[:, 0]
    for k in (0, 1, 2, 100, count - 1):
        assert render_sample(tmp_path, k, count, seed)[0] - 2.0 == pytest.approx(wanted[k], abs=0.01)


def test_light(tmp_path):
    """Light numbers, by the colour of the light where a distant receiver sees it; see `test_random_numbers`."""
    rendering.empty_scene(4, 4)
    rendering.add_camera(type="ORTHO", ortho_scale=1e-4)
    rendering.add_plane(10, rendering.diffuse())
    rendering.add_parametric_light()
    wanted = shared_sequence.values(("light.u", "light.v"), 256, 3)
    for k in (0, 5, 77):
        seen = render_sample(tmp_path, k, 256, 3)
        distance = np.abs(seen[:2] / seen[2] - wanted[k])
        mirrored = np.abs(1 - seen[:2] / seen[2] - wanted[k])
        assert np.minimum(distance, mirrored).max() < 1e-3


def test_every_prefix_is_stratified():
    dims = ("t", "lens.u", "lens.v", "light.u", "light.v", "film.x", "film.y")
    points = shared_sequence.values(dims, 256, seed=5)
    for count in (16, 64, 256):
        for axis in range(len(dims)):
            assert (np.sort((points[:count, axis] * count).astype(int)) == np.arange(count)).all()
    pairs = (points[:16, 3:5] * 4).astype(int) @ (1, 4)
    assert (np.sort(pairs) == np.arange(16)).all()
