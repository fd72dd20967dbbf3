# SPDX-License-Identifier: GPL-3.0-or-later
"""Many renders in one process: memory stays flat, and no file, thread or data-block is left."""

import os
import threading
from pathlib import Path

import pytest

bpy = pytest.importorskip("bpy", reason="these tests run inside Blender's Python module")
np = pytest.importorskip("numpy")

from tests import rendering  # noqa: E402

pytestmark = pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="Linux tells how much memory is in use")

#: Names of the methods, and what else is set with each.
WAYS = (
    {"method": "IN_PLACE"},
    {"method": "GATHER"},
    {"method": "AUTO"},
    {"method": "AUTO", "filter": "GAUSSIAN"},
    {"method": "SUB_FRAMES", "sub_frames": 2},
    {"method": "AUTO", "pattern": "SPECTRAL"},
)


def resident():
    """Kilobytes of memory in use."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1024


def left():
    """Everything else that a render could leave."""
    found = {name: getattr(bpy.data, name) for name in dir(bpy.data)}
    blocks = {name: len(value) for name, value in found.items() if isinstance(value, bpy.types.bpy_prop_collection)}
    handlers = [len(value) for value in bpy.app.handlers if isinstance(value, list)]
    return blocks, handlers, threading.active_count(), len(os.listdir("/proc/self/fd")), os.listdir(bpy.app.tempdir)


def measure(renders, first):
    """Slope of memory in use after the first renders, in kilobytes a render of any method."""
    scene = rendering.empty_scene(24, 18)
    rendering.spin(rendering.add_plane(5, rendering.diffuse(), location=(0, 0, 1)), 40)
    rendering.add_plane(20, rendering.diffuse())
    rendering.add_light("AREA", 500, (2, 2, 5), size=4.0)
    rendering.add_camera().data.dof.use_dof = True
    scene.render.use_motion_blur = True
    settings = scene.spectral_tiles
    settings.enabled = True
    defaults = {name: getattr(settings, name) for way in WAYS for name in way}
    used, before = [], None
    for number in range(renders):
        way = WAYS[number % len(WAYS)]
        for name, value in (defaults | way).items():
            setattr(settings, name, value)
        scene.cycles.samples = 1 + number % 2
        scene.cycles.seed = number
        bpy.ops.render.render()
        if number == first:
            before = left()
        used.append(resident())
    assert left() == before
    used = np.array(used[first:])
    # Half against half, so that neither a single jump's time nor its neighbours say much.
    halves = [np.median(half) for half in np.array_split(used, 2)]
    return (halves[1] - halves[0]) / (len(used) / 2)


def test_some_renders(extension):
    assert measure(60, 30) < 500  # few renders tell little


@pytest.mark.fuzz
def test_many_renders(extension):
    assert measure(500, 50) < 50
