# SPDX-License-Identifier: GPL-3.0-or-later
"""The extension in a real Blender window, Debian's, as an artist meets it.

One session (`session.py`) is run for all tests, inside a Debian root that is made on first use (`make_root`).  Where
that root is, or shall be, says the environment variable SPECTRAL_TILES_WINDOW_ROOT; without it these tests are skipped.
The folder that SPECTRAL_TILES_WINDOW_SHOTS names, if any, receives the screenshots.
"""

import json
import os
import shutil
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("bpy")

from bench.archive import build
from tests import rendering
from tests.ui import window

FRAMES = ("frame_0001.png", "frame_0002.png", "frame_0003.png")


@pytest.fixture(scope="module")
def root():
    named = os.environ.get("SPECTRAL_TILES_WINDOW_ROOT")
    if not named:
        pytest.skip("no Blender window: SPECTRAL_TILES_WINDOW_ROOT names no folder for it")
    why_not = window.make_root(Path(named))
    if why_not:
        pytest.skip(f"no Blender window: {why_not}")
    return Path(named)


@pytest.fixture(scope="module")
def archive(tmp_path_factory):
    return build(tmp_path_factory.mktemp("dist"))


@pytest.fixture(scope="module")
def results(root, archive, tmp_path_factory):
    """Folder with everything that the session left."""
    folder = tmp_path_factory.mktemp("window")
    window.run_session(root, archive, folder)
    if shots := os.environ.get("SPECTRAL_TILES_WINDOW_SHOTS"):
        shutil.copytree(folder, shots, dirs_exist_ok=True)
    return folder


@pytest.fixture(scope="module")
def facts(results):
    facts = json.loads((results / "facts.json").read_text())
    assert "error" not in facts, facts["error"]
    return facts


def picture(path):
    """RGB of an image file, float32, rows from the top."""
    return next(iter(rendering.read_exr(path).values()))[..., :3]


def test_the_whole_session_ran(facts):
    assert facts["finished"]


def test_installed_through_the_preferences(facts):
    assert facts["enabled"]


def test_panel_tells_what_the_scene_uses(facts):
    assert facts["uses"] == "Motion blur, lens, 2 lights and indirect light: using tile spectral_64"


def test_panel_tells_how_long_it_takes(facts):
    assert facts["overhead"].startswith("Takes") and facts["overhead_of_gather"].startswith("Adds less than a second")


def test_panel_tells_that_a_camera_is_refused(facts):
    assert facts["refusals"] == []
    assert facts["calls_with_custom_camera"].startswith("In Place")
    assert len(facts["refusals_of_custom_camera"]) == 1 and "custom (OSL)" in facts["refusals_of_custom_camera"][0]


def test_panel_tells_that_denoising_is_refused(facts):
    """Debian's Blender has no OpenImageIO module."""
    assert len(facts["refusals_of_denoising"]) == 1 and "switch Denoise off" in facts["refusals_of_denoising"][0]


def test_pictures_of_the_tile_are_drawn(results, facts):
    """The spectrum's black middle is in the panel when a tile is chosen, and only then."""
    assert 0 not in facts["icons"]
    black = {name: (picture(results / f"panel_{name}.png").max(axis=-1) < 0.02).sum() for name in ("automatic", "tile")}
    # It is a disc of some 50 pixels across.
    assert black["tile"] > black["automatic"] + 1000


def test_undo(facts):
    assert facts["samples_after_undo"] == 3


def test_own_preset(facts):
    assert facts["samples_of_own_preset"] == 11
    assert facts["own_preset_afterwards"] is None


def test_tile_is_generated_in_the_background(facts):
    assert facts["tile"] == "FILE" and facts["tile_path_is_right"] and facts["tile_size"] > 1000


def test_generating_can_be_cancelled(facts):
    assert facts["seconds_to_cancel_tile"] < 5
    assert facts["tile_path_kept"] and not facts["cancelled_file_is_there"]


def test_comparison_is_refused_at_once(facts):
    told = facts["refusals_of_custom_camera"][0]
    assert told in facts["comparison_of_refused"] and not facts["renders_after_refusal"]


def test_still(results):
    """A cube lit from one side before a grey world."""
    image = picture(results / "still.exr")
    assert image.shape == (60, 80, 3) and np.isfinite(image).all()
    assert image[24, 42].min() > 4 * image[5, 5].max() > 0.1


def test_escape_cancels(facts):
    assert facts["was_rendering"]
    assert facts["seconds_to_cancel"] < 1
    assert facts["demo_was_rendering"]
    assert facts["seconds_to_cancel_demo"] < 1


def test_gather_is_shown_in_order(results, facts):
    """As the result will be, which Esc leaves as far as it was shown."""
    assert facts["in_order_was_rendering"]
    shown, left = (picture(results / f"{name}.png")[336:600, 408:872] for name in ("in_order", "in_order_cancelled"))
    # Means over squares, so that noise and the window's rounding of places hardly count.
    shown, left = (image.reshape(33, 8, 58, 8, 3).mean(axis=(1, 3)) for image in (shown, left))
    assert np.corrcoef(shown.ravel(), left.ravel())[0, 1] > 0.95


@pytest.mark.parametrize(("name", "channel", "times"), [("Paint", 0, 4), ("Lamp", 1, 4), ("Sky", 2, 1.8)])
def test_preview(results, name, channel, times):
    """A red ball, a green light and a blue sky, by Cycles; the view takes colour out of so bright a sky."""
    image = picture(results / f"preview_{name}.png")
    others = np.delete(image, channel, axis=-1)
    assert (image[..., channel] > times * others.max(axis=-1)).mean() > 0.1


def test_animation(results):
    frames = [picture(results / name) for name in FRAMES]
    assert all(frame.shape == (60, 80, 3) for frame in frames)
    # The cube turns, and the noise changes from frame to frame.
    assert np.abs(frames[0] - frames[1]).max() > 0.1 and np.abs(frames[1] - frames[2]).max() > 0.1


def test_comparison_fills_its_slots(results, facts):
    """Both slots show the same scene with other samples; ours what F12 renders."""
    assert {"Cycles", "Spectral Tiles"} <= set(facts["slots"]) and not facts["native_afterwards"]
    cycles, ours = picture(results / "Cycles.exr"), picture(results / "Spectral Tiles.exr")
    difference = np.abs(cycles - ours)
    assert difference.max() > 1e-3
    assert difference.mean() < 0.1 * cycles.mean()


def test_off_and_on_twenty_times(facts):
    assert facts["engine_afterwards"] == "SPECTRAL_TILES" and facts["samples_afterwards"] >= 1


MAKE_FILE = """
import bpy
scene = bpy.context.scene
scene.render.resolution_x = scene.render.resolution_y = 32
scene.render.filepath = "//picture_"
scene.cycles.use_denoising = False
bpy.ops.wm.save_as_mainfile(filepath="good.blend")
scene.cycles.use_denoising = True  # which this build lacks the module for
bpy.ops.wm.save_as_mainfile(filepath="denoised.blend")
"""


@pytest.fixture(scope="module")
def home(root, archive):
    """A profile with the extension, and files to render."""
    with window.home(root) as folder:
        shutil.copy(archive, folder / "spectral_tiles.zip")
        (folder / "make.py").write_text(MAKE_FILE)
        install = ["--command", "extension", "install-file", "-r", "user_default", "-e", "spectral_tiles.zip"]
        for arguments in (["--factory-startup", "-P", "make.py"], install):
            done = window.run(root, folder, "blender", "-b", *arguments)
            assert done.returncode == 0, done.stdout
        yield folder


@pytest.mark.parametrize("frames", [["-f", "1"], ["-s", "1", "-e", "3", "-a"]], ids=" ".join)
def test_refused_on_the_command_line(root, home, frames):
    """Exit code 1, one line that says why, no picture, and the file as it was."""
    file = home / "denoised.blend"
    before = file.read_bytes()
    done = window.run(root, home, "blender", "-b", file.name, "-E", "SPECTRAL_TILES", *frames)
    assert done.returncode == 1
    assert len([line for line in done.stdout.splitlines() if "ERROR" in line]) == 1, done.stdout
    assert not list(home.glob("picture_*"))
    assert file.read_bytes() == before


def test_rendered_on_the_command_line(root, home):
    done = window.run(root, home, "blender", "-b", "good.blend", "-E", "SPECTRAL_TILES", "-f", "1")
    assert done.returncode == 0 and "ERROR" not in done.stdout, done.stdout
    assert picture(home / "picture_0001.png").shape == (32, 32, 3)


def command(root, home, *arguments, before=()):
    """Exit code of our command, and the lines that it wrote by itself."""
    done = window.run(root, home, *before, "blender", "--command", "spectral_tiles", *arguments)
    return done.returncode, [line for line in done.stdout.splitlines() if line.startswith("spectral_tiles: ")]


def test_command(root, home):
    """Exit codes, one line for what is wrong, and nothing left behind."""
    assert command(root, home, "render", "good.blend", "--output", "made.png") == (0, [])
    assert picture(home / "made.png").shape == (32, 32, 3)
    for code, arguments in ((1, ["render", "denoised.blend"]), (2, ["render", "none.blend"]), (2, [])):
        found, lines = command(root, home, *arguments)
        assert found == code and len(lines) == 1
    assert not list(home.glob("blender_*"))


def test_command_is_interrupted(root, home):
    """Ctrl-C while Cycles renders: hours, if it were not heeded."""
    interrupt = ("timeout", "--preserve-status", "-s", "INT", "4")
    render = ["render", "good.blend", "--samples", "1024", "--percentage", "5000", "--output", "stopped/frame.png"]
    assert command(root, home, *render, before=interrupt) == (130, ["spectral_tiles: interrupted"])
    assert list((home / "stopped").iterdir()) == []
