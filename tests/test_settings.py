# SPDX-License-Identifier: GPL-3.0-or-later
"""The settings behave as Blender's own do: descriptions, animation, files."""

import pytest

pytest.importorskip("bpy")

import bpy

from tests import rendering


@pytest.fixture(autouse=True)
def _registered(extension):
    pass


def settings():
    return bpy.context.scene.spectral_tiles


def own_properties():
    return [prop for prop in settings().bl_rna.properties if prop.identifier not in {"rna_type", "name"}]


def test_every_property_is_described_and_overridable():
    for prop in own_properties():
        assert prop.description and not prop.description.endswith("."), prop.identifier
        assert prop.is_overridable, prop.identifier


def test_what_can_be_animated():
    """The switch can, as Cycles' own; what changes the way of a render cannot."""
    scene = rendering.empty_scene()
    for frame, is_on in ((1, False), (11, True)):
        settings().enabled = is_on
        scene.keyframe_insert("spectral_tiles.enabled", frame=frame)
    scene.driver_add("spectral_tiles.sub_frames").driver.expression = "frame * 2"
    scene.frame_set(11)
    assert (settings().enabled, settings().sub_frames) == (True, 22)
    scene.frame_set(1)
    assert not settings().enabled
    with pytest.raises(TypeError, match="not animatable"):
        scene.keyframe_insert("spectral_tiles.pattern", frame=1)


def test_names_that_farms_and_scripts_rely_on():
    names = {prop.identifier for prop in own_properties()}
    assert names == {
        "enabled", "method", "distribution", "pattern", "pattern_path", "filter", "filter_width",
        "filter_b", "filter_c", "sub_frames",
    }  # fmt: skip
    items = {name: set(settings().bl_rna.properties[name].enum_items.keys()) for name in ("method", "distribution")}
    assert items == {"method": {"AUTO", "IN_PLACE", "GATHER", "SUB_FRAMES"}, "distribution": {"BY_NOISE", "EVEN"}}


def test_off_by_default():
    rendering.empty_scene()
    assert not settings().enabled


def test_saved_in_the_file(tmp_path):
    rendering.empty_scene()
    settings().enabled, settings().pattern, settings().pattern_path = True, "FILE", "//mine.npz"
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scene.blend"))
    bpy.ops.wm.read_factory_settings(use_empty=True)
    assert not settings().enabled
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "scene.blend"))
    assert settings().enabled and (settings().pattern, settings().pattern_path) == ("FILE", "//mine.npz")


def test_a_file_opens_in_cycles_without_the_extension(extension, tmp_path):
    """... with all that was set there, and what was set here is there again once the extension is."""
    scene = rendering.empty_scene()
    settings().enabled, settings().sub_frames = True, 33
    scene.cycles.samples, scene.cycles.use_adaptive_sampling = 4096, True
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scene.blend"))
    extension.unregister()
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "scene.blend"))
    scene = bpy.context.scene
    assert (scene.render.engine, scene.cycles.samples, scene.cycles.use_adaptive_sampling) == ("CYCLES", 4096, True)
    extension.register()
    assert settings().enabled and settings().sub_frames == 33


def test_files_of_other_versions_load(extension, tmp_path):
    """Settings that a file lacks have their defaults, and those that are gone are ignored."""
    rendering.empty_scene()
    extension.unregister()

    class OtherVersion(bpy.types.PropertyGroup):
        enabled: bpy.props.BoolProperty()
        gone: bpy.props.StringProperty()

    bpy.utils.register_class(OtherVersion)
    bpy.types.Scene.spectral_tiles = bpy.props.PointerProperty(type=OtherVersion)
    settings().enabled, settings().gone = True, "something"
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "other.blend"))
    del bpy.types.Scene.spectral_tiles
    bpy.utils.unregister_class(OtherVersion)
    extension.register()
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "other.blend"))
    assert settings().enabled and (settings().pattern, settings().method) == ("AUTO", "AUTO")


def test_registers_again_and_again(extension):
    def traces():
        handlers = [
            len(found) for name in dir(bpy.app.handlers) if isinstance(found := getattr(bpy.app.handlers, name), list)
        ]
        classes = sorted(name for name in dir(bpy.types) if "spectral_tiles" in name.lower())
        keymaps = bpy.context.window_manager.keyconfigs.addon.keymaps
        keys = [item.idname for keymap in keymaps for item in keymap.keymap_items if "spectral_tiles" in item.idname]
        return handlers, classes + keys, bpy.utils.preset_paths("spectral_tiles")

    rendering.empty_scene()
    settings().sub_frames = 17
    before = traces()
    extension.unregister()
    without = traces()
    assert not without[1] and not without[2] and sum(without[0]) < sum(before[0])
    for _ in range(20):
        extension.register()
        assert traces() == before
        extension.unregister()
        assert traces() == without
    extension.register()
    assert settings().sub_frames == 17
