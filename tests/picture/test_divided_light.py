# SPDX-License-Identifier: GPL-3.0-or-later
"""Light that Cycles divides by a colour, in pictures of several renders: it is divided once all samples are there."""

import bpy
import numpy as np
import pytest

pytest.importorskip("bpy")

from tests import rendering


@pytest.mark.parametrize(
    "settings",
    [
        {"method": "IN_PLACE"},
        {"method": "GATHER"},
        {"method": "GATHER", "filter": "GAUSSIAN"},
        {"distribution": "BY_NOISE"},
        {"method": "SUB_FRAMES"},
    ],
    ids=lambda settings: " ".join(settings.values()),
)
def test_parts_of_the_light_make_up_the_picture(tmp_path, settings):
    """The edge of two colours moves: the mean of quotients would not be the quotient of means."""
    scene = rendering.empty_scene(48, 36)
    rendering.add_plane(20, rendering.diffuse((0.05, 0.1, 0.2)))
    rendering.spin(rendering.add_plane(4, rendering.diffuse((0.9, 0.8, 0.3)), location=(0, 0, 1)), 40)
    rendering.add_light("AREA", 500, (2, 2, 5), size=2.0)
    rendering.add_camera()
    scene.render.use_motion_blur = True
    scene.cycles.max_bounces = 0
    for name, value in settings.items():
        setattr(scene.spectral_tiles, name, value)
    bpy.context.view_layer.use_pass_diffuse_direct = True
    if "filter" not in settings:
        bpy.context.view_layer.use_pass_diffuse_color = True
    passes = rendering.render(tmp_path, "SPECTRAL_TILES", samples=4)
    light = passes["ViewLayer.Diffuse Direct"] * passes["ViewLayer.Diffuse Color"]
    picture = passes["ViewLayer.Combined"][..., :3]
    assert picture.std() > 0.1
    np.testing.assert_allclose(light, picture, rtol=0, atol=1e-5 * picture.max())
