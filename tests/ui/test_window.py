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

import bpy

from bench.archive import build
from tests import rendering
from tests.ui import artist, window

FRAMES = ("frame_0001.png", "frame_0002.png", "frame_0003.png")


@pytest.fixture(scope="module")
def root():
    named = os.environ.get("SPECTRAL_TILES_WINDOW_ROOT")
    if not named:
        pytest.skip("no Blender window: SPECTRAL_TILES_WINDOW_ROOT names no folder for it")
    why_not = window.make_root(Path(named))  # ten minutes at most
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


def test_nothing_goes_wrong_unseen(results):
    """Such as an engine that somebody holds when Blender frees it, and with it Cycles' session."""
    log = (results / "log.txt").read_text()
    assert "Exception ignored" not in log and "Traceback" not in log, log


def test_installed_through_the_preferences(facts):
    assert facts["enabled"]


TABS = ("MATERIAL", "LIGHT", "WORLD", "CAMERA", "OBJECT", "RENDER", "OUTPUT", "VIEW_LAYER")


@pytest.mark.parametrize("tab", TABS)
def test_tabs_are_cycles_own(results, facts, tab):
    """The same panels with the switch off and on, and the same picture of them, but for the switch's place."""
    assert facts["panels_on"][tab] == facts["panels_off"][tab]
    assert any("CYCLES" in name or "OBJECT" in name for name in facts["panels_on"][tab])
    if tab == "RENDER":
        return  # where the switch is
    off, on = (picture(results / f"tab_{tab}_{is_on}.png".lower()) for is_on in ("false", "true"))
    if tab == "MATERIAL":  # a little ball in the list, which is drawn when it is
        off[105:121, 53:69] = on[105:121, 53:69] = 0.0
    assert np.array_equal(off, on)


def test_panel_is_only_in_cycles(facts):
    ours = {"SPECTRAL_TILES_PT_sampling", "SPECTRAL_TILES_PT_advanced"}
    assert ours <= set(facts["render_panels"])
    assert not [name for name in facts["render_panels_of_eevee"] if "SPECTRAL" in name]


def test_panel_tells_what_it_will_do(facts):
    told = facts["told_on"]
    assert told["sentence"] == "Takes more samples where this frame is noisy, if that is worth it"
    assert told["refusals"] == told["differences"] == []
    assert facts["told_of_pattern"]["sentence"] == "Samples follow the pattern Spectral 64"


def test_panel_tells_once_what_cannot_be_done(facts):
    """Debian's Blender has no Open Shading Language, which only a method chosen by hand needs."""
    told = facts["told_of_gather"]
    assert len(told["refusals"]) == 1 and told["sentence"] is None


def test_denoising_never_stops_a_frame(facts):
    """Debian's Blender has no OpenImageIO module."""
    assert facts["told_of_denoising"]["refusals"] == []


def test_pictures_of_the_pattern_are_drawn(results, facts):
    """The spectrum's black middle is in the panel when a pattern is chosen, and only then."""
    assert 0 not in facts["icons"]
    black = {name: (picture(results / f"panel_{name}.png").max(axis=-1) < 0.02).sum() for name in ("on", "pattern")}
    # It is a disc of some 50 pixels across.
    assert black["pattern"] > black["on"] + 1000


def test_undo(facts):
    assert facts["sub_frames_after_undo"] == 16


def test_own_preset(facts):
    assert facts["sub_frames_of_own_preset"] == 11
    assert facts["own_preset_afterwards"] is None


def test_pattern_is_generated_in_the_background(facts):
    assert facts["pattern"] == "FILE" and facts["path_is_right"] and facts["size"] > 1000


def test_generating_can_be_cancelled(facts):
    assert facts["seconds_to_cancel_pattern"] < 10
    assert facts["path_kept"] and not facts["cancelled_file_is_there"]


def test_comparison_is_refused_at_once(facts):
    (told,) = facts["told_of_gather"]["refusals"]
    assert told in facts["comparison_of_refused"] and not facts["renders_after_refusal"]


def test_still(results):
    """A cube lit from one side before a grey world."""
    image = picture(results / "still.exr")
    assert image.shape == (60, 80, 3) and np.isfinite(image).all()
    assert image[24, 42].min() > 4 * image[5, 5].max() > 0.1


def test_region(results):
    """The middle of the picture, and nothing around it; a sample may be black."""
    image = picture(results / "region.exr")
    assert (image[15:45, 20:60] > 0.0).mean() > 0.9
    image[15:45, 20:60] = 0.0
    assert image.max() == 0.0


def test_escape_cancels(facts):
    """As soon as Cycles ends, on a busy machine; both renders would go on for many minutes."""
    assert facts["seconds_to_cancel"] < 30 and facts["seconds_to_cancel_demo"] < 30


WHEN = ("by_still", "during_render", "by_cancelled", "by_animation", "by_comparison", "by_sub_frames",
        "during_sub_frames", "by_cancelled_sub_frames")  # fmt: skip


@pytest.mark.parametrize("when", WHEN)
def test_what_is_set_stays_as_it_is(facts, when):
    """Whatever of scene, view layer, camera and world one can set."""
    assert facts[f"changed_{when}"] == {}


@pytest.mark.parametrize("what", ["", "_sub_frames"])
def test_a_copy_saved_while_it_renders(results, facts, what):
    """... is the one that was saved before."""
    assert facts["was_still_rendering"]
    seen = []
    for name in ("before", "during"):
        bpy.ops.wm.open_mainfile(filepath=str(results / f"{name}{what}.blend"), load_ui=False)
        seen.append(artist.everything_set())
    assert seen[0] == seen[1] and len(seen[0]) > 300


def test_sub_frames(results, facts):
    """Every moment is gone to, and the cube is there."""
    assert facts["moments"] >= 16
    image = picture(results / "sub_frames.exr")
    assert image.shape == (60, 80, 3) and np.isfinite(image).all()
    assert image[24, 42].min() > 4 * image[5, 5].max() > 0.1


def test_escape_ends_sub_frames(facts):
    """At once: after it the scene is only put back to the frame's own time."""
    assert facts["seconds_to_cancel_sub_frames"] < 30
    assert facts["moments_after_escape"] == 1


def test_sub_frames_show_what_is_assembled(results):
    """... which Esc leaves as the result."""
    names = "sub_frames_shown", "sub_frames_left"
    shown, left = (artist.means(picture(results / f"{name}.png")[346:586, 480:800]) for name in names)
    assert shown.std() > 0.02 and np.abs(shown - left).mean() < 0.003


def test_bakes_are_cycles_own(facts):
    assert facts["baked_light"] > 0.1 and facts["bake_differs_by"] == 0.0


def test_viewport_is_cycles_own(results):
    off, on = (picture(results / f"viewport_{is_on}.png")[100:800, 80:900] for is_on in ("false", "true"))
    assert off.std() > 0.01 and np.array_equal(off, on)


def test_gather_is_shown_in_order(results, facts):
    """As the result will be, which Esc leaves as far as it was shown."""
    names = "in_order", "in_order_cancelled"
    shown, left = (artist.means(picture(results / f"{name}.png")[artist.SMALL]) for name in names)
    assert np.corrcoef(shown.ravel(), left.ravel())[0, 1] > 0.95


@pytest.mark.parametrize(("name", "channel", "times"), [("Paint", 0, 4), ("Lamp", 1, 4), ("Sky", 2, 1.8)])
def test_previews_are_cycles_own(results, name, channel, times):
    """A red ball, a green light and a blue sky; the view takes colour out of so bright a sky."""
    off, on = (picture(results / f"preview_{name}_{is_on}.png") for is_on in (False, True))
    others = np.delete(on, channel, axis=-1)
    assert (on[..., channel] > times * others.max(axis=-1)).mean() > 0.1
    assert np.array_equal(off, on)


def test_animation(results):
    frames = [picture(results / name) for name in FRAMES]
    assert all(frame.shape == (60, 80, 3) for frame in frames)
    # The cube turns, and the noise changes from frame to frame.
    assert np.abs(frames[0] - frames[1]).max() > 0.1 and np.abs(frames[1] - frames[2]).max() > 0.1


def test_comparison_fills_its_slots(results, facts):
    """Both slots show the same scene; J steps between them, and from the user's slots as ever."""
    assert {"Cycles", "Spectral Tiles"} <= set(facts["slots"])
    assert facts["stepped"] == ["Cycles", "Spectral Tiles", "Cycles"]
    assert facts["stepped_from_the_first"] == "Cycles"  # the next one that holds something
    for name, place in (("Cycles", 1), ("Spectral Tiles", 2)):
        slot, stepped = (picture(results / f"{shot}.png")[:870] for shot in (f"slot_{name}", f"stepped_{place}"))
        assert np.array_equal(slot, stepped)  # but for a message below
    assert {"VIEW_3D", "PROPERTIES"} <= set(facts["areas_after_comparison"])  # Esc leads back to them
    cycles, ours = picture(results / "Cycles.exr"), picture(results / "Spectral Tiles.exr")
    assert np.abs(cycles - ours).mean() < 0.1 * cycles.mean()


def test_off_and_on_twenty_times(facts):
    assert facts["engine_afterwards"] == "CYCLES" and facts["switch_afterwards"]


def test_disabled_while_it_renders(results, facts):
    """Blender goes on, Esc ends the render, and the next one is Cycles' own."""
    assert facts["seconds_to_cancel_disabled"] < 30
    assert picture(results / "disabled.exr").shape == (60, 80, 3)


MAKE_FILE = """
import bpy
scene = bpy.context.scene
scene.render.engine = "CYCLES"
scene.spectral_tiles.enabled = True
scene.cycles.samples = 16
scene.cycles.use_adaptive_sampling = False
scene.render.resolution_x = scene.render.resolution_y = 32
scene.render.filepath = "//picture_"
scene.cycles.use_denoising = False
bpy.ops.wm.save_as_mainfile(filepath="good.blend")
scene.cycles.use_denoising = True  # which this build lacks the module for
bpy.ops.wm.save_as_mainfile(filepath="denoised.blend")
scene.spectral_tiles.method = "GATHER"
bpy.ops.wm.save_as_mainfile(filepath="refused.blend")
"""


@pytest.fixture(scope="module")
def home(root, archive):
    """A profile with the extension, and files to render."""
    with window.home(root) as folder:
        shutil.copy(archive, folder / "spectral_tiles.zip")
        (folder / "make.py").write_text(MAKE_FILE)
        install = ["--command", "extension", "install-file", "-r", "user_default", "-e", "spectral_tiles.zip"]
        for arguments in (install, ["-P", "make.py"]):
            done = window.run(root, folder, "blender", "-b", *arguments)
            assert done.returncode == 0, done.stdout
        yield folder


@pytest.mark.parametrize("frames", [["-f", "1"], ["-s", "1", "-e", "3", "-a"]], ids=" ".join)
def test_refused_on_the_command_line(root, home, frames):
    """Exit code 1, one line that says why, no picture, and the file as it was."""
    file = home / "refused.blend"
    before = file.read_bytes()
    done = window.run(root, home, "blender", "-b", file.name, *frames)
    assert done.returncode == 1
    assert len([line for line in done.stdout.splitlines() if "ERROR" in line]) == 1, done.stdout
    assert not list(home.glob("picture_*"))
    assert file.read_bytes() == before


def test_rendered_on_the_command_line(root, home):
    """By the switch that is saved in the file."""
    done = window.run(root, home, "blender", "-b", "good.blend", "-f", "1")
    assert done.returncode == 0 and "ERROR" not in done.stdout, done.stdout
    assert "Sampling by noise" in done.stdout
    assert picture(home / "picture_0001.png").shape == (32, 32, 3)


FAILING_DENOISER = """
import importlib
denoiser = importlib.import_module("bl_ext.user_default.spectral_tiles.addon.cycles.denoiser")
denoiser.openimageio.load = lambda: None  # as if this build had the module
def fail(*_):
    raise MemoryError("out of memory")
denoiser._denoise = fail
"""


def test_a_failed_denoiser_on_the_command_line(root, home):
    """Exit code 1, one line that says why, and the noisy picture."""
    (home / "failing.py").write_text(FAILING_DENOISER)
    done = window.run(root, home, "blender", "-b", "denoised.blend", "-P", "failing.py", "-f", "2")
    assert done.returncode == 1 and done.stdout.count("Cannot denoise: out of memory") == 1, done.stdout
    assert picture(home / "picture_0002.png").std() > 0.01
    (home / "picture_0002.png").unlink()


def command(root, home, *arguments, before=()):
    """Exit code of our command, and the lines that it wrote by itself."""
    done = window.run(root, home, *before, "blender", "--command", "spectral_tiles", *arguments)
    return done.returncode, [line for line in done.stdout.splitlines() if line.startswith("spectral_tiles: ")]


def test_command(root, home):
    """Exit codes, one line for what is wrong, and nothing left behind."""
    assert command(root, home, "render", "good.blend", "--output", "made.png") == (0, [])
    assert picture(home / "made.png").shape == (32, 32, 3)
    assert command(root, home, "render", "denoised.blend", "--output", "denoised.png") == (0, [])
    for code, arguments in ((1, ["render", "refused.blend"]), (2, ["render", "none.blend"]), (2, [])):
        found, lines = command(root, home, *arguments)
        assert found == code and len(lines) == 1
    assert not list(home.glob("blender_*"))


def test_command_is_interrupted(root, home):
    """Ctrl-C while Cycles renders: hours, if it were not heeded."""
    interrupt = ("timeout", "--preserve-status", "-s", "INT", "4")
    render = ["render", "good.blend", "--samples", "1024", "--percentage", "5000", "--output", "stopped/frame.png"]
    assert command(root, home, *render, before=interrupt) == (130, ["spectral_tiles: interrupted"])
    assert list((home / "stopped").iterdir()) == []
