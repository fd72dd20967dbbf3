# SPDX-License-Identifier: GPL-3.0-or-later
"""Compositor, sequencer, several scenes and view layers: each picture is by the switch of its own scene."""

import itertools

import pytest

pytest.importorskip("bpy")

import bpy
import numpy as np

from addon import drivers
from addon.drivers import rounds
from addon.plan import rounds as plan_rounds
from tests import rendering

SAMPLES = 64


@pytest.fixture(autouse=True)
def _registered(extension):
    pass


@pytest.fixture
def ours(monkeypatch):
    """Scene and view layer of each render that our drivers were asked for."""
    asked = []
    render = drivers.render

    def watched(engine, depsgraph, *job):
        asked.append((depsgraph.scene.name, depsgraph.view_layer.name))
        render(engine, depsgraph, *job)

    monkeypatch.setattr(drivers, "render", watched)
    return asked


def fill(scene):
    """A sharp and a soft shadow, so that some of the picture takes more samples than the rest."""
    bpy.context.window.scene = scene
    rendering.add_plane(20, rendering.diffuse())
    rendering.add_plane(2, rendering.diffuse((0.2, 0.5, 0.7)), (1, 0, 2))
    rendering.add_light("AREA", 500, (2, 2, 5), size=2.0)
    rendering.add_camera()
    return scene


def build_scenes():
    """The main scene, and another one, a copy that is seen from elsewhere."""
    main = fill(rendering.empty_scene(32, 24))
    main.name = "Main"
    other = main.copy()
    other.name = "Other"
    other.camera = rendering.add(main.camera.data, (2, 1, 8))
    for scene in (main, other):
        scene.cycles.samples = SAMPLES
        # By which a picture of ours is another one than Cycles', and the same each time.
        scene.cycles.use_adaptive_sampling, scene.cycles.adaptive_threshold = True, 0.05
    return main, other


def composite(scene, *rendered):
    """Have a scene show twice the light of other scenes' pictures, added up, at once."""
    tree = scene.compositing_node_group = bpy.data.node_groups.new("Compositor", "CompositorNodeTree")
    tree.interface.new_socket("Image", in_out="OUTPUT", socket_type="NodeSocketColor")
    total = None
    for other in rendered:
        layers, exposure = tree.nodes.new("CompositorNodeRLayers"), tree.nodes.new("CompositorNodeExposure")
        layers.scene = other
        exposure.inputs["Exposure"].default_value = 1.0
        tree.links.new(layers.outputs["Image"], exposure.inputs["Image"])
        image = exposure.outputs["Image"]
        if total is not None:
            add = tree.nodes.new("ShaderNodeMix")
            add.data_type, add.blend_type = "RGBA", "ADD"
            add.inputs["Factor"].default_value = 1.0
            colors = [socket for socket in add.inputs if socket.type == "RGBA"]
            tree.links.new(total, colors[0])
            tree.links.new(image, colors[1])
            image = next(socket for socket in add.outputs if socket.type == "RGBA")
        total = image
    tree.links.new(total, tree.nodes.new("NodeGroupOutput").inputs["Image"])


def shot(folder, scene):
    """The picture of a scene, as it is saved."""
    image = scene.render.image_settings
    image.media_type, image.file_format, image.color_depth = "IMAGE", "OPEN_EXR", "32"
    scene.render.filepath = str(folder / "shot.exr")
    bpy.ops.render.render(write_still=True, scene=scene.name)
    return next(iter(rendering.read_exr(folder / "shot.exr").values()))[..., :3]


def switched(*scenes):
    """Set the switches of scenes in every way."""
    for switches in itertools.product((False, True), repeat=len(scenes)):
        for scene, is_on in zip(scenes, switches, strict=True):
            scene.spectral_tiles.enabled = is_on
        yield switches


def without(extension, function):
    """What comes of it where the extension is not."""
    extension.unregister()
    try:
        return function()
    finally:
        extension.register()


def test_compositor(extension, tmp_path, ours):
    main, _ = build_scenes()
    plain = {is_on: shot(tmp_path, main) for (is_on,) in switched(main)}
    assert np.abs(plain[False] - plain[True]).max() > 1e-3
    composite(main, main)
    ours.clear()
    for (is_on,) in switched(main):
        assert np.allclose(shot(tmp_path, main), 2.0 * plain[is_on], rtol=1e-4)
    assert ours == [("Main", "ViewLayer")]
    main.spectral_tiles.enabled = False
    assert np.array_equal(shot(tmp_path, main), without(extension, lambda: shot(tmp_path, main)))


def test_a_scene_composites_another_one(extension, tmp_path, ours):
    scenes = main, other = build_scenes()
    composite(main, main, other)
    pictures = {}
    for switches in switched(*scenes):
        ours.clear()
        pictures[switches] = shot(tmp_path, main)
        assert sorted(name for name, _ in ours) == [scene.name for scene in scenes if scene.spectral_tiles.enabled]
    means = [picture.mean() for picture in pictures.values()]
    assert np.allclose(means, means[0], rtol=0.02) and means[0] > 0.1
    for one, another in itertools.combinations(pictures.values(), 2):
        assert not np.array_equal(one, another)
    main.spectral_tiles.enabled = other.spectral_tiles.enabled = False
    assert np.array_equal(pictures[False, False], without(extension, lambda: shot(tmp_path, main)))


@pytest.mark.parametrize(("main_is_on", "other_is_on"), list(itertools.product((False, True), repeat=2)))
def test_sequencer(extension, tmp_path, ours, main_is_on, other_is_on):
    """A strip of a scene is by that scene's switch, whatever the editing scene's says."""
    main, other = build_scenes()
    main.spectral_tiles.enabled, other.spectral_tiles.enabled = main_is_on, other_is_on
    plain = shot(tmp_path, other) if other_is_on else without(extension, lambda: shot(tmp_path, other))
    ours.clear()
    main.sequence_editor_create().strips.new_scene("Strip", other, 1, 1)
    # Once: the sequencer remembers pictures.
    found = shot(tmp_path, main)
    assert ours == [("Other", "ViewLayer")] * other_is_on
    assert np.array_equal(found, plain)


def test_the_scene_that_is_rendered_counts(tmp_path, ours):
    _, other = build_scenes()
    other.spectral_tiles.enabled = True
    bpy.ops.render.render(scene="Main")
    assert ours == []
    bpy.ops.render.render(scene="Other")
    assert ours == [("Other", "ViewLayer")]


LAYERS = {"Own": 0, "Fewer": 16, "More": 128}

VALUES = {
    "USE": {"Own": 64, "Fewer": 16, "More": 128},
    "BOUNDED": {"Own": 64, "Fewer": 16, "More": 64},
    "IGNORE": {"Own": 64, "Fewer": 64, "More": 64},
}


@pytest.mark.parametrize("mode", VALUES)
@pytest.mark.parametrize("is_adaptive", [False, True])
def test_samples_of_view_layers(tmp_path, monkeypatch, ours, mode, is_adaptive):
    """Each layer takes its own, as by Cycles, and is Cycles' picture where it is completed evenly."""
    scene = fill(rendering.empty_scene(24, 16))
    scene.view_layers[0].name = "Own"
    for name, samples in LAYERS.items():
        layer = scene.view_layers.get(name) or scene.view_layers.new(name)
        layer.samples = samples
    scene.cycles.use_layer_samples = mode
    scene.cycles.use_adaptive_sampling, scene.cycles.adaptive_threshold = is_adaptive, 0.1
    monkeypatch.setattr(plan_rounds, "_chosen_squares", lambda *_: None)
    grown, asked = rounds.grown, {}

    def watched(session, goal, *others):
        asked[session.layer_name] = goal.samples
        return grown(session, goal, *others)

    monkeypatch.setattr(rounds, "grown", watched)
    found = rendering.render(tmp_path, "SPECTRAL_TILES", SAMPLES)
    assert asked == VALUES[mode] and [name for _, name in ours] == list(LAYERS)
    native = rendering.render(tmp_path, "CYCLES", SAMPLES)
    for name in LAYERS:
        theirs, image = (passes[f"{name}.Combined"] for passes in (native, found))
        if is_adaptive:
            assert image.mean() == pytest.approx(theirs.mean(), rel=0.01)
        else:
            np.testing.assert_allclose(image, theirs, rtol=1e-4, atol=1e-5)
    assert np.array_equal(found["Fewer.Combined"], found["Own.Combined"]) == (mode == "IGNORE")
