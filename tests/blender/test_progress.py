# SPDX-License-Identifier: GPL-3.0-or-later
"""How far a render of many calls is."""

import time
from types import SimpleNamespace

import bpy
import pytest

from addon.blender import progress
from tests import rendering


class Engine:
    """Keeps what is told."""

    def __init__(self):
        self.fractions, self.lines = [], []

    def update_progress(self, fraction):
        self.fractions.append(fraction)

    def update_stats(self, _stats, line):
        self.lines.append(line)


@pytest.fixture
def clock(monkeypatch):
    """A clock that stands still; its `now` is in seconds."""
    clock = SimpleNamespace(now=100.0)
    monkeypatch.setattr(time, "monotonic", lambda: clock.now)
    return clock


def test_first_call_does_not_count_for_the_rest(clock):
    """It loads Cycles' kernels."""
    engine = Engine()
    told = progress.Progress(engine, 4, "denoising")
    for seconds in (60.0, 2.0, 4.0, 3.0):
        clock.now += seconds
        told.step()
    assert engine.lines == [
        "Sub-Frame 1/4",
        "Sub-Frame 2/4, about 4 s left, then denoising",
        "Sub-Frame 3/4, about 3 s left, then denoising",
        "Sub-Frame 4/4",
    ]
    assert engine.fractions == [0.25, 0.5, 0.75, 1.0]


def test_picture_is_shown_once_a_second(clock):
    told = progress.Progress(Engine(), 4)
    shown = []
    for _ in range(5):
        clock.now += 0.6
        shown.append(told.is_due())
    assert shown == [False, True, False, True, False]


def test_estimate_of_sub_frames(monkeypatch):
    """True within 30 % of what is left, from the second sub-frame on; in processor time."""
    monkeypatch.setattr(time, "monotonic", time.process_time)
    scene = rendering.empty_scene(256, 256)
    rendering.add_camera()
    scene.render.use_motion_blur, scene.cycles.samples = True, 128
    settings = scene.spectral_tiles
    settings.enabled, settings.method, settings.sub_frames = True, "SUB_FRAMES", 8
    estimates, told = [], progress.duration
    monkeypatch.setattr(
        progress, "duration", lambda seconds: (estimates.append((time.process_time(), seconds)), told(seconds))[1]
    )
    bpy.ops.render.render()
    end = time.process_time()
    assert len(estimates) == 6
    for at, seconds in estimates[:4]:  # what follows the last sub-frame weighs more in the end
        assert seconds == pytest.approx(end - at, rel=0.3)
