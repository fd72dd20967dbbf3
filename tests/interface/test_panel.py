# SPDX-License-Identifier: GPL-3.0-or-later
"""What the panel says and offers: the sentence, presets, the comparison with Cycles, patterns made meanwhile."""

import os

import bpy
import numpy as np
import pytest

import generator
from addon import switch
from addon.cycles import scene_analysis
from addon.cycles.scene_analysis import SceneUse
from addon.drivers.choice import Choice
from addon.drivers.frame import pattern_tile
from addon.interface import forecast, panel, pattern_icons, pattern_making
from addon.plan import patterns
from tests import rendering


def build_scene(size=16):
    scene = rendering.empty_scene(size, size)
    rendering.add_camera((0, -5, 5), (np.radians(45), 0, 0))
    rendering.add_plane(8, rendering.diffuse())
    rendering.add_light("AREA", 300, (1, -1, 4), size=2)
    scene.spectral_tiles.enabled = True
    bpy.context.view_layer.update()
    return scene


def use(motion_blur=False, lens=False, lights=0, bounces=False):
    return SceneUse(motion_blur, lens, lights, bounces, glow=False)


@pytest.mark.parametrize(
    ("used", "words"),
    [
        (use(lens=True), "depth of field"),
        (use(lights=1, bounces=True), "direct and indirect light"),
        (use(True, True, 3), "motion blur, depth of field, direct light"),
    ],
)
def test_what_the_noise_comes_from_in_words(used, words):
    assert forecast.noise_sources(used) == words


def told(scene):
    return forecast.sentence(scene, bpy.context.view_layer)


def chosen(scene):
    return forecast.chosen(scene, bpy.context.view_layer)


def test_the_sentence_follows_the_settings():
    scene = build_scene()
    scene.cycles.max_bounces, scene.render.use_motion_blur = 0, True
    settings = scene.spectral_tiles
    settings.method = "GATHER"
    assert told(scene) == "Optimized for motion blur, direct light"
    settings.pattern = "SPECTRAL_64"
    assert told(scene) == "Samples follow the pattern Spectral 64"
    settings.filter = "LANCZOS"
    assert told(scene) == "Spreads every sample by the filter Lanczos"


@pytest.mark.parametrize("method", ["CYCLES", "ROUNDS", "GATHER", "SUB_FRAMES"])
def test_a_sentence_for_every_method(monkeypatch, method):
    """Short, and without figures of what is measured or guessed."""
    scene = build_scene()
    monkeypatch.setattr(forecast.choice, "of_layer", lambda *_: Choice(method))
    sentence = told(scene)
    assert sentence and len(sentence) < 100 and not sentence.endswith(".")


def test_sub_frames_are_told_as_they_will_be():
    scene = build_scene()
    scene.spectral_tiles.method = "SUB_FRAMES"
    scene.render.use_motion_blur = True
    assert told(scene) == f"Renders {scene.spectral_tiles.sub_frames} moments of the shutter one by one"
    scene.render.use_motion_blur = False
    assert told(scene) == "Renders the frame itself, for Motion Blur is off"


def test_a_pattern_of_cycles_that_does_not_apply_is_told():
    scene = build_scene()
    scene.cycles.samples, scene.cycles.use_adaptive_sampling = 16, False
    for pattern, count in (("AUTOMATIC", 0), ("BLUE_NOISE", 0), ("TABULATED_SOBOL", 1)):
        scene.cycles.sampling_pattern = pattern
        differences = forecast.chosen(scene, bpy.context.view_layer).differences
        assert len(differences) == count and all("Tabulated Sobol" in line for line in differences)
    scene.cycles.samples = 1
    assert not forecast.chosen(scene, bpy.context.view_layer).differences


@pytest.mark.parametrize("method", ["AUTO", "IN_PLACE", "GATHER", "SUB_FRAMES"])
def test_a_frame_larger_than_its_tiles_is_told(method):
    scene = build_scene(256)
    scene.cycles.samples, scene.spectral_tiles.method = 16, method
    for side, is_on, is_told in ((100, True, True), (128, False, False), (256, True, False), (2048, True, False)):
        scene.cycles.tile_size, scene.cycles.use_auto_tile = side, is_on
        assert any("Tile Size" in line for line in chosen(scene).differences) == is_told
    scene.spectral_tiles.enabled, scene.cycles.tile_size, scene.cycles.samples = True, 128, 1
    scene.spectral_tiles.method = "AUTO"  # which leaves one sample to Cycles, tiles and all
    assert not chosen(scene).differences


def test_one_lamp_and_a_world_are_not_two_lights():
    scene = build_scene()
    rendering.set_world((1, 1, 1))
    bpy.context.view_layer.update()
    scene.spectral_tiles.method = "GATHER"
    assert not any(letter.isdigit() for letter in told(scene))


def test_contents_are_looked_through_only_after_a_change(monkeypatch):
    scene = build_scene()
    told(scene)
    monkeypatch.setattr(scene_analysis, "contents", lambda depsgraph: pytest.fail("counted again"))
    told(scene)


def test_refusals_are_told_once_and_instead_of_the_sentence():
    scene = build_scene()
    assert chosen(scene).refusals == ()
    scene.spectral_tiles.pattern = "FILE"
    assert told(scene) is None
    (message,) = chosen(scene).refusals
    assert "No pattern file is set" in message
    with pytest.raises(RuntimeError) as refused:
        bpy.ops.render.render()
    assert message in str(refused.value)


def test_no_camera_is_cycles_own_error():
    scene = build_scene()
    bpy.data.objects.remove(scene.camera)
    bpy.context.view_layer.update()
    assert chosen(scene).refusals == ()
    scene.spectral_tiles.enabled = False
    with pytest.raises(RuntimeError) as theirs:
        bpy.ops.render.render()
    scene.spectral_tiles.enabled = True
    with pytest.raises(RuntimeError) as ours:
        bpy.ops.render.render()
    assert str(ours.value) == str(theirs.value)


@pytest.mark.parametrize("engine", ["BLENDER_EEVEE", "BLENDER_WORKBENCH"])
def test_no_trace_of_it_in_other_engines(engine):
    scene = build_scene()

    class Context:
        pass

    for cls in panel._CLASSES:
        Context.engine = "CYCLES"
        assert cls.poll(Context)
        Context.engine = engine
        assert not cls.poll(Context)
    scene.render.engine = engine
    assert not bpy.ops.spectral_tiles.compare.poll()


def test_it_is_a_part_of_the_sampling_panel():
    assert panel.SPECTRAL_TILES_PT_sampling.bl_parent_id == "CYCLES_RENDER_PT_sampling"
    assert "DEFAULT_CLOSED" in panel.SPECTRAL_TILES_PT_advanced.bl_options
    assert not [name for name in dir(bpy.types) if "SPECTRAL" in name and name.endswith("Render")]


def test_lines_break_where_the_panel_ends():
    text = "Samples follow the pattern Spectral 64 and more words than one line has"
    panel.blf.size(0, 12)
    lines = panel._lines(text, 120)
    assert " ".join(lines) == text and len(lines) > 2
    assert all(panel.blf.dimensions(0, line)[0] <= 120 or " " not in line for line in lines)
    assert panel._lines(text, 10000) == [text]


def preset_files():
    return {
        name: os.path.join(folder, name)
        for folder in bpy.utils.preset_paths("spectral_tiles")
        for name in os.listdir(folder)
        if name.endswith(".py")
    }


def advanced(settings):
    names = [prop.identifier for prop in settings.bl_rna.properties]
    return {name: getattr(settings, name) for name in names if name not in {"rna_type", "name", "enabled"}}


def test_presets():
    settings = build_scene().spectral_tiles
    defaults = advanced(settings)
    found = preset_files()
    assert found.keys() == {"Default.py", "Spectral_Pattern.py"}
    run = {"menu_idname": "SPECTRAL_TILES_PT_presets"}
    bpy.ops.script.execute_preset(filepath=found["Spectral_Pattern.py"], **run)
    assert (settings.method, settings.pattern) == ("GATHER", "SPECTRAL")
    settings.filter, settings.filter_b, settings.sub_frames = "MITCHELL_NETRAVALI", 0.1, 99
    bpy.ops.script.execute_preset(filepath=found["Default.py"], **run)
    assert advanced(settings) == defaults and settings.enabled


def test_own_presets_keep_every_advanced_setting():
    kept = set(bpy.types.SPECTRAL_TILES_OT_preset_add.preset_values)
    assert kept == {f"settings.{name}" for name in advanced(build_scene().spectral_tiles)}


def read_slots(folder):
    result = bpy.data.images["Render Result"]
    settings = bpy.context.scene.render.image_settings
    settings.media_type, settings.file_format, settings.color_depth = "IMAGE", "OPEN_EXR", "32"
    slots = {}
    for name in ("Cycles", "Spectral Tiles"):
        result.render_slots.active_index = [slot.name for slot in result.render_slots].index(name)
        result.save_render(str(folder / "slot.exr"))
        slots[name] = next(iter(rendering.read_exr(folder / "slot.exr").values()))[..., :3]
    return slots


@pytest.mark.parametrize("is_on", [False, True])
def test_comparison_fills_two_slots(tmp_path, is_on):
    """Each slot holds what Cycles renders with the switch off and on, and all is set as it was."""
    scene = build_scene()
    scene.cycles.samples = 3
    scene.spectral_tiles.enabled, scene.spectral_tiles.method = is_on, "GATHER"
    bpy.ops.render.render()
    result = bpy.data.images["Render Result"]
    users_slots = [slot.name for slot in result.render_slots]
    bpy.ops.spectral_tiles.compare()
    assert scene.spectral_tiles.enabled == is_on and switch.forced is None
    assert [slot.name for slot in result.render_slots] == [*users_slots, "Cycles", "Spectral Tiles"]
    slots = read_slots(tmp_path)
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


def test_refused_comparison_leaves_the_switch_as_it_was():
    scene = build_scene()
    scene.spectral_tiles.pattern = "FILE"
    with pytest.raises(RuntimeError, match="No pattern file"):
        bpy.ops.spectral_tiles.compare()
    assert switch.forced is None and scene.spectral_tiles.enabled


def test_generated_pattern_is_used(tmp_path):
    scene = build_scene()
    path = str(tmp_path / "mine.npz")
    bpy.ops.spectral_tiles.generate_pattern(filepath=path, method="stratified", size="16", seed=3)
    assert (scene.spectral_tiles.pattern, scene.spectral_tiles.pattern_path) == ("FILE", path)
    made = pattern_tile(scene)
    assert made.dims == ("light.u", "light.v", "bsdf.u", "bsdf.v") and made.size == 16
    bpy.ops.render.render()


def test_pattern_into_no_folder_is_refused(tmp_path):
    scene = build_scene()
    with pytest.raises(RuntimeError, match="no such folder"):
        bpy.ops.spectral_tiles.generate_pattern(filepath=str(tmp_path / "missing" / "mine.npz"), size="16")
    assert scene.spectral_tiles.pattern == "AUTO" and pattern_making.job is None


def test_cancelled_pattern_leaves_no_file(tmp_path):
    job = pattern_making.Job(tmp_path / "mine.npz", method="spectral", size=64, dims=("t",), seed=0)
    job.start()
    while job.fraction == 0.0:
        assert job.is_alive()
    job.cancelled = True
    job.join()
    assert job.error is None and os.listdir(tmp_path) == []


def test_picture_of_a_pattern():
    """White noise has a flat spectrum; a spectral tile's is dark in the middle."""
    rng = np.random.default_rng(1)
    white = generator.Tile(("t", "light.u"), rng.random((64, 64, 1, 2), dtype=np.float32))
    blue = generator.load_tile(os.path.join(patterns._FOLDER, "spectral_64.npz"))
    middle = (slice(48, 80), slice(48, 80))
    assert 0.35 < pattern_icons.spectrum(white)[middle].mean() < 0.6
    assert pattern_icons.spectrum(blue)[middle].mean() < 0.1
    assert np.array_equal(pattern_icons.values(white)[:64, :64], white.values[..., 0, 0])
