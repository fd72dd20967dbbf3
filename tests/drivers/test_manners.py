# SPDX-License-Identifier: GPL-3.0-or-later
"""A render leaves the user's file as it was, and says in one line why it cannot be done."""

import os
import tracemalloc

import bpy
import numpy as np
import pytest

import generator
from addon.blender import refusal
from addon.cycles import passes, plan_image, session
from addon.picture import picture
from addon.plan import arranged_plan
from tests import rendering


def build_scene(method="GATHER"):
    scene = rendering.empty_scene(16, 16)
    scene.spectral_tiles.method = method
    camera = rendering.add_camera((0, -5, 5), (np.radians(45), 0, 0))
    camera.data.dof.use_dof = True
    camera.data.shift_x = 0.1
    rendering.add_plane(8, rendering.diffuse())
    rendering.add_light("AREA", 300, (1, -1, 4), size=2)
    bpy.context.view_layer.use_pass_z = True
    scene.spectral_tiles.enabled = True
    return scene


def simple_properties(data, depth=2):
    """Values of all properties of a data-block, and of those inside it, as a dict."""
    found = {}
    for prop in data.bl_rna.properties:
        if prop.identifier in {"rna_type", "is_evaluated", "animation_data", "original", "depsgraph"}:
            continue
        value = getattr(data, prop.identifier)
        if prop.type in {"BOOLEAN", "INT", "FLOAT", "STRING", "ENUM"}:
            found[prop.identifier] = tuple(value) if getattr(prop, "is_array", False) else value
        elif prop.type == "POINTER" and depth and value is not None and not isinstance(value, bpy.types.ID):
            found |= {f"{prop.identifier}.{k}": v for k, v in simple_properties(value, depth - 1).items()}
    return found


def snapshot():
    bpy.context.view_layer.update()
    scene = bpy.context.scene
    parts = {"scene": scene, "camera": scene.camera, "layer": bpy.context.view_layer, "world": scene.world}
    if scene.camera:
        parts["camera data"] = scene.camera.data
    values = {name: simple_properties(part) for name, part in parts.items() if part}
    if scene.camera and scene.camera.type == "CAMERA":
        values["custom"] = dict(scene.camera.data.cycles_custom.items())
    return repr(values)


def render_expecting(message):
    before, files = snapshot(), set(os.listdir(bpy.app.tempdir))
    with pytest.raises(RuntimeError, match=message):
        bpy.ops.render.render()
    assert snapshot() == before
    assert set(os.listdir(bpy.app.tempdir)) == files


def test_custom_camera():
    build_scene().camera.data.type = "CUSTOM"
    render_expecting("custom lens")


def test_perspective_spherical_stereo():
    scene = build_scene()
    scene.render.use_multiview = True
    scene.camera.data.stereo.use_spherical_stereo = True
    render_expecting("Spherical Stereo")


def test_rolling_shutter():
    scene = build_scene()
    scene.render.use_motion_blur = True
    scene.cycles.rolling_shutter_type = "TOP"
    render_expecting("Rolling Shutter")


def test_culling():
    scene = build_scene()
    scene.render.use_simplify = scene.cycles.use_distance_cull = True
    render_expecting("Culling")


def test_mist_of_an_orthographic_camera():
    build_scene().camera.data.type = "ORTHO"
    bpy.context.view_layer.use_pass_mist = True
    render_expecting("Mist pass")


@pytest.mark.parametrize("grouped", [False, True])
def test_window_coordinates(grouped):
    build_scene()
    material = bpy.data.materials["ShaderNodeBsdfDiffuse"]
    tree = material.node_tree
    diffuse = next(node for node in tree.nodes if node.type == "BSDF_DIFFUSE")
    coordinates = tree.nodes.new("ShaderNodeTexCoord")
    bpy.ops.render.render()
    if grouped:
        group = bpy.data.node_groups.new("Group", "ShaderNodeTree")
        group.interface.new_socket("Window", in_out="OUTPUT", socket_type="NodeSocketVector")
        inside = group.nodes.new("ShaderNodeTexCoord")
        group.links.new(inside.outputs["Window"], group.nodes.new("NodeGroupOutput").inputs["Window"])
        coordinates = tree.nodes.new("ShaderNodeGroup")
        coordinates.node_tree = group
    tree.links.new(coordinates.outputs["Window"], diffuse.inputs["Color"])
    render_expecting('Window coordinates in "ShaderNodeBsdfDiffuse"')


def test_lamp_as_camera():
    scene = build_scene()
    scene.camera = next(made for made in scene.objects if made.type == "LIGHT")
    render_expecting("not a camera")


def test_vector_pass():
    build_scene()
    bpy.context.view_layer.use_pass_vector = True
    render_expecting("Vector pass")


def test_device_without_osl(monkeypatch):
    scene = build_scene()
    scene.cycles.device = "GPU"
    preferences = type(bpy.context.preferences.addons["cycles"].preferences)
    monkeypatch.setattr(preferences, "get_compute_device_type", lambda self: "CUDA")
    monkeypatch.setattr(preferences, "has_active_device", lambda self: True)
    render_expecting("set Device to CPU")


@pytest.mark.parametrize("content", [None, b"", b"no tile at all"], ids=["missing", "empty", "garbage"])
def test_broken_tile(tmp_path, content):
    scene = build_scene()
    path = tmp_path / "tile.npz"
    if content is not None:
        path.write_bytes(content)
    scene.spectral_tiles.pattern = "FILE"
    scene.spectral_tiles.pattern_path = str(path)
    render_expecting("Cannot use the pattern")


def test_plan_cannot_be_written(monkeypatch, tmp_path):
    """A full disk or an unwritable folder is one line, as any other refusal."""
    build_scene()
    write = plan_image.write
    monkeypatch.setattr(plan_image, "write", lambda made, path: write(made, str(tmp_path / "missing" / "plan.tif")))
    render_expecting("Cannot write the sample plan")


def test_cancelled_while_it_plans(monkeypatch):
    """Nothing is rendered, and nothing said."""
    build_scene()

    def cancel(*_):
        raise refusal.Cancelled

    before, files = snapshot(), set(os.listdir(bpy.app.tempdir))
    monkeypatch.setattr(arranged_plan, "make", cancel)
    monkeypatch.setattr(session.Session, "call", lambda *_: pytest.fail("rendered"))
    bpy.ops.render.render()
    assert snapshot() == before
    assert set(os.listdir(bpy.app.tempdir)) == files


def test_a_cancelled_picture_is_put_in_order(monkeypatch):
    build_scene()
    call, moved, ordered = session.Session.call, picture.Picture.moved, []
    monkeypatch.setattr(picture.Picture, "moved", lambda *given: ordered.append(1) or moved(*given))

    def cancelled_call(own, *arguments):
        own.engine = rendering.CancelledSoon(own.engine, 0)
        return call(own, *arguments)

    monkeypatch.setattr(session.Session, "call", cancelled_call)
    bpy.ops.render.render()
    assert ordered


@pytest.mark.parametrize("persistent", [False, True])
@pytest.mark.parametrize("where", [(arranged_plan, "make"), (passes, "read")], ids=lambda where: where[1])
def test_a_mistake_of_ours_ends_in_one_line(monkeypatch, capfd, tmp_path, where, persistent):
    """... and the next render, of another scene, knows nothing of it."""

    def fail(*_):
        raise ZeroDivisionError("a mistake")

    build_scene().render.use_persistent_data = persistent
    wanted = rendering.beauty(rendering.render(tmp_path, "SPECTRAL_TILES"))
    with monkeypatch.context() as patched:
        patched.setattr(*where, fail)
        render_expecting("Spectral Tiles failed.*a mistake")
    assert "in fail" in capfd.readouterr().err
    assert np.array_equal(rendering.beauty(rendering.render(tmp_path, "SPECTRAL_TILES")), wanted)
    build_scene()
    assert np.array_equal(rendering.beauty(rendering.render(tmp_path, "SPECTRAL_TILES")), wanted)


def test_no_tile_file_set():
    build_scene().spectral_tiles.pattern = "FILE"
    render_expecting("No pattern file is set")


def test_a_tile_of_the_users(tmp_path):
    """A tile file drives a render whose expectation is native's."""
    dims = ("t", "lens.u", "lens.v", "light.u", "light.v")
    values = np.random.default_rng(5).random((16, 16, 1, 5), dtype=np.float32)
    path = tmp_path / "tile.npz"
    generator.save_tile(generator.Tile(dims, values, {"method": "white", "seed": 5}), path)
    scene = build_scene()
    scene.camera.data.dof.aperture_fstop = 0.05
    scene.camera.data.dof.focus_distance = 4.0
    scene.spectral_tiles.pattern, scene.spectral_tiles.pattern_path = "FILE", str(path)
    seeds = range(40)
    ours, native = (rendering.stack(tmp_path, engine, seeds) for engine in reversed(rendering.ENGINES))
    rendering.assert_same_expectation(ours, native)


@pytest.mark.parametrize("persistent", [False, True])
def test_changes_between_renders_count(tmp_path, persistent):
    """Nothing of an earlier render is left in a later one, though Blender may keep its evaluated scene."""
    scene = build_scene()
    scene.render.use_persistent_data = persistent
    rendering.slide(scene.camera, (-1, -5, 5), (1, -5, 5))

    def changed(lens, width, denoise, frame):
        scene.camera.data.lens, scene.cycles.filter_width = lens, width
        scene.cycles.pixel_filter_type = "BLACKMAN_HARRIS"
        scene.cycles.use_denoising = denoise
        scene.frame_set(frame)
        return rendering.beauty(rendering.render(tmp_path, "SPECTRAL_TILES"))

    settings = [(50, 1.5, False, 1), (30, 1.5, False, 1), (30, 2.5, True, 1), (30, 2.5, True, 2), (50, 1.5, False, 1)]
    images = [changed(*each) for each in settings]
    scene.render.use_persistent_data = False
    for image, each in zip(images, settings, strict=True):
        assert np.array_equal(image, changed(*each))
    assert not np.array_equal(images[0], images[1])


@pytest.mark.parametrize("method", ["AUTO", "IN_PLACE", "GATHER", "SUB_FRAMES"])
@pytest.mark.parametrize("size", [(300, 200), (8200, 8)])
def test_pictures_larger_than_cycles_tiles(tmp_path, size, method):
    """Cycles writes them to a file first: more than the user's tile, more than the largest one."""
    scene = rendering.empty_scene(*size)
    scene.spectral_tiles.method = method
    scene.cycles.tile_size = 128
    scene.view_layers.new("Second").use_pass_position = True
    rendering.add_camera((0, -5, 5), (np.radians(45), 0, 0))
    rendering.add_plane(100)
    bpy.context.view_layer.use_pass_position = True
    native, ours = (rendering.render(tmp_path, engine, samples=16) for engine in rendering.ENGINES)
    for layer in ("ViewLayer", "Second"):
        assert np.allclose(ours[f"{layer}.Position"], native[f"{layer}.Position"], atol=1e-3)


def test_passes_are_in_memory_once(monkeypatch):
    """And one of them twice, while its pixels are put in order; the plan takes 16 bytes a pixel at most."""
    side = 512
    scene = build_scene()
    scene.render.resolution_x = scene.render.resolution_y = side
    layer = bpy.context.view_layer
    layer.use_pass_normal = layer.use_pass_diffuse_direct = layer.use_pass_emit = True
    bpy.ops.render.render()  # makes the plan
    read, sizes = passes.read, []

    def read_and_measure(*arguments):
        found = read(*arguments)
        sizes.append(sum(pixels.nbytes for pixels in found.values()))
        return found

    monkeypatch.setattr(passes, "read", read_and_measure)
    tracemalloc.start()
    bpy.ops.render.render()
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak - sizes[0] <= (16 + 16) * side**2
