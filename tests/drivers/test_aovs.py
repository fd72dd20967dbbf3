# SPDX-License-Identifier: GPL-3.0-or-later
"""Users call their AOVs as they like: what a pass holds follows from Cycles' type of it, not from its name."""

import bpy
import numpy as np
import pytest

from addon.picture import accumulation
from tests import rendering

#: Names of Cycles' own passes, of data, that begin like them, that differ in case only, and of other alphabets.
NAMES = (
    "Depth", "Position", "Normal", "UV", "Object Index", "Diffuse Color", "Glossy Color", "Volume Color", "Rim Direct",
    "Rim Color", "Normal rim", "Depth fog", "Debug Sample Count", "CryptoObject00", "Noisy Image", "depth", "Tiefe äöü",
    "深度", "Combined_key",
)  # fmt: skip

METHODS = {
    "in place": {"method": "IN_PLACE"},
    "gather": {"method": "GATHER"},
    "filter": {"filter": "TENT", "filter_width": 1.0},
    "automatic": {},
}


def build_scene(names, kinds):
    """An emissive landscape without chance, whose AOVs show the position, each in a scale of its own."""
    scene = rendering.empty_scene(24, 18)
    rendering.add_camera((0, -6, 4), (np.radians(58), 0, 0))
    material = rendering.emission()
    tree = material.node_tree
    position = tree.nodes.new("ShaderNodeNewGeometry").outputs["Position"]
    layer = bpy.context.view_layer
    for name, kind in zip(names, kinds, strict=True):
        aov = layer.aovs.add()
        aov.name, aov.type = name, kind
        node, scaled = tree.nodes.new("ShaderNodeOutputAOV"), tree.nodes.new("ShaderNodeVectorMath")
        node.aov_name = aov.name
        scaled.operation, scaled.inputs["Scale"].default_value = "SCALE", 1.0 + 0.1 * len(layer.aovs)
        tree.links.new(position, scaled.inputs[0])
        tree.links.new(scaled.outputs[0], node.inputs["Color" if kind == "COLOR" else "Value"])
    rendering.add_plane(30, material)
    return scene, [aov for aov in layer.aovs if aov.is_valid]


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("kind", ["COLOR", "VALUE"])
def test_aovs_with_names_of_passes(tmp_path, method, kind):
    # Gather says that it needs passes of these names itself.
    names = [name for name in NAMES if name not in {"Depth", "Position"} or method not in {"gather", "filter"}]
    scene, aovs = build_scene(names, [kind] * len(names))
    assert len(aovs) > 12
    for name, value in METHODS[method].items():
        setattr(scene.spectral_tiles, name, value)
    # One sample in the middle of each pixel has one possible result, but where a filter takes it elsewhere.
    samples, allowed = (16, 0.06) if method == "filter" else (1, 2e-4)
    native = rendering.render(tmp_path, "CYCLES", samples)
    ours = rendering.render(tmp_path, "SPECTRAL_TILES", samples)
    assert native.keys() <= ours.keys()
    if kind == "VALUE":
        # Of a value of this name Cycles' own renders differ from time to time, in some pixels.
        del native["ViewLayer.Normal"]
    for name, pixels in native.items():
        inner = (slice(2, -2), slice(2, -2))
        assert np.allclose(ours[name][inner], pixels[inner], atol=allowed * (1 + np.abs(pixels).max())), name


def test_lights_are_not_lost_to_an_aov_called_like_their_colour(tmp_path):
    """Volume Direct beside an AOV called Volume Color, Diffuse Direct beside one called Diffuse Color."""
    scene, _ = build_scene(("Volume Color", "Diffuse Color"), ("VALUE", "COLOR"))
    rendering.add_plane(3, rendering.diffuse((0.5, 0.2, 0.8)), (0, 0, 0.2))
    rendering.add_light("SUN", 2.0, (0, 0, 5), angle=0.0)
    layer = bpy.context.view_layer
    layer.use_pass_diffuse_direct = layer.cycles.use_pass_volume_direct = True
    native = rendering.render(tmp_path, "CYCLES", 16)
    for method in ("in place", "automatic", "gather"):
        scene.spectral_tiles.method = METHODS[method].get("method", "AUTO")
        ours = rendering.render(tmp_path, "SPECTRAL_TILES", 16)
        for name in ("ViewLayer.Diffuse Direct", "ViewLayer.Volume Direct"):
            assert ours[name].mean() == pytest.approx(native[name].mean(), rel=0.02), (name, method)
    scene.spectral_tiles.filter = "TENT"
    with pytest.raises(RuntimeError, match="name of a color pass"):
        rendering.render(tmp_path, "SPECTRAL_TILES")


EVERY = METHODS | {
    "rounds": {},
    "sub-frames": {"method": "SUB_FRAMES", "sub_frames": 8},
    "sub-frames and filter": {"method": "SUB_FRAMES", "sub_frames": 8, "filter": "GAUSSIAN"},
    "pattern": {"pattern": "SPECTRAL"},
    "lobes": {"filter": "MITCHELL_NETRAVALI"},
}

#: Of 40 AOVs, and of objects.
FORTY = (*(f"Layer {number}" for number in range(33)), "rim", "Rim", "RIM", "Tiefe äöü", "深度", "Ω", "a_b c")
MATTES = ("ob", "OB", "Öb", "物", "ob.R", "ob 2")


def mattes(passes):
    """Coverage of each identifier, over blocks of pixels."""
    found = {}
    for name, pixels in passes.items():
        if "CryptoObject" in name:
            for identifier, coverage in ((pixels[..., 0], pixels[..., 1]), (pixels[..., 2], pixels[..., 3])):
                for one in np.unique(identifier[coverage > 0.0]):
                    found[one] = found.get(one, 0.0) + np.where(identifier == one, coverage, 0.0)
    return found


def blocks(pixels):
    """Means over blocks of 6 x 6 pixels, without the border."""
    height, width = (length // 6 for length in pixels.shape[:2])
    pixels = pixels[: 6 * height, : 6 * width]
    return pixels.reshape(height, 6, width, 6, -1).mean(axis=(1, 3))


@pytest.mark.parametrize("method", EVERY)
def test_forty_aovs_and_sixteen_levels_of_cryptomatte(tmp_path, monkeypatch, method):
    """By as many samples as spread over rounds, sub-frames and a filter's pixels, of things that move and overlap."""
    scene, aovs = build_scene(FORTY, ["COLOR", "VALUE"] * 20)
    assert len(aovs) == 40
    for number, name in enumerate(MATTES):
        thing = rendering.add_plane(1.7, rendering.emission(), (0.9 * number - 2.2, 0.3 * number, 0.5 + 0.2 * number))
        thing.name = name
    rendering.add_plane(4, rendering.diffuse(), (2, 4, 0.1)).name = "noisy"
    rendering.add_light("AREA", 200, (4, 1, 5), size=4.0)
    rendering.slide(bpy.data.objects["OB"], (-2, -1, 1), (-2, 2, 1))
    scene.render.use_motion_blur = True
    layer = bpy.context.view_layer
    layer.use_pass_cryptomatte_object, layer.pass_cryptomatte_depth = True, 16
    layer.use_pass_normal = layer.use_pass_uv = True
    if method == "rounds":
        scene.cycles.use_adaptive_sampling, scene.cycles.adaptive_threshold = True, 0.02
    native = rendering.render(tmp_path, "CYCLES", 64)
    for name, value in EVERY[method].items():
        setattr(scene.spectral_tiles, name, value)
    shots, add = [], accumulation.Accumulation.add
    monkeypatch.setattr(accumulation.Accumulation, "add", lambda *of: shots.append(of[-2:]) or add(*of))
    ours = rendering.render(tmp_path, "SPECTRAL_TILES", 64)
    assert len(set(shots)) > 2 or method not in {"rounds", "automatic"}
    assert native.keys() == ours.keys() >= {f"ViewLayer.{name}" for name in FORTY}
    theirs, found = mattes(native), mattes(ours)
    assert theirs.keys() == found.keys() and len(found) == len(MATTES) + 2
    for one, coverage in theirs.items():
        np.testing.assert_allclose(blocks(found[one]), blocks(coverage), atol=0.06)
    for name, pixels in native.items():
        if "Crypto" not in name:
            scale = float(np.abs(pixels).max())
            np.testing.assert_allclose(blocks(ours[name]), blocks(pixels), atol=0.06 * scale, err_msg=name)
            assert ours[name].mean() == pytest.approx(pixels.mean(), abs=0.01 * scale), name


@pytest.mark.parametrize("kind", ["COLOR", "VALUE"])
def test_an_aov_called_vector_is_not_lost_to_sub_frames(tmp_path, kind):
    """Cycles takes it for its own pass where nothing is blurred."""
    scene, _ = build_scene(("Vector",), (kind,))
    scene.render.use_motion_blur = True
    native = rendering.render(tmp_path, "CYCLES", 8)["ViewLayer.Vector"]
    assert native.any()
    scene.spectral_tiles.method, scene.spectral_tiles.sub_frames = "SUB_FRAMES", 8
    with pytest.raises(RuntimeError, match=r'AOV "Vector".*rename it'):
        rendering.render(tmp_path, "SPECTRAL_TILES", 8)
    scene.spectral_tiles.method = "IN_PLACE"
    ours = rendering.render(tmp_path, "SPECTRAL_TILES", 8)["ViewLayer.Vector"]
    np.testing.assert_allclose(blocks(ours), blocks(native), rtol=1e-4, atol=1e-4)


@pytest.mark.parametrize("method", EVERY)
def test_the_denoising_depth_of_nothing_is_cycles(tmp_path, method):
    """Of a pixel with any sample that hits nothing it is the largest number over their number."""
    samples = 16
    scene, _ = build_scene((), ())
    bpy.data.objects["Plane"].scale *= 0.15
    rendering.add_plane(2, rendering.diffuse(), (1, 0.5, 0.6))
    rendering.add_light("AREA", 100, (2, -1, 4), size=2.0)
    scene.render.use_motion_blur = True
    bpy.context.view_layer.cycles.denoising_store_passes = True
    native = rendering.render(tmp_path, "CYCLES", samples)["ViewLayer.Denoising Depth"]
    for name, value in EVERY[method].items():
        setattr(scene.spectral_tiles, name, value)
    ours = rendering.render(tmp_path, "SPECTRAL_TILES", samples)["ViewLayer.Denoising Depth"]
    nothing = np.finfo(np.float32).max / samples
    far = native > 1e6
    assert 0.2 < far.mean() < 0.8 and ((ours > 1e6) != far).mean() < 0.05
    np.testing.assert_allclose(native[far], nothing, rtol=1e-6)
    np.testing.assert_allclose(ours[ours > 1e6], nothing, rtol=1e-6)
    both = ~far & (ours < 1e6)
    assert ours[both].mean() == pytest.approx(native[both].mean(), rel=0.02)
