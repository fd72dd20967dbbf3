# SPDX-License-Identifier: GPL-3.0-or-later
"""The method In Place: Cycles' own pictures."""

import bpy
import numpy as np
import pytest

from addon.interface import forecast
from tests import rendering


def build_scene(samples=2):
    """A moving floor, seen through an open lens, under two lamps: which of them is chosen makes most of the noise."""
    scene = rendering.empty_scene(40, 32)
    camera = rendering.add_camera((0, 0, 5))
    camera.data.dof.use_dof, camera.data.dof.aperture_fstop = True, 0.2
    floor = rendering.add_plane(20, rendering.diffuse())
    floor.keyframe_insert("location", frame=0)
    floor.location.x = 0.5
    floor.keyframe_insert("location", frame=2)
    rendering.add_light("AREA", 100, (-2, 0, 3), size=0.5)
    rendering.add_light("AREA", 300, (2, 0, 3), size=0.5)
    scene.render.use_motion_blur = True
    scene.cycles.pixel_filter_type = "BLACKMAN_HARRIS"
    scene.cycles.sampling_pattern = "BLUE_NOISE"
    scene.spectral_tiles.method = "IN_PLACE"
    scene.cycles.samples = samples
    return scene


def custom_camera(scene):
    """A lens of the user's own: a pinhole that sees a plane at an angle."""
    text = bpy.data.texts.new("lens.osl")
    text.write(
        "shader lens(output point position = 0.0, output vector direction = 0.0, output color throughput = 1.0)\n"
        "{ vector at = camera_shader_raster_position(); direction = vector(at[0] - 0.5, at[1] - 0.5, 1.0); }"
    )
    scene.camera.data.type = "CUSTOM"
    scene.camera.data.custom_shader = text


CHANGES = {
    "nothing": lambda scene: None,
    "border": lambda scene: (
        setattr(scene.render, "use_border", True),
        setattr(scene.render, "border_min_x", 0.3),
        setattr(scene.render, "border_max_y", 0.7),
    ),
    "custom lens": custom_camera,
    "rolling shutter": lambda scene: setattr(scene.cycles, "rolling_shutter_type", "TOP"),
    "culling": lambda scene: (
        setattr(scene.render, "use_simplify", True),
        setattr(scene.cycles, "use_camera_cull", True),
    ),
    "vector": lambda scene: (
        setattr(scene.render, "use_motion_blur", False),
        setattr(bpy.context.view_layer, "use_pass_vector", True),
    ),
    "sample subset": lambda scene: (
        setattr(scene.cycles, "use_sample_subset", True),
        setattr(scene.cycles, "sample_offset", 1),
        setattr(scene.cycles, "sample_subset_length", 1),
    ),
}


@pytest.mark.parametrize("change", CHANGES)
def test_it_is_cycles(tmp_path, change):
    """All passes, to the bit."""
    scene = build_scene()
    CHANGES[change](scene)
    ours, native = (rendering.render(tmp_path, engine, 2, seed=3) for engine in ("SPECTRAL_TILES", "CYCLES"))
    assert ours.keys() == native.keys()
    for name, pixels in native.items():
        assert np.array_equal(ours[name], pixels, equal_nan=True), name


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ("custom lens", "has a custom lens"),
        ("rolling shutter", "Rolling Shutter"),
        ("culling", "Culling"),
        ("vector", "Vector pass"),
    ],
)
def test_it_serves_where_samples_cannot_be_moved(tmp_path, change, reason):
    """Gather is refused by hand; Automatic renders what Cycles would."""
    scene, layer = build_scene(), bpy.context.view_layer
    CHANGES[change](scene)
    layer.update()
    scene.spectral_tiles.method = "GATHER"
    (message,) = forecast.chosen(scene, layer).refusals
    assert reason in message
    scene.spectral_tiles.method = "AUTO"
    assert not forecast.chosen(scene, layer).refusals
    assert forecast.chosen(scene, layer).method == "CYCLES"
    scene.cycles.samples = 16
    assert forecast.chosen(scene, layer).method == "ROUNDS"
    ours, native = (rendering.beauty(rendering.render(tmp_path, engine, 16)) for engine in rendering.ENGINES[::-1])
    # In so small a picture rounds complete it evenly, by other sums of the same samples.
    np.testing.assert_allclose(ours, native, rtol=1e-4, atol=1e-6)


@pytest.mark.parametrize(("name", "value"), [("pattern", "SPECTRAL"), ("filter", "GAUSSIAN")])
def test_samples_that_must_move_are_refused(name, value):
    scene = build_scene()
    scene.spectral_tiles.enabled = True
    setattr(scene.spectral_tiles, name, value)
    with pytest.raises(RuntimeError, match="In Place takes Cycles' own samples"):
        bpy.ops.render.render()
