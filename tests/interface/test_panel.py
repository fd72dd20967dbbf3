# SPDX-License-Identifier: GPL-3.0-or-later
"""What the panel offers: the forecast, presets, the comparison with Cycles, tiles made in the background."""

import os

import bpy
import numpy as np
import pytest

import generator
from addon import driver
from addon.blender import progress
from addon.cycles import scene_analysis
from addon.interface import forecast, pattern_icons, pattern_making
from addon.plan import patterns, sample_plan
from tests import rendering


def build_scene(size=16):
    scene = rendering.empty_scene(size, size)
    rendering.add_camera((0, -5, 5), (np.radians(45), 0, 0))
    rendering.add_plane(8, rendering.diffuse())
    rendering.add_light("AREA", 300, (1, -1, 4), size=2)
    scene.render.engine = "SPECTRAL_TILES"
    bpy.context.view_layer.update()
    return scene


def zoom(camera):
    """Animate a camera's focal length over frames 0 to 2."""
    for frame, length in ((0, 20.0), (2, 60.0)):
        camera.lens = length
        camera.keyframe_insert("lens", frame=frame)
    rendering.make_linear(camera)
    bpy.context.scene.frame_set(1)


def use(motion_blur=False, lens=False, lights=0, bounces=False):
    return scene_analysis.SceneUse(motion_blur, lens, lights, bounces, glow=False)


@pytest.mark.parametrize(
    ("used", "sentence"),
    [
        (use(), "Nothing that makes noise"),
        (use(lens=True), "Lens"),
        (use(lights=1, bounces=True), "1 light and indirect light"),
        (use(True, True, 3), "Motion blur, lens and 3 lights"),
    ],
)
def test_what_the_scene_uses_in_words(used, sentence):
    assert forecast.sentence(used) == sentence


def test_forecast_follows_the_scene():
    scene = build_scene()
    scene.cycles.max_bounces = 0
    layer = bpy.context.view_layer
    assert forecast.uses(scene, layer) == "1 light: using Cycles' own samples, arranged for these"
    rendering.add_light("POINT", 10, (0, 0, 2))
    bpy.context.view_layer.update()
    scene.render.use_motion_blur = True
    for tile, name in (("SPECTRAL", "motion-lights-1"), ("SPECTRAL_64", "spectral_64"), ("FILE", "mine.npz")):
        scene.spectral_tiles.tile, scene.spectral_tiles.tile_path = tile, "//tiles/mine.npz"
        assert forecast.uses(scene, layer) == f"Motion blur and 2 lights: using tile {name}"


def test_forecast_counts_only_after_a_change(monkeypatch):
    scene = build_scene()
    forecast.uses(scene, bpy.context.view_layer)
    monkeypatch.setattr(analysis, "emitters", lambda depsgraph: pytest.fail("counted again"))
    forecast.uses(scene, bpy.context.view_layer)


def test_forecast_tells_every_refusal():
    scene = build_scene()
    assert forecast.refusals(scene, bpy.context.view_layer) == []
    scene.camera.data.type = "CUSTOM"
    assert forecast.refusals(scene, bpy.context.view_layer) == []
    assert "custom lens" in told(forecast.render_calls, scene)
    scene.spectral_tiles.tile = "FILE"
    messages = forecast.refusals(scene, bpy.context.view_layer)
    assert len(messages) == 2
    with pytest.raises(RuntimeError) as refused:
        bpy.ops.render.render()
    assert messages[0] in str(refused.value)


def test_forecast_without_a_camera():
    scene = build_scene()
    layer = bpy.context.view_layer
    layer.use_pass_mist = layer.use_pass_vector = True
    bpy.data.objects.remove(scene.camera)
    for name in ("GATHER", "IN_PLACE", "SUBRENDER"):
        scene.spectral_tiles.driver = name
        assert "no camera" in forecast.refusals(scene, layer)[0]


def test_forecast_tells_of_the_shading():
    scene = build_scene()
    scene.spectral_tiles.driver = "GATHER"
    tree = bpy.data.materials[0].node_tree
    node = tree.nodes.new("ShaderNodeTexCoord")
    bsdf = next(found for found in tree.nodes if found.type == "BSDF_DIFFUSE")
    link = tree.links.new(node.outputs["Window"], bsdf.inputs["Color"])
    bpy.context.view_layer.update()
    assert "Window coordinates" in forecast.refusals(scene, bpy.context.view_layer)[0]
    tree.links.remove(link)
    bpy.context.view_layer.update()
    assert forecast.refusals(scene, bpy.context.view_layer) == []


def told(tells, scene):
    return tells(scene, bpy.context.view_layer)


def test_forecast_tells_the_driver_and_why(monkeypatch):
    scene = build_scene()
    assert told(forecast.render_calls, scene).startswith("Gather, the faster driver: one Cycles render")
    scene.spectral_tiles.driver = "GATHER"
    assert told(forecast.render_calls, scene).startswith("Gather: one Cycles render")
    scene.spectral_tiles.driver = "SUBRENDER"
    assert "Sub-renders: 256 small Cycles renders" in told(forecast.render_calls, scene)
    scene.spectral_tiles.driver = "AUTO"
    monkeypatch.setattr(driver.cycles, "with_osl", lambda: False)
    assert "no Open Shading Language" in told(forecast.render_calls, scene)
    assert forecast.refusals(scene, bpy.context.view_layer) == []


def test_ignored_settings_are_told():
    scene = build_scene()
    assert told(forecast.ignored, scene) == []
    cycles = scene.cycles
    cycles.use_adaptive_sampling = True
    cycles.time_limit = 5.0
    bpy.context.view_layer.samples = 3
    assert len(told(forecast.ignored, scene)) == 3
    driver.set_samples(cycles, 1)
    assert told(forecast.ignored, scene) == []


def test_zoom_that_does_not_blur_is_told():
    scene = build_scene()
    zoom(scene.camera.data)
    assert told(forecast.ignored, scene) == []
    scene.render.use_motion_blur = True
    assert len(told(forecast.ignored, scene)) == 1
    scene.spectral_tiles.driver = "SUBRENDER"
    assert told(forecast.ignored, scene) == []
    scene.spectral_tiles.driver = "GATHER"
    scene.camera.data.animation_data_clear()
    assert told(forecast.ignored, scene) == []
    scene.camera.data.driver_add("sensor_width")
    assert len(told(forecast.ignored, scene)) == 1


def preset_files():
    return {name: os.path.join(folder, name) for folder in bpy.utils.preset_paths("spectral_tiles")
            for name in os.listdir(folder) if name.endswith(".py")}  # fmt: skip


def test_presets():
    scene = build_scene()
    found = preset_files()
    seen = {}
    settings = scene.spectral_tiles
    for name in ("Preview.py", "Animation.py", "Final.py"):
        settings.control_variates, settings.filter, settings.adaptive = False, "BOX", "BUDGET"
        settings.animated_seed = False
        bpy.ops.script.execute_preset(filepath=found[name], menu_idname="SPECTRAL_TILES_PT_presets")
        seen[name] = settings.samples
        assert (settings.control_variates, settings.filter, settings.adaptive) == (True, "AS_CYCLES", "OFF")
        assert settings.animated_seed
    assert seen == {"Preview.py": 1, "Animation.py": 4, "Final.py": 16}


def test_own_presets_keep_every_setting_but_the_seed():
    kept = set(bpy.types.SPECTRAL_TILES_OT_preset_add.preset_values)
    settings = {prop.identifier for prop in build_scene().spectral_tiles.bl_rna.properties}
    missing = {name for name in settings if f"settings.{name}" not in kept}
    assert missing == {"rna_type", "name", "seed"}


def test_comparison_fills_two_slots(tmp_path):
    """Each slot holds what its engine renders alone at these samples, and the scene is as it was."""
    scene = build_scene()
    scene.spectral_tiles.samples = 3
    scene.cycles.samples = 50
    scene.cycles.use_adaptive_sampling = True
    bpy.ops.render.render()
    result = bpy.data.images["Render Result"]
    users_slots = [slot.name for slot in result.render_slots]
    bpy.ops.spectral_tiles.compare()
    assert scene.render.engine == "SPECTRAL_TILES" and scene.cycles.samples == 50 and scene.cycles.use_adaptive_sampling
    assert [slot.name for slot in result.render_slots] == [*users_slots, "Cycles", "Spectral Tiles"]
    settings = scene.render.image_settings
    settings.file_format, settings.color_depth = "OPEN_EXR", "32"
    slots = {}
    for name in ("Cycles", "Spectral Tiles"):
        result.render_slots.active_index = [slot.name for slot in result.render_slots].index(name)
        result.save_render(str(tmp_path / "slot.exr"))
        slots[name] = next(iter(rendering.read_exr(tmp_path / "slot.exr").values()))[..., :3]
    scene.cycles.use_adaptive_sampling = False
    for name, engine in (("Cycles", "CYCLES"), ("Spectral Tiles", "SPECTRAL_TILES")):
        alone = rendering.beauty(rendering.render(tmp_path, engine, samples=3))[..., :3]
        assert np.abs(slots[name] - alone).max() < 1e-5
    assert np.abs(slots["Cycles"] - slots["Spectral Tiles"]).max() > 1e-3


def test_comparison_before_the_first_render():
    build_scene()
    assert "Render Result" not in bpy.data.images
    bpy.ops.spectral_tiles.compare()
    bpy.ops.spectral_tiles.compare()
    names = [slot.name for slot in bpy.data.images["Render Result"].render_slots]
    assert names.count("Cycles") == names.count("Spectral Tiles") == 1


def test_refused_comparison_leaves_the_engine_as_it_was():
    scene = build_scene()
    scene.spectral_tiles.tile = "FILE"
    with pytest.raises(RuntimeError, match="No tile file"):
        bpy.ops.spectral_tiles.compare()
    assert not bpy.types.RenderEngine.bl_rna_get_subclass_py("SPECTRAL_TILES").native


def test_generated_tile_is_used(tmp_path):
    scene = build_scene()
    path = str(tmp_path / "mine.npz")
    bpy.ops.spectral_tiles.generate_tile(filepath=path, method="stratified", size="16", seed=3)
    assert (scene.spectral_tiles.tile, scene.spectral_tiles.tile_path) == ("FILE", path)
    made = patterns.tile(scene.spectral_tiles)
    assert made.dims == ("light.u", "light.v", "bsdf.u", "bsdf.v") and made.size == 16
    bpy.ops.render.render()


def test_tile_into_no_folder_is_refused(tmp_path):
    scene = build_scene()
    with pytest.raises(RuntimeError, match="no such folder"):
        bpy.ops.spectral_tiles.generate_tile(filepath=str(tmp_path / "missing" / "mine.npz"), size="16")
    assert scene.spectral_tiles.tile == "AUTO" and pattern_making.job is None


def test_cancelled_tile_leaves_no_file(tmp_path):
    job = pattern_making.Job(tmp_path / "mine.npz", method="spectral", size=64, dims=("t",), seed=0)
    job.start()
    while job.fraction == 0.0:
        assert job.is_running()
    job.cancelled = True
    job.wait()
    assert job.error is None and os.listdir(tmp_path) == []


def test_picture_of_a_tile():
    """White noise has a flat spectrum; a spectral tile's is dark in the middle."""
    rng = np.random.default_rng(1)
    white = generator.Tile(("t", "light.u"), rng.random((64, 64, 1, 2), dtype=np.float32))
    blue = generator.load_tile(os.path.join(os.path.dirname(patterns.__file__), "tiles", "spectral_64.npz"))
    middle = (slice(48, 80), slice(48, 80))
    assert 0.35 < pattern_icons.spectrum(white)[middle].mean() < 0.6
    assert pattern_icons.spectrum(blue)[middle].mean() < 0.1
    assert np.array_equal(pattern_icons.values(white)[:64, :64], white.values[..., 0, 0])


def test_forecast_tells_what_a_frame_costs(monkeypatch):
    """A plan's time and its memory follow the pixels; frames of a group have each their own."""
    scene = build_scene(1000)
    monkeypatch.setattr(sample_plan.memory, "pace", 5e-6)
    assert told(forecast.overhead, scene) == "Adds about 5 s once for frames of this size, and up to 240 MB of memory"
    scene.spectral_tiles.animated_seed = True
    assert "about 5 s for each of the first 4 frames" in told(forecast.overhead, scene)
    scene.spectral_tiles.adaptive = "BUDGET"
    assert "up to 750 MB" in told(forecast.overhead, scene)
    scene.spectral_tiles.adaptive = "OFF"
    scene.render.resolution_percentage = 10
    assert told(forecast.overhead, scene) == "Adds less than a second a frame, and up to 210 MB of memory"


@pytest.mark.parametrize(("seconds", "words"), [(8, "8 s"), (128, "2 min 8 s"), (7500, "2 h 5 min")])
def test_durations(seconds, words):
    assert progress.duration(seconds) == words


def test_pace_of_plans_is_measured(monkeypatch):
    memory = sample_plan.Memory()
    clock = iter((10.0, 30.0, 40.0, 41.0))
    monkeypatch.setattr(sample_plan.time, "perf_counter", lambda: next(clock))
    memory.get("large", lambda: sample_plan.Plan(0, 1000, np.zeros(1000 * 1000, np.int32)))
    memory.get("small", lambda: sample_plan.Plan(0, 10, np.zeros(100, np.int32)))
    assert memory.pace == pytest.approx(20e-6)


def test_forecast_tells_how_long_sub_renders_take(monkeypatch):
    scene = build_scene()
    scene.spectral_tiles.driver = "SUBRENDER"
    monkeypatch.setattr(progress.Progress, "pace", None)
    assert "256 small" in told(forecast.render_calls, scene) and "1 s at least" in forecast.overhead(
        scene, bpy.context.view_layer
    )
    scene.spectral_tiles.samples = 1
    bpy.ops.render.render()
    assert 0.0 < progress.Progress.pace < 5.0
    progress.Progress.pace = 0.5
    assert "about 2 min 8 s" in told(forecast.overhead, scene)
    scene.spectral_tiles.samples = 32
    assert "512 small" in forecast.render_calls(scene, bpy.context.view_layer) and "about 4 min 16 s" in told(
        forecast.overhead, scene
    )
