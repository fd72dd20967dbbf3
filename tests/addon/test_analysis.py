# SPDX-License-Identifier: GPL-3.0-or-later
import bpy
import pytest

from addon.cycles.scene_analysis import scene_use
from tests import rendering


def _lights():
    return scene_use(bpy.context.evaluated_depsgraph_get()).lights


@pytest.fixture(autouse=True)
def scene():
    made = rendering.empty_scene()
    rendering.add_camera()
    return made


@pytest.mark.parametrize(
    ("kind", "size"), [("POINT", "shadow_soft_size"), ("SPOT", "shadow_soft_size"), ("SUN", "angle")]
)
def test_a_single_lamp_without_size_leaves_nothing_to_chance(kind, size):
    lamp = rendering.add_light(kind, 1.0, (0, 0, 3), **{size: 0.0})
    assert _lights() == 0
    setattr(lamp.data, size, 0.1)
    assert _lights() == 1
    setattr(lamp.data, size, 0.0)
    rendering.add_light(kind, 1.0, (1, 0, 3), **{size: 0.0})
    assert _lights() == 2


@pytest.mark.parametrize(("sampled", "lights"), [(True, 2), (False, 0)])
def test_emission_that_cycles_does_not_sample_is_no_light(sampled, lights):
    material, world = rendering.emission(), rendering.set_world((1, 1, 1))
    rendering.add_plane(1, material)
    if not sampled:
        material.cycles.emission_sampling = world.cycles.sampling_method = "NONE"
    assert _lights() == lights
