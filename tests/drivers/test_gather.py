# SPDX-License-Identifier: GPL-3.0-or-later
"""The method Gather says beforehand what it cannot render as Cycles does."""

import bpy
import numpy as np
import pytest

from addon.interface import forecast
from tests import rendering


def build_scene():
    scene = rendering.empty_scene(24, 16)
    scene.spectral_tiles.method = "GATHER"
    rendering.add_camera((0, -5, 5), (np.radians(60), 0, 0))
    rendering.add_plane(8, rendering.diffuse())
    rendering.add_light("AREA", 300, (1, -1, 4), size=2)
    return scene


def far_plane(scene):
    scene.camera.data.clip_end = 20
    rendering.add_plane(200, rendering.diffuse(), (0, 0, -1))


def far_instance(scene):
    """Only what a collection instance shows lies beyond."""
    scene.camera.data.clip_end = 20
    far = bpy.data.collections.new("Far")
    plane = rendering.add_plane(4, rendering.diffuse(), (0, 60, 0))
    scene.collection.objects.unlink(plane)
    far.objects.link(plane)
    rendering.add(None).instance_type = "COLLECTION"
    bpy.data.objects["Empty"].instance_collection = far


def open_lens(scene):
    scene.camera.data.dof.use_dof, scene.camera.data.dof.aperture_fstop = True, 0.0


def no_scale(scene):
    scene.camera.data.type, scene.camera.data.ortho_scale = "ORTHO", 0.0


@pytest.mark.parametrize(
    ("change", "reason"),
    [(far_plane, "far clip"), (far_instance, "far clip"), (open_lens, "F-Stop"), (no_scale, "Orthographic Scale")],
)
def test_what_would_differ_is_refused_by_hand_and_rendered_by_itself(tmp_path, change, reason):
    scene = build_scene()
    change(scene)
    bpy.context.view_layer.update()
    (message,) = forecast.chosen(scene, bpy.context.view_layer).refusals
    assert reason in message
    with pytest.raises(RuntimeError, match=reason):
        rendering.render(tmp_path, "SPECTRAL_TILES")
    scene.spectral_tiles.method = "AUTO"
    ours, native = (rendering.beauty(rendering.render(tmp_path, engine)) for engine in rendering.ENGINES[::-1])
    assert np.array_equal(ours, native)


def test_a_far_clip_beyond_everything_is_no_hindrance():
    scene = build_scene()
    bpy.context.view_layer.update()
    assert not forecast.chosen(scene, bpy.context.view_layer).refusals
