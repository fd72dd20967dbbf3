# SPDX-License-Identifier: GPL-3.0-or-later
"""The tile Spectral is the shipped one that is made for what the scene uses."""

import bpy
import pytest

from addon import gather, library
from addon.analysis import SceneUse
from tests import rendering


def test_spectral_is_the_tile_of_what_is_used(extension):
    settings = rendering.empty_scene().spectral_tiles
    settings.tile = "SPECTRAL"
    for use, dims in (
        (SceneUse(True, False, 0, False), ("t",)),
        (SceneUse(False, False, 1, False), ("light.u", "light.v")),
        (SceneUse(True, True, 1, False), ("t", "lens.u", "lens.v", "light.u", "light.v")),
        (SceneUse(True, True, 3, True), library.PROFILES["full"]),
    ):
        assert library.tile(settings, dims=use.dims).dims == dims
    assert library.tile(settings).dims == library.PROFILES["full"]


@pytest.mark.parametrize("motion_blur", [False, True])
def test_a_render_looks_the_scene_over(monkeypatch, extension, motion_blur):
    scene = rendering.empty_scene(8, 8)
    rendering.add_camera()
    rendering.add_plane(4, rendering.diffuse())
    rendering.add_light("SUN", 1, (0, 0, 5))
    scene.cycles.max_bounces = 0
    scene.render.use_motion_blur = motion_blur
    scene.render.engine, scene.spectral_tiles.tile = "SPECTRAL_TILES", "SPECTRAL"
    followed = []
    make = gather.tile_plan.make
    monkeypatch.setattr(gather.tile_plan, "make", lambda tile, *rest: followed.append(tile.dims) or make(tile, *rest))
    bpy.ops.render.render()
    assert followed == [("t", "light.u", "light.v") if motion_blur else ("light.u", "light.v")]
