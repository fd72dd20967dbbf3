# SPDX-License-Identifier: GPL-3.0-or-later
"""The user's data before, during and after a render: the same, whatever the method, and however the render ends."""

import pytest

pytest.importorskip("bpy")

import bpy
import numpy as np

from addon import drivers
from addon.drivers import steps
from tests import rendering
from tests.ui.artist import everything_set

METHODS = ("AUTO", "IN_PLACE", "GATHER", "SUB_FRAMES")


@pytest.fixture(autouse=True)
def _registered(extension):
    pass


def build_scene(method, persistent=False):
    scene = rendering.empty_scene(24, 16)
    camera = rendering.add_camera((0, -5, 5), (np.radians(45), 0, 0))
    camera.data.dof.use_dof, camera.data.shift_x = True, 0.1
    camera.data.dof.aperture_fstop = 0.3
    rendering.slide(rendering.add_plane(8, rendering.diffuse()), (-0.2, 0, 0), (0.2, 0, 0))
    rendering.add_light("AREA", 300, (1, -1, 4), size=2)
    rendering.set_world((0.1, 0.2, 0.3))
    layer = bpy.context.view_layer
    layer.use_pass_z = layer.use_pass_diffuse_direct = layer.use_pass_vector = True
    scene.render.use_motion_blur, scene.render.use_persistent_data = True, persistent
    scene.cycles.samples, scene.cycles.use_denoising, scene.cycles.use_animated_seed = 16, True, True
    scene.spectral_tiles.enabled, scene.spectral_tiles.method = True, method
    if method == "GATHER":
        scene.spectral_tiles.filter = "LANCZOS"
    scene.frame_start, scene.frame_end = 1, 2
    scene.frame_set(1)
    return scene


def what_is_set():
    """All that can be set, but for the frame, which an animation moves itself."""
    found = everything_set()
    return {key: value for key, value in found.items() if not key.startswith("scene.frame_")}


def changes(before, after):
    return {key: (before.get(key), after.get(key)) for key in before | after if before.get(key) != after.get(key)}


def frame():
    scene = bpy.context.scene
    return scene.frame_current, scene.frame_subframe


class Watch:
    """Looks at everything at each of a render's events, and saves a copy there."""

    NAMES = ("render_init", "render_pre", "render_stats", "render_post", "render_write", "render_complete",
             "render_cancel")  # fmt: skip

    def __init__(self, folder):
        self.folder = folder
        self.seen = []
        self.frames = set()

    def __enter__(self):
        bpy.ops.wm.save_as_mainfile(filepath=str(self.folder / "before.blend"), copy=True)
        self.handlers = [(getattr(bpy.app.handlers, name), self._look(name)) for name in self.NAMES]
        for handlers, look in self.handlers:
            handlers.append(look)
        return self

    def __exit__(self, *_):
        for handlers, look in self.handlers:
            handlers.remove(look)

    def _look(self, name):
        def look(*_):
            self.frames.add(frame())
            # The third of its kind is in the middle of a render, if there are many.
            count = sum(other == name for other, *_ in self.seen)
            if count == 3:
                return
            path = self.folder / f"{name}_{count}.blend"
            self.seen.append((name, what_is_set(), frame(), path))
            if count in {0, 2}:
                bpy.ops.wm.save_as_mainfile(filepath=str(path), copy=True)

        return look


def assert_untouched(watch, before, frames, needed):
    assert {name for name, *_ in watch.seen} >= set(needed)
    assert changes(before, what_is_set()) == {} and frame() == frames[-1] and watch.frames <= set(frames)
    for name, found, at, _ in watch.seen:
        changed = changes(before, found)
        # Between this event and the next Sub-Frames have Persistent Data on; what is saved there has not.
        if name == "render_init" and bpy.context.scene.spectral_tiles.method == "SUB_FRAMES":
            changed.pop("scene.render.use_persistent_data", None)
        assert changed == {}, name
        assert at in frames, name
    # What a file does not keep is otherwise in the one that was saved before, too.
    expected = loaded(watch.folder / "before.blend")
    for name, _, at, path in watch.seen:
        if path.exists():
            assert changes(expected, loaded(path)) == {} and frame() == at, name


def loaded(path):
    bpy.ops.wm.open_mainfile(filepath=str(path), load_ui=False)
    return what_is_set()


@pytest.mark.parametrize("persistent", [False, True])
@pytest.mark.parametrize("method", METHODS)
def test_a_still(tmp_path, method, persistent):
    build_scene(method, persistent).render.filepath = str(tmp_path / "still.png")
    before = what_is_set()
    with Watch(tmp_path) as watch:
        bpy.ops.render.render(write_still=True)
    assert_untouched(watch, before, [(1, 0.0)], {"render_pre", "render_stats", "render_write"})


@pytest.mark.parametrize("method", METHODS)
def test_an_animation(tmp_path, method):
    build_scene(method).render.filepath = str(tmp_path / "frame_")
    before = what_is_set()
    with Watch(tmp_path) as watch:
        bpy.ops.render.render(animation=True)
    assert_untouched(watch, before, [(2, 0.0), (1, 0.0)], {"render_pre", "render_stats", "render_write"})
    assert (tmp_path / "frame_0002.png").exists()


@pytest.mark.parametrize("method", METHODS)
def test_cancelled(tmp_path, monkeypatch, method):
    build_scene(method)
    before = what_is_set()
    render = drivers.render
    monkeypatch.setattr(drivers, "render", lambda engine, *job: render(rendering.CancelledSoon(engine, 2), *job))
    with Watch(tmp_path) as watch:
        bpy.ops.render.render()
    assert_untouched(watch, before, [(1, 0.0)], {"render_pre"})


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("error", [ZeroDivisionError("a mistake"), OSError(28, "No space left on device")])
def test_a_mistake(tmp_path, monkeypatch, method, error):
    build_scene(method)
    before = what_is_set()

    def fail(*_):
        raise error

    monkeypatch.setattr(steps, "finish", fail)
    with Watch(tmp_path) as watch, pytest.raises(RuntimeError, match=r"a mistake|No space left"):
        bpy.ops.render.render()
    assert_untouched(watch, before, [(1, 0.0)], {"render_pre"})


def test_a_picture_that_is_too_small(tmp_path):
    """Blender gives up between Render Init and Render Pre."""
    render = build_scene("SUB_FRAMES").render
    render.use_border = render.use_crop_to_border = True
    render.border_min_x, render.border_max_x = 0.5, 0.501
    before = what_is_set()
    with pytest.raises(RuntimeError, match="Image too small"):
        bpy.ops.render.render()
    assert changes(before, what_is_set()) == {}


@pytest.mark.parametrize("method", METHODS)
def test_the_next_render_is_the_same(tmp_path, method):
    """Nothing of a render is left in the evaluated scene, though Blender may keep that."""
    scene = build_scene(method, persistent=True)
    bpy.context.view_layer.use_pass_vector = False  # which sub-frames have not by so few samples
    first, second = (rendering.render(tmp_path, "SPECTRAL_TILES", samples=2) for _ in range(2))
    native = rendering.render(tmp_path, "CYCLES", samples=2)
    scene.render.use_persistent_data = False
    for expected, found in ((first, second), (native, rendering.render(tmp_path, "CYCLES", samples=2))):
        assert found.keys() == expected.keys()
        for name, pixels in expected.items():
            assert np.array_equal(found[name], pixels), name
