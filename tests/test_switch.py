# SPDX-License-Identifier: GPL-3.0-or-later
"""The switch: Cycles is its own when it is off, and as it was when the extension is gone, whoever else is there."""

import contextlib
import importlib.util
import sys
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("bpy")

import bpy
import cycles

from addon import drivers
from tests import rendering

ROOT = Path(__file__).parents[1]


@pytest.fixture(autouse=True)
def _registered(extension):
    pass


@pytest.fixture
def ours(monkeypatch):
    """Numbers of renders that our drivers were asked for."""
    counted = []
    render = drivers.render
    monkeypatch.setattr(drivers, "render", lambda *job: counted.append(1) or render(*job))
    return counted


def build_scene():
    scene = rendering.empty_scene(16, 16)
    rendering.add_camera((0, -5, 5), (np.radians(45), 0, 0)).data.dof.use_dof = True
    rendering.add_plane(8, rendering.diffuse())
    rendering.add_light("AREA", 300, (1, -1, 4), size=2)
    layer = bpy.context.view_layer
    layer.use_pass_z = layer.use_pass_normal = layer.use_pass_diffuse_direct = layer.use_pass_mist = True
    layer.cycles.denoising_store_passes = True
    return scene


def cycles_as_it_is():
    """All functions of Cycles' class and of what it calls, and the names beside them."""
    owners = (cycles.CyclesRender, cycles.engine)
    functions = {(owner.__name__, key): value for owner in owners for key, value in vars(owner).items()
                 if callable(value)}  # fmt: skip
    return functions, sorted(vars(cycles)) + sorted(vars(cycles.engine))


def assert_same(found, expected):
    assert [key for key, function in found[0].items() if function is not expected[0][key]] == []
    assert found[0].keys() == expected[0].keys() and found[1] == expected[1]


def copy_of_the_extension(name):
    """The add-on imported once more, as an extension from another repository would be."""
    path = ROOT / "addon"
    spec = importlib.util.spec_from_file_location(name, path / "__init__.py", submodule_search_locations=[str(path)])
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def alone(extension):
    """Cycles without the extension, which is there again afterwards."""
    extension.unregister()
    yield cycles_as_it_is()
    extension.register()


def test_off_is_cycles_own_bit_for_bit(extension, tmp_path, ours):
    scene = build_scene()
    scene.cycles.use_denoising = True
    off = rendering.render(tmp_path, "CYCLES", samples=4)
    assert not ours
    extension.unregister()
    try:
        scene = bpy.context.scene
        path = tmp_path / "alone.exr"
        scene.render.filepath = str(path)
        bpy.ops.render.render(write_still=True)
    finally:
        extension.register()
    alone = rendering.read_exr(path)
    assert off.keys() == alone.keys() and len(off) > 5
    for name, pixels in alone.items():
        assert np.array_equal(off[name], pixels), name


def test_on_renders_are_ours(tmp_path, ours):
    build_scene()
    rendering.render(tmp_path, "SPECTRAL_TILES")
    assert ours == [1]


def test_nothing_to_gain_is_cycles_own_bit_for_bit(tmp_path):
    """A static scene under one sun."""
    scene = rendering.empty_scene(32, 32)
    scene.cycles.max_bounces = 0
    rendering.add_camera((0, -5, 5), (np.radians(45), 0, 0))
    rendering.add_plane(8, rendering.diffuse())
    rendering.add_light("SUN", 3, (0, 0, 4), angle=0.0)
    scene.spectral_tiles.distribution = "EVEN"
    theirs, found = (rendering.render(tmp_path, engine, samples=64) for engine in rendering.ENGINES)
    assert found.keys() == theirs.keys()
    for name, pixels in theirs.items():
        assert np.array_equal(found[name], pixels), name


@pytest.mark.parametrize("is_on", [False, True])
def test_other_engines_are_left_alone(is_on, ours):
    scene = build_scene()
    scene.spectral_tiles.enabled = is_on
    scene.render.engine = "BLENDER_WORKBENCH"
    with contextlib.suppress(RuntimeError):  # it may want a graphics card
        bpy.ops.render.render()
    assert not ours


@pytest.mark.parametrize("kind", ["COMBINED", "DIFFUSE", "SHADOW", "NORMAL"])
def test_bakes_are_cycles_own(kind, ours):
    scene = build_scene()
    plane = next(made for made in scene.objects if made.type == "MESH")
    plane.data.uv_layers.new()
    tree = plane.data.materials[0].node_tree
    node = tree.nodes.new("ShaderNodeTexImage")
    tree.nodes.active = node
    bpy.context.view_layer.objects.active = plane
    plane.select_set(True)
    scene.cycles.samples = 3
    baked = []
    for is_on in (False, True):
        scene.spectral_tiles.enabled = is_on
        node.image = bpy.data.images.new("Bake", 16, 16, float_buffer=True)
        bpy.ops.object.bake(type=kind)
        baked.append(np.array(node.image.pixels[:]))
    assert baked[0].std() > 0 or kind in {"SHADOW", "NORMAL"}
    assert np.array_equal(*baked) and not ours


def test_bakes_without_a_camera():
    scene = build_scene()
    bpy.data.objects.remove(scene.camera)
    scene.spectral_tiles.enabled = True
    plane = next(made for made in scene.objects if made.type == "MESH")
    plane.data.attributes.new("Light", "FLOAT_COLOR", "POINT")
    scene.render.bake.target = "VERTEX_COLORS"
    bpy.context.view_layer.objects.active = plane
    plane.select_set(True)
    assert bpy.ops.object.bake(type="COMBINED") == {"FINISHED"}


class Foreign:
    """Another add-on, which puts a function of its own in the place of one of Cycles', and puts back what it found."""

    def __init__(self, owner):
        self.owner = owner
        self.calls = 0

    def register(self):
        self.found = vars(self.owner)["render"]

        def render(engine, depsgraph):
            self.calls += 1
            self.found(engine, depsgraph)

        self.owner.render = render

    def unregister(self):
        self.owner.render = self.found


def renders(scene):
    scene.spectral_tiles.enabled = True
    bpy.ops.render.render()


def test_twenty_times(extension, alone):
    for _ in range(20):
        extension.register()
        extension.unregister()
        assert_same(cycles_as_it_is(), alone)


ORDERS = ("our their our their", "our their their our", "their our our their", "their our their our")


@pytest.mark.parametrize("order", ORDERS)
def test_with_another_wrapper(extension, alone, ours, order):
    """Both are called while they are there, whoever came first and goes first, over and over."""
    scene, foreign = build_scene(), Foreign(cycles.CyclesRender)
    for _ in range(5):
        for here in _steps(order, extension, foreign):
            before = len(ours), foreign.calls
            if "our" in here:
                scene.spectral_tiles.enabled = True
            bpy.ops.render.render()
            assert len(ours) - before[0] == ("our" in here)
            assert foreign.calls - before[1] == ("their" in here)
        assert_same(cycles_as_it_is(), alone)


@pytest.mark.parametrize("order", ORDERS)
def test_with_another_wrapper_in_our_own_place(extension, alone, order):
    """Cycles renders at every step, and is as it was once both are gone, for good."""
    foreign = Foreign(cycles.engine)
    build_scene()
    for _ in range(5):
        for _ in _steps(order, extension, foreign):
            bpy.ops.render.render()
    extension.register()
    extension.unregister()
    assert_same(cycles_as_it_is(), alone)


def _steps(order, extension, foreign):
    """Who is there, after each one's coming or going."""
    here = set()
    for who in order.split():
        module = extension if who == "our" else foreign
        if who in here:
            module.unregister()
        else:
            module.register()
        here ^= {who}
        yield here


@pytest.mark.parametrize("first", [0, 1])
def test_two_copies(alone, extension, tmp_path, first):
    """One of them is at work, and the other one once that is removed."""
    copies = [extension, copy_of_the_extension("copy_of_the_extension")]
    for copy in copies:
        copy.register()
    scene = build_scene()
    renders(scene)
    copies[first].unregister()
    renders(scene)
    scene.spectral_tiles.pattern = "FILE"
    with pytest.raises(RuntimeError, match="No pattern file is set"):
        renders(scene)
    copies[first].register()
    copies[1 - first].unregister()
    with pytest.raises(RuntimeError, match="No pattern file is set"):
        renders(scene)
    copies[first].unregister()
    assert_same(cycles_as_it_is(), alone)
    bpy.ops.render.render()


def test_upgrade_in_a_running_blender(alone):
    """What Blender does: the old version goes, with its modules, and the new one comes under the same name."""
    name, left = "extension_that_is_upgraded", None
    build_scene()
    for version in range(3):
        module = copy_of_the_extension(name)
        module.register()
        settings = bpy.context.scene.spectral_tiles
        assert version == 0 or (settings.method, settings.sub_frames) == ("GATHER", 9)
        settings.method, settings.sub_frames, settings.pattern = "GATHER", 9, "AUTO"
        renders(bpy.context.scene)
        settings.pattern = "FILE"
        with pytest.raises(RuntimeError, match="No pattern file is set"):
            renders(bpy.context.scene)
        module.unregister()
        for known in [known for known in sys.modules if known.partition(".")[0] == name]:
            del sys.modules[known]
        bpy.ops.render.render()
        assert_same(cycles_as_it_is(), alone)
        handlers = [len(found) for found in bpy.app.handlers if isinstance(found, list)]
        assert left in (None, handlers)
        left = handlers


def test_gone_while_it_renders(extension, tmp_path):
    """Blender goes on, and so does Cycles."""
    build_scene()
    handlers = bpy.app.handlers.render_stats

    def leave(_):
        handlers.remove(leave)
        extension.unregister()

    handlers.append(leave)
    rendering.render(tmp_path, "SPECTRAL_TILES", 16)
    extension.register()
    rendering.render(tmp_path, "SPECTRAL_TILES")
