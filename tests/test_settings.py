# SPDX-License-Identifier: GPL-3.0-or-later
"""The settings behave as Blender's own do: descriptions, animation, files."""

import bpy
import pytest

from tests import rendering


def settings():
    return bpy.context.scene.spectral_tiles


def own_properties():
    return [prop for prop in settings().bl_rna.properties if prop.identifier not in {"rna_type", "name"}]


def test_every_property_is_described_and_overridable():
    for prop in own_properties():
        assert prop.description and not prop.description.endswith("."), prop.identifier
        assert prop.is_overridable, prop.identifier


def test_what_can_be_animated():
    scene = rendering.empty_scene()
    assert {prop.identifier for prop in own_properties() if prop.is_animatable} >= {"samples", "seed"}
    for frame, samples in ((1, 2), (11, 12)):
        settings().samples = samples
        scene.keyframe_insert("spectral_tiles.samples", frame=frame)
    scene.driver_add("spectral_tiles.seed").driver.expression = "frame * 2"
    scene.frame_set(11)
    assert (settings().samples, settings().seed) == (12, 22)
    with pytest.raises(TypeError, match="not animatable"):
        scene.keyframe_insert("spectral_tiles.tile", frame=1)


def test_saved_in_the_file(tmp_path):
    rendering.empty_scene()
    settings().samples, settings().tile, settings().tile_path = 7, "FILE", "//mine.npz"
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scene.blend"))
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "scene.blend"))
    assert (settings().samples, settings().tile, settings().tile_path) == (7, "FILE", "//mine.npz")


def test_files_of_other_versions_load(extension, tmp_path):
    """Settings that a file lacks have their defaults, and those that are gone are ignored."""
    rendering.empty_scene()
    extension.unregister()

    class OtherVersion(bpy.types.PropertyGroup):
        samples: bpy.props.IntProperty()
        gone: bpy.props.StringProperty()

    bpy.utils.register_class(OtherVersion)
    bpy.types.Scene.spectral_tiles = bpy.props.PointerProperty(type=OtherVersion)
    settings().samples, settings().gone = 5, "something"
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "other.blend"))
    del bpy.types.Scene.spectral_tiles
    bpy.utils.unregister_class(OtherVersion)
    extension.register()
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "other.blend"))
    assert (settings().samples, settings().tile, settings().driver) == (5, "AUTO", "AUTO")


def test_registers_again_and_again(extension):
    def traces():
        handlers = [
            len(found) for name in dir(bpy.app.handlers) if isinstance(found := getattr(bpy.app.handlers, name), list)
        ]
        classes = sorted(name for name in dir(bpy.types) if "spectral_tiles" in name.lower())
        return handlers, classes, bpy.utils.preset_paths("spectral_tiles")

    rendering.empty_scene()
    settings().samples = 7
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
    assert settings().samples == 7
