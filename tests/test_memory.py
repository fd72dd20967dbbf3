# SPDX-License-Identifier: GPL-3.0-or-later
"""Many renders in one process: memory stays flat, and no file, thread or data-block is left."""

import ctypes
import os
import threading
from pathlib import Path

import pytest

bpy = pytest.importorskip("bpy", reason="these tests run inside Blender's Python module")
np = pytest.importorskip("numpy")

import generator  # noqa: E402
from addon.interface import forecast  # noqa: E402
from tests import rendering  # noqa: E402

pytestmark = pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="Linux tells how much memory is in use")

#: What renders are like: how they are rendered then, samples a pixel, and settings of ours.
WAYS = (
    ("CYCLES", 1, {}),
    ("ROUNDS", 16, {}),
    ("GATHER", 2, {"method": "GATHER"}),
    ("GATHER", 2, {"filter": "GAUSSIAN"}),
    ("GATHER", 1, {"pattern": "SPECTRAL"}),
    ("SUB_FRAMES", 2, {"method": "SUB_FRAMES", "sub_frames": 8}),
    ("SUB_FRAMES", 1, {"method": "SUB_FRAMES", "pattern": "FILE"}),
)


def resident():
    """Kilobytes of memory in use, without those that the C library keeps for what may come (up to 60,000 at times)."""
    ctypes.CDLL(None).malloc_trim(0)
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1024


def left():
    """Everything else that a render could leave."""
    found = {name: getattr(bpy.data, name) for name in dir(bpy.data)}
    blocks = {name: len(value) for name, value in found.items() if isinstance(value, bpy.types.bpy_prop_collection)}
    handlers = [len(value) for value in bpy.app.handlers if isinstance(value, list)]
    return blocks, handlers, threading.active_count(), len(os.listdir("/proc/self/fd")), os.listdir(bpy.app.tempdir)


def measure(renders, first, folder):
    """Slope of memory in use after the first renders, in kilobytes a render of any method."""
    scene = rendering.empty_scene(24, 18)
    rendering.spin(rendering.add_plane(5, rendering.diffuse(), location=(0, 0, 1)), 40)
    rendering.add_plane(20, rendering.diffuse())
    rendering.add_light("AREA", 500, (2, 2, 5), size=4.0)
    rendering.add_camera().data.dof.use_dof = True
    scene.render.use_motion_blur = True
    settings = scene.spectral_tiles
    settings.enabled, settings.pattern_path = True, str(folder / "tile.npz")
    tile = generator.make_tile("white", 4, ("t", "lens.u", "lens.v"), seed=1)
    generator.save_tile(tile, settings.pattern_path)
    defaults = {name: getattr(settings, name) for *_, chosen in WAYS for name in chosen}
    used, before = [], None
    for number in range(renders):
        expected, samples, chosen = WAYS[number % len(WAYS)]
        for name, value in (defaults | chosen).items():
            setattr(settings, name, value)
        scene.cycles.samples, scene.cycles.seed = samples, number
        # Every other time around the denoiser is called, too.
        scene.cycles.use_denoising = bool(number // len(WAYS) % 2)
        assert forecast.chosen(scene, bpy.context.view_layer).method == expected
        bpy.ops.render.render()
        if number == first:
            before = left()
        used.append(resident())
    assert left() == before
    used = np.array(used[first:])
    # Half against half, so that neither a single jump's time nor its neighbours say much.
    halves = [np.median(half) for half in np.array_split(used, 2)]
    return (halves[1] - halves[0]) / (len(used) / 2)


def test_some_renders(extension, tmp_path):
    assert measure(60, 30, tmp_path) < 500  # few renders tell little


@pytest.mark.fuzz
def test_many_renders(extension, tmp_path):
    assert measure(500, 50, tmp_path) < 50
