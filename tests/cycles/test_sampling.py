# SPDX-License-Identifier: GPL-3.0-or-later
"""What Cycles' settings of samples mean (`BlenderSync::sync_integrator`, `Integrator::get_adaptive_sampling`)."""

import bpy
import pytest

from addon.cycles.sampling import Sampling
from tests import rendering


@pytest.fixture
def scene():
    made = rendering.empty_scene(8, 8)
    made.cycles.use_adaptive_sampling, made.cycles.samples = True, 64
    return made


def meant(scene):
    return Sampling.of_layer(scene, bpy.context.view_layer)


def test_a_threshold_of_0_is_automatic(scene):
    scene.cycles.adaptive_threshold = 0.0
    assert meant(scene).threshold == pytest.approx(1 / 64)
    scene.cycles.samples = 4096
    assert meant(scene).threshold == pytest.approx(0.001)
    scene.cycles.adaptive_threshold = 0.2
    assert meant(scene).threshold == pytest.approx(0.2)


def test_least_samples_belong_to_the_threshold(scene):
    scene.cycles.adaptive_min_samples = 40
    assert meant(scene).least == 40
    scene.cycles.use_adaptive_sampling = False
    assert meant(scene).least == 0 and meant(scene).threshold is None


@pytest.mark.parametrize(("use", "layers", "expected"), [("USE", 8, 8), ("BOUNDED", 200, 64), ("BOUNDED", 8, 8),
                                                         ("IGNORE", 8, 64), ("USE", 0, 64)])  # fmt: skip
def test_samples_of_view_layers(scene, use, layers, expected):
    scene.cycles.use_layer_samples, bpy.context.view_layer.samples = use, layers
    assert meant(scene).samples == expected
