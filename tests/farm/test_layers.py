# SPDX-License-Identifier: GPL-3.0-or-later
"""Layers of a frame's samples: merged they are the frame; what does not belong together is refused."""

import itertools
import json
import os
import resource
import time

import bpy
import numpy as np
import pytest

import generator
from addon.blender.refusal import Refused
from addon.farm import layers, merge
from addon.interface import command_line, picture_files
from tests import effort, rendering
from tests.farm import damage


@pytest.fixture
def scene_file(tmp_path):
    """A small scene that uses every dimension, with passes of every kind."""
    scene = rendering.empty_scene(48, 36)
    rendering.add_plane(20, rendering.diffuse())
    rendering.spin(rendering.add_plane(2, rendering.glossy(), location=(0, 0, 1)), 40)
    rendering.add_light("AREA", 500, (2, 2, 5), size=2.0)
    rendering.add_light("POINT", 300, (-3, 1, 4))
    rendering.set_world((0.2, 0.3, 0.5))
    camera = rendering.add_camera()
    camera.data.dof.use_dof, camera.data.dof.aperture_fstop, camera.data.dof.focus_distance = True, 0.2, 8
    scene.render.use_motion_blur = True
    # Layers of a frame take the same samples of all pixels.
    scene.spectral_tiles.distribution = "EVEN"
    layer = bpy.context.view_layer
    layer.use_pass_z = layer.use_pass_normal = layer.use_pass_object_index = layer.use_pass_position = True
    layer.use_pass_cryptomatte_object = True
    layer.use_pass_diffuse_direct = layer.use_pass_glossy_direct = layer.use_pass_diffuse_indirect = True
    scene.render.image_settings.media_type = "MULTI_LAYER_IMAGE"
    scene.render.image_settings.file_format = "OPEN_EXR_MULTILAYER"
    scene.render.image_settings.color_depth = "32"
    path = tmp_path / "scene.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    return path


def render(scene_file, output, *options, samples=16):
    arguments = ["render", str(scene_file), "--samples", str(samples), "--output", str(output), *options]
    assert command_line.run(arguments) == command_line.DONE


def render_layers(scene_file, output, count, *options, samples=16):
    for layer in range(1, count + 1):
        render(scene_file, output, "--layer", f"{layer}/{count}", *options, samples=samples)
    return [layers.file_of(str(output), layer, count) for layer in range(1, count + 1)]


def coverages(ranks):
    """Cryptomatte ranks of a pixel as {identifier: coverage}."""
    return {identifier: coverage for identifier, coverage in ranks.reshape(-1, 2).tolist() if coverage > 0.0}


@pytest.mark.parametrize(("count", "tile"), [(4, None), (4, "file"), (3, None)])
def test_merged_layers_are_the_frame(scene_file, tmp_path, count, tile):
    options = []
    if tile:
        values = np.random.default_rng(5).random((16, 16, 1, 5), dtype=np.float32)
        made = generator.Tile(("t", "lens.u", "lens.v", "light.u", "light.v"), values, {"method": "white"})
        generator.save_tile(made, tmp_path / "tile.npz")
        options = ["--pattern", str(tmp_path / "tile.npz")]
    # Large enough for explained noise to be found.
    options += ["--percentage", "300"]
    render(scene_file, tmp_path / "whole.exr", *options)
    render_layers(scene_file, tmp_path / "frame.exr", count, *options)
    assert command_line.run(["merge", str(tmp_path / "frame.exr")]) == command_line.DONE
    whole, merged = (rendering.read_exr(tmp_path / name) for name in ("whole.exr", "frame.exr"))
    # The colours that light was divided by come along.
    assert merged.keys() - whole.keys() == {"ViewLayer.Diffuse Color", "ViewLayer.Glossy Color"}
    for name, pixels in whole.items():
        if "Crypto" in name:
            continue
        # Sixteen sums of single precision on either side.
        rounding = 16 * np.finfo(np.float32).eps * np.abs(pixels).max()
        np.testing.assert_allclose(merged[name], pixels, rtol=0, atol=rounding, err_msg=name)
    ranks = [np.concatenate([image[n] for n in sorted(image) if "Crypto" in n], axis=2) for image in (whole, merged)]
    for pixel in itertools.product(range(0, 36, 5), range(0, 48, 5)):
        expected, found = (coverages(image[pixel]) for image in ranks)
        assert found == pytest.approx(expected, abs=1e-5)
    assert not [path for path in tmp_path.iterdir() if path.name.startswith(".")]


def test_aovs_with_the_names_of_passes(tmp_path):
    """They are light, however they are called: merged they are the frame's."""
    scene = rendering.empty_scene(16, 12)
    material = rendering.diffuse()
    nodes, layer = material.node_tree, bpy.context.view_layer
    noise = nodes.nodes.new("ShaderNodeTexNoise")
    noise.inputs["Scale"].default_value = 50
    aovs = {"Depth": "COLOR", "Diffuse Direct": "COLOR", "Volume Color": "VALUE", "Rim Color": "COLOR"}
    for name, kind in (aovs | {"Rim Direct": "COLOR", "Normal rim": "VALUE", "CryptoObject00": "VALUE"}).items():
        aov = layer.aovs.add()
        aov.name, aov.type = name, kind
        node = nodes.nodes.new("ShaderNodeOutputAOV")
        node.aov_name = name
        nodes.links.new(noise.outputs["Color"], node.inputs["Color"])
        nodes.links.new(noise.outputs[0], node.inputs["Value"])
    layer.cycles.use_pass_volume_direct = layer.cycles.pass_debug_sample_count = True
    layer.cycles.denoising_store_passes = True
    # Beside it is nothing, the depth of which Cycles has as the largest number over that of samples.
    rendering.add_plane(6, material)
    rendering.add_light("AREA", 500, (2, 2, 5), size=4.0)
    rendering.add_camera()
    scene.cycles.pixel_filter_type = "BLACKMAN_HARRIS"
    image = scene.render.image_settings
    image.media_type, image.file_format, image.color_depth = "MULTI_LAYER_IMAGE", "OPEN_EXR_MULTILAYER", "32"
    scene_file = tmp_path / "scene.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(scene_file))
    render(scene_file, tmp_path / "whole.exr")
    merge.merge(render_layers(scene_file, tmp_path / "frame.exr", 3), str(tmp_path / "frame.exr"))
    whole, merged = (rendering.read_exr(tmp_path / name) for name in ("whole.exr", "frame.exr"))
    assert whole.keys() == merged.keys() >= {f"ViewLayer.{name}" for name in aovs}
    for name, pixels in whole.items():
        np.testing.assert_allclose(merged[name], pixels, rtol=0, atol=4e-6 * np.abs(pixels).max(), err_msg=name)
    for name, kind in aovs.items():
        if kind == "COLOR":
            np.testing.assert_array_equal(merged[f"ViewLayer.{name}"], merged["ViewLayer.Rim Direct"], err_msg=name)


def test_order_and_a_retried_task_change_no_bit(scene_file, tmp_path, monkeypatch):
    frame = tmp_path / "frame.exr"
    files = render_layers(scene_file, frame, 4, samples=4)
    merge.merge(files, str(frame))
    first = frame.read_bytes()
    time.sleep(1.1)  # a clock that is read shows
    for order in ((3, 1, 0, 2), (1, 3, 2, 0)):
        merge.merge([files[k] for k in order], str(frame))
        assert frame.read_bytes() == first

    # The third task dies before its file is complete, and runs again.
    before = {path.name for path in tmp_path.iterdir()}

    def die(*_):
        raise OSError("the machine went away")

    (tmp_path / "frame_layer3of4.exr").unlink()
    with monkeypatch.context() as patch:
        patch.setattr(os, "replace", die)
        arguments = ["render", str(scene_file), "--samples", "4", "--output", str(frame), "--layer", "3/4"]
        assert command_line.run(arguments) == command_line.FAILED
    assert {path.name for path in tmp_path.iterdir()} == before - {"frame_layer3of4.exr"}
    assert command_line.run(arguments) == command_line.DONE
    merge.merge(files, str(frame))
    assert frame.read_bytes() == first


def test_what_does_not_belong_together_is_refused(scene_file, tmp_path, monkeypatch, capsys):
    one, _ = render_layers(scene_file, tmp_path / "one.exr", 2, samples=2)

    def refused(expected, *options, samples=2):
        render(scene_file, tmp_path / "two.exr", "--layer", "2/2", *options, samples=samples)
        two = layers.file_of(str(tmp_path / "two.exr"), 2, 2)
        with pytest.raises(Refused, match=expected) as refusal:
            merge.merge([two, one], str(tmp_path / "frame.exr"))
        assert all(os.path.basename(path) in str(refusal.value) for path in (one, two))

    refused("differ in seed: 7 and 0", "--seed", "7")
    refused("differ in pattern: SPECTRAL_64", "--pattern", "spectral_64")
    refused("differ in size: 24 x 18 and 48 x 36", "--percentage", "50")
    refused("differ in samples", samples=4)
    refused("differ in frame", "--frames", "2")
    stamp = layers.stamp
    with monkeypatch.context() as patch:
        patch.setattr(layers, "stamp", lambda engine, known: stamp(engine, known | {"blender": "5.3.0"}))
        refused("differ in blender: 5.3.0")
    for sub_frames, expected in ((8, "differ in sub_frames: 8 and 1"), (9, "differ in sub_frames: 9 and 8")):
        settings = picture_files.open_scene(str(scene_file)).spectral_tiles
        settings.method, settings.sub_frames = "SUB_FRAMES", sub_frames
        bpy.ops.wm.save_as_mainfile(filepath=str(scene_file))
        refused(expected)
        render(scene_file, tmp_path / "one.exr", "--layer", "1/2", samples=2)
    assert not (tmp_path / "frame.exr").exists()

    # Another plan is another arrangement of equally good samples: sound, but not the same picture.
    with monkeypatch.context() as patch:
        patch.setattr(layers, "stamp", lambda engine, known: stamp(engine, known | {"plan.ViewLayer": "0" * 8}))
        render(scene_file, tmp_path / "one.exr", "--layer", "2/2", samples=2)
    assert command_line.run(["merge", str(tmp_path / "one.exr")]) == command_line.DONE
    assert "plans differ" in capsys.readouterr().err


def test_missing_and_truncated_layers_are_named(scene_file, tmp_path):
    frame = str(tmp_path / "frame.exr")
    with pytest.raises(Refused, match="no layers"):
        layers.files_of(frame)
    files = render_layers(scene_file, frame, 4, samples=4)
    with pytest.raises(Refused, match="No layer holds samples 3 to 3 of 4"):
        merge.merge([files[0], files[1], files[3]], frame)
    with pytest.raises(Refused, match=r"frame_layer2of4\.exr and .*frame_layer2of4\.exr hold the same samples"):
        merge.merge([*files, files[1]], frame)
    third = tmp_path / "frame_layer3of4.exr"
    whole = third.read_bytes()
    for size in (0, 100, len(whole) // 2, len(whole) - 100):
        third.write_bytes(whole[:size])
        with pytest.raises(Refused, match=r"frame_layer3of4\.exr is damaged"):
            merge.merge(files, frame)
    third.unlink()
    with pytest.raises(Refused, match=r"Missing: .*frame_layer3of4\.exr"):
        layers.files_of(frame)
    assert not (tmp_path / "frame.exr").exists()


def test_a_subset_beyond_the_samples_is_refused(scene_file, capsys):
    scene = bpy.context.scene
    scene.cycles.use_sample_subset, scene.cycles.sample_offset = True, scene.cycles.samples
    bpy.ops.wm.save_mainfile()
    assert command_line.run(["render", str(scene_file)]) == command_line.FAILED
    assert "sample subset starts" in capsys.readouterr().err


def test_a_denoised_layer_is_refused(scene_file, tmp_path):
    """As a farm may make it that sets Cycles' sample subset by itself."""
    scene = bpy.context.scene
    scene.spectral_tiles.enabled = True
    scene.cycles.use_denoising = True
    path = str(tmp_path / "layer.exr")
    picture_files.render(scene, path)
    with pytest.raises(Refused, match=r"layer\.exr was denoised"):
        merge.merge([path], str(tmp_path / "frame.exr"))


def test_divided_light_without_its_colour_is_refused(scene_file, tmp_path):
    scene = bpy.context.scene
    scene.spectral_tiles.enabled = True
    path = str(tmp_path / "layer.exr")
    picture_files.render(scene, path)
    with pytest.raises(Refused, match="switch on the pass Diffuse Color"):
        merge.merge([path], str(tmp_path / "frame.exr"))


def test_many_layers_take_neither_open_files_nor_memory(tmp_path, capfd):
    rendering.empty_scene(16, 12)
    rendering.add_plane(20, rendering.diffuse())
    rendering.add_light("AREA", 500, (2, 2, 5), size=4.0)
    rendering.add_camera()
    layer = bpy.context.view_layer
    layer.use_pass_cryptomatte_object = layer.use_pass_cryptomatte_material = layer.use_pass_z = True
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scene.blend"))
    (one,) = render_layers(tmp_path / "scene.blend", tmp_path / "one.exr", 1, samples=1)
    count = 300
    for number in range(count):
        target = layers.file_of(str(tmp_path / "frame.exr"), number + 1, count)
        damage.lie(one, target, {"samples": str(count), "subset": f"{number} 1"})
    before = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (len(os.listdir("/proc/self/fd")) + 90, before[1]))
    try:
        with effort.within(60, 40e6):
            assert command_line.run(["merge", str(tmp_path / "frame.exr")]) == command_line.DONE
    finally:
        resource.setrlimit(resource.RLIMIT_NOFILE, before)
    # While they are read and while they are summed, too.
    percents = [int(line.split()[1]) for line in capfd.readouterr().out.splitlines() if "progress" in line]
    assert percents[-101:] == list(range(101))
    (whole, merged) = (rendering.read_exr(path) for path in (one, tmp_path / "frame.exr"))
    for name, pixels in whole.items():
        np.testing.assert_allclose(merged[name], pixels, rtol=1e-6, err_msg=name)


@pytest.mark.parametrize("most_open", [64, 1])
def test_a_layer_that_is_replaced_while_it_is_merged_is_merged_as_it_was_or_named(
    scene_file, tmp_path, monkeypatch, most_open
):
    files = render_layers(scene_file, tmp_path / "frame.exr", 2, samples=2)
    check = merge.check_complete

    def replace(found):
        check(found)
        render(scene_file, tmp_path / "frame.exr", "--layer", "2/2", "--seed", "7", samples=2)

    merge.merge(files, str(tmp_path / "before.exr"))
    monkeypatch.setattr(merge, "check_complete", replace)
    monkeypatch.setattr(merge, "_MOST_OPEN", most_open)
    if most_open < len(files):
        with pytest.raises(Refused, match=r"frame_layer2of2\.exr has become another file meanwhile"):
            merge.merge(files, str(tmp_path / "frame.exr"))
        assert not (tmp_path / "frame.exr").exists()
        return
    merge.merge(files, str(tmp_path / "frame.exr"))
    before, merged = (rendering.read_exr(tmp_path / name) for name in ("before.exr", "frame.exr"))
    assert all(np.array_equal(before[name], merged[name]) for name in before)


def test_layers_without_a_digest_are_told(scene_file, tmp_path, capsys):
    """As Blender writes them when a farm sets Cycles' sample subset by itself."""
    files = render_layers(scene_file, tmp_path / "frame.exr", 2, samples=2)
    line = ["merge", str(tmp_path / "frame.exr"), "--json", str(tmp_path / "merge.json")]
    for is_sealed in (True, False):
        assert command_line.run(line) == command_line.DONE
        said = capsys.readouterr().err
        assert said.splitlines() == [] if is_sealed else len(said.splitlines()) == 1 and "without a digest" in said
        assert json.loads((tmp_path / "merge.json").read_text())["sealed"] == is_sealed
        with open(files[1], "r+b") as file:
            data = damage.unsealed(file.read())
            file.seek(0)
            file.write(data)


def test_parts_are_all_samples():
    for samples, count in ((16, 4), (16, 3), (5, 5)):
        parts = [layers.part(samples, layer, count) for layer in range(1, count + 1)]
        taken = [sample for first, length in parts for sample in range(first, first + length)]
        assert taken == list(range(samples))
        assert max(length for _, length in parts) - min(length for _, length in parts) <= 1
