# SPDX-License-Identifier: GPL-3.0-or-later
"""The tile Spectral is the shipped one that is made for what the scene uses."""

import bpy
import pytest

from addon.cycles.scene_analysis import SceneUse
from addon.drivers import gather
from addon.plan import patterns
from tests import rendering


def test_spectral_is_the_tile_of_what_is_used(extension):
    for use, dims in (
        (SceneUse(True, False, 0, False, False), ("t",)),
        (SceneUse(False, False, 1, False, False), ("light.u", "light.v")),
        (SceneUse(True, True, 1, False, False), ("t", "lens.u", "lens.v", "light.u", "light.v")),
        (SceneUse(True, True, 3, True, False), patterns.PROFILES["full"]),
    ):
        assert patterns.tile("SPECTRAL", dims=use.dims).dims == dims
    assert patterns.tile("SPECTRAL").dims == patterns.PROFILES["full"]


@pytest.fixture
def followed(monkeypatch):
    """Dimensions of the tiles that renders follow."""
    dims = []
    make = gather.pattern_plan.make
    monkeypatch.setattr(gather.pattern_plan, "make", lambda tile, *rest: dims.append(tile.dims) or make(tile, *rest))
    return dims


def lit_by_a_lamp(tile):
    scene = rendering.empty_scene(8, 8)
    rendering.add_camera()
    rendering.add_plane(4, rendering.diffuse())
    rendering.add_light("SUN", 1, (0, 0, 5))
    scene.cycles.max_bounces = 0
    scene.spectral_tiles.enabled, scene.spectral_tiles.pattern = True, tile
    scene.spectral_tiles.method = "GATHER"
    return scene


@pytest.mark.parametrize("motion_blur", [False, True])
def test_a_render_looks_the_scene_over(extension, followed, motion_blur):
    lit_by_a_lamp("SPECTRAL").render.use_motion_blur = motion_blur
    bpy.ops.render.render()
    assert followed == [("t", "light.u", "light.v") if motion_blur else ("light.u", "light.v")]


def test_automatic_follows_no_tile(extension, followed):
    lit_by_a_lamp("AUTO")
    bpy.ops.render.render()
    assert not followed
