# SPDX-License-Identifier: GPL-3.0-or-later
"""The command line: what it writes and prints, and its exit codes."""

import gc
import json
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import bpy
import numpy as np
import pytest

from addon import drivers
from addon.blender import openimageio
from addon.cycles import denoiser
from addon.interface import command_line, comparison
from tests import effort, rendering


@pytest.fixture
def scene_file(tmp_path):
    scene = rendering.empty_scene(32, 24)
    rendering.add_plane(20, rendering.diffuse())
    rendering.add_light("AREA", 500, (2, 2, 5), size=4.0)
    rendering.add_camera()
    scene.frame_start, scene.frame_end = 1, 3
    path = tmp_path / "scene.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    return str(path)


ROOT = Path(__file__).parents[2]


def run(*arguments):
    return command_line.run([str(argument) for argument in arguments])


def test_render(scene_file, tmp_path, capfd):
    summary = tmp_path / "summary.json"
    output = tmp_path / "out" / "picture_##.png"
    options = ("--frames", "1,3", "--samples", "4", "--percentage", "50", "--json", summary)
    assert run("render", scene_file, "--output", output, *options) == command_line.DONE
    assert sorted(path.name for path in output.parent.iterdir()) == ["picture_01.png", "picture_03.png"]
    said = json.loads(summary.read_text())
    assert said["files"] == [str(output.parent / name) for name in ("picture_01.png", "picture_03.png")]
    assert (said["samples"], said["first_sample"], said["samples_taken"]) == (4, 0, 4)
    assert [frame["frame"] for frame in said["frames"]] == [1, 3] and said["seconds"] > 0
    assert openimageio.load().ImageBuf(said["files"][0]).spec().width == 16

    printed = capfd.readouterr().out
    percents = [int(number) for number in re.findall(r"^openjd_progress: (\d+)$", printed, re.MULTILINE)]
    assert percents == sorted(set(percents)) and percents[0] == 0 and percents[-1] == 100
    assert re.findall(r"^openjd_status: (.*)$", printed, re.MULTILINE) == ["frame 1, 1 of 2", "frame 3, 2 of 2"]


def test_progress_of_many_calls(scene_file, tmp_path, capfd):
    """Of all of them together, though Cycles tells of each by itself."""
    settings = command_line.picture_files.open_scene(scene_file).spectral_tiles
    settings.method, settings.sub_frames = "SUB_FRAMES", 16
    bpy.context.scene.render.use_motion_blur = True
    bpy.ops.wm.save_mainfile()
    assert run("render", scene_file, "--output", tmp_path / "a.png", "--samples", "32") == command_line.DONE
    percents = re.findall(r"^openjd_progress: (\d+)$", capfd.readouterr().out, re.MULTILINE)
    assert percents == [*(str(int(100 * moment / 16)) for moment in range(16)), "99", "100"]


def test_render_where_the_scene_says(scene_file, tmp_path):
    assert run("render", scene_file, "--frames", "all", "--output", tmp_path / "f") == command_line.DONE
    assert sorted(path.name for path in tmp_path.glob("f*")) == ["f0001.png", "f0002.png", "f0003.png"]


def test_frames_of_a_path_with_an_ending(scene_file, tmp_path):
    assert run("render", scene_file, "--frames", "2-3", "--output", tmp_path / "f.png") == command_line.DONE
    assert sorted(path.name for path in tmp_path.glob("f*")) == ["f0002.png", "f0003.png"]


@pytest.mark.parametrize(
    ("frames", "output", "names"),
    [
        ("2", "a.jpeg", ["a.jpeg"]),
        ("2", "a.JPG", ["a.JPG"]),
        ("2", "a.tiff", ["a.tiff"]),
        ("2", "a.webp", ["a.webp"]),
        ("2", "a.avif", ["a.avif"]),
        ("2", "a.bmp", ["a.bmp"]),
        ("2", "a.hdr", ["a.hdr"]),
        ("2", "a.tga", ["a.tga"]),
        ("2", "a.dpx", ["a.dpx"]),
        ("2", "a.cin", ["a.cin"]),
        ("2", "a.rgb", ["a.rgb"]),
        ("2", "a.exr", ["a.exr"]),
        ("2", "folder/", ["0002.png"]),
        ("1-2", "folder/", ["0001.png", "0002.png"]),
        ("2", "a", ["a.png"]),
        ("2", "v1.2_##", ["v1.2_02.png"]),
        ("2", "{scene_name}.png", ["Scene.png"]),
        ("1,2", "{scene_name}_#.png", ["Scene_1.png", "Scene_2.png"]),
        ("-3", "a.png", ["a.png"]),
        ("-3", "a_####.png", ["a_-0003.png"]),
        ("-2--1", "a_##.png", ["a_-01.png", "a_-02.png"]),
        ("-1-1", "a_##.png", ["a_-01.png", "a_00.png", "a_01.png"]),
    ],
)
def test_names_of_pictures(scene_file, tmp_path, frames, output, names):
    folder = tmp_path / "out"
    line = ("render", scene_file, f"--frames={frames}", "--output", f"{folder}/{output}", "--percentage", "50")
    assert run(*line) == command_line.DONE
    found = [path for path in folder.rglob("*") if path.is_file()]
    assert sorted(path.name for path in found) == names
    for path in found:
        image = bpy.data.images.load(str(path))
        assert (tuple(image.size) == (16, 12)) or image.type == "MULTILAYER"


@pytest.mark.parametrize("output", ["", "a.xyz", "a.mp4", "a.gif"])
def test_names_that_no_picture_has(scene_file, capfd, output):
    assert run("render", scene_file, "--output", output) == command_line.WRONG_USE
    line, *rest = capfd.readouterr().err.splitlines()
    assert not rest and (not output or ".jpeg .jpg .png" in line)


@pytest.mark.parametrize("output", ["x{frame}.png", "x{.png"])
def test_fields_that_blender_does_not_know(scene_file, tmp_path, capfd, output):
    assert run("render", scene_file, "--output", tmp_path / output) == command_line.FAILED
    errors = [line for line in capfd.readouterr().err.splitlines() if line.startswith("spectral_tiles: ")]
    assert len(errors) == 1 and output in errors[0] and "report this" not in errors[0]
    assert [path.name for path in tmp_path.iterdir()] == ["scene.blend"]


def test_summary_that_cannot_be_written_is_noticed_before(scene_file, tmp_path, monkeypatch, capfd):
    monkeypatch.setattr(command_line.picture_files, "open_scene", lambda *_: pytest.fail("went on"))
    for path in (tmp_path / "missing" / "summary.json", tmp_path, f"{scene_file}/summary.json", ""):
        assert run("render", scene_file, "--json", path) == command_line.WRONG_USE
        assert len(capfd.readouterr().err.splitlines()) == 1


def test_the_switch_is_turned_on_and_the_settings_are_cycles(scene_file, tmp_path, monkeypatch):
    seen = []
    monkeypatch.setattr(
        drivers, "render", lambda engine, depsgraph, native: seen.append(depsgraph.scene.cycles.samples)
    )
    run("render", scene_file, "--samples", "7", "--seed", "3", "--output", tmp_path / "a.png")
    scene = bpy.context.scene
    assert seen == [7] and scene.spectral_tiles.enabled and scene.render.engine == "CYCLES" and scene.cycles.seed == 3


@pytest.mark.parametrize("ending", ["png", "exr", "jpg", "webp"])
def test_a_full_disk_keeps_the_picture_that_is_there(scene_file, tmp_path, monkeypatch, capfd, ending):
    """As Blender leaves it: cut off in the middle, and hardly a word about it."""
    picture = tmp_path / f"a.{ending}"
    picture.write_bytes(b"good")
    listdir = os.listdir

    def cut(folder):
        folder = str(folder)
        for name in (found := listdir(folder)):
            path = os.path.join(folder, name)
            if name == picture.name and ".spectral_tiles-" in folder:
                os.truncate(path, os.path.getsize(path) // 2)
        return found

    monkeypatch.setattr(command_line.picture_files.os, "listdir", cut)
    assert run("render", scene_file, "--output", picture) == command_line.FAILED
    assert picture.read_bytes() == b"good" and len(list(tmp_path.iterdir())) == 2
    errors = [line for line in capfd.readouterr().err.splitlines() if line.startswith("spectral_tiles: ")]
    assert len(errors) == 1 and picture.name in errors[0]


def test_compare(scene_file, tmp_path, capfd):
    bpy.context.scene.spectral_tiles.method = "GATHER"
    bpy.ops.wm.save_mainfile()
    folder, theirs = tmp_path / "pictures", tmp_path / "theirs"
    folder.mkdir()
    theirs.write_text("not ours")
    (folder / "cycles.png").symlink_to(theirs)  # which is replaced, not written through
    assert run("compare", scene_file, "--out", folder, "--reference-samples", "16", "--json", "-") == command_line.DONE
    names = [f"{name}.{ending}" for name in ("cycles", "spectral_tiles") for ending in ("exr", "png")]
    assert sorted(path.name for path in folder.iterdir()) == names
    assert theirs.read_text() == "not ours" and not (folder / "cycles.png").is_symlink()
    summary = json.loads(capfd.readouterr().out.splitlines()[-1])
    assert [error.keys() for error in summary["errors"].values()] == 3 * [{"cycles", "spectral_tiles", "ratio"}]
    # Both took the same samples of the same light, in another order.
    ratios = [error["ratio"] for error in summary["errors"].values()]
    assert ratios != [1.0, 1.0, 1.0] and all(0.3 < ratio < 3.0 for ratio in ratios)


def test_comparison_measures_known_errors():
    """White noise of known variance, against two noisy halves: unbiased, and smaller through a Gaussian."""
    random = np.random.default_rng(1)
    truth = random.random((128, 128))
    pictures = {name: truth + random.normal(0, 0.1, truth.shape) for name in comparison.RENDERS.values()}
    halves = [truth + random.normal(0, 0.05, truth.shape) for _ in range(2)]
    for sigma in comparison.SIGMAS:
        # A Gaussian leaves 1 / (4 pi sigma^2) of white noise's variance; 16,384 pixels tell it to a few percent.
        expected = 0.01 / (4 * np.pi * sigma**2) if sigma else 0.01
        found = comparison._errors(pictures, halves, sigma)
        assert found["cycles"] == pytest.approx(expected, rel=0.15)
        assert found["spectral_tiles"] == pytest.approx(expected, rel=0.15)


def test_a_refused_render_is_one_line_and_code_1(scene_file, tmp_path, capfd):
    summary = tmp_path / "summary.json"
    output = tmp_path / "out" / "picture.png"
    tile = tmp_path / "none.npz"
    tile.write_text("no tile")
    refused = ("render", scene_file, "--output", output, "--pattern", tile, "--json", summary)
    assert run(*refused) == command_line.FAILED
    errors = [line for line in capfd.readouterr().err.splitlines() if line.startswith("spectral_tiles: ")]
    assert len(errors) == 1 and "none.npz" in errors[0]
    assert "none.npz" in json.loads(summary.read_text())["error"]
    assert not list(output.parent.iterdir())


def test_a_damaged_pattern_keeps_no_engine(scene_file, tmp_path, monkeypatch):
    """Or else Blender's own destructor fails later, with lines of its own."""
    (tmp_path / "a.npz").write_text("no tile")
    gc.collect()
    ignored = []
    monkeypatch.setattr(sys, "unraisablehook", lambda error: ignored.append(str(error.exc_value)))
    assert run("render", scene_file, "--pattern", tmp_path / "a.npz") == command_line.FAILED
    gc.collect()
    assert ignored == []


def test_a_failed_denoiser_is_code_1_and_the_noisy_pictures(scene_file, tmp_path, monkeypatch, capfd):
    command_line.picture_files.open_scene(scene_file).cycles.use_denoising = True
    bpy.ops.wm.save_mainfile()

    def fail(*_):
        raise MemoryError("out of memory")

    monkeypatch.setattr(denoiser, "_denoise", fail)
    asked = ("--output", tmp_path / "#.png", "--samples", "16", "--frames", "1,2", "--json", tmp_path / "summary")
    assert run("render", scene_file, *asked) == command_line.FAILED
    assert capfd.readouterr().err == "spectral_tiles: Cannot denoise: out of memory\n"
    said = json.loads((tmp_path / "summary").read_text())
    assert said["files"] == [str(tmp_path / "1.png"), str(tmp_path / "2.png")]
    assert said["error"] == "Cannot denoise: out of memory" and (tmp_path / "2.png").exists()
    monkeypatch.undo()
    assert run("render", scene_file, *asked) == command_line.DONE


def test_failures_are_code_1(scene_file, tmp_path):
    garbage = tmp_path / "garbage.blend"
    garbage.write_text("no scene")
    assert run("render", garbage) == command_line.FAILED
    assert run("render", scene_file, "--scene", "None of them") == command_line.FAILED
    assert run("render", scene_file, "--layer", "1/4", "--samples", "2") == command_line.FAILED
    assert run("render", scene_file, "--output", scene_file + "/picture.png") == command_line.FAILED
    assert run("merge", tmp_path / "picture.exr") == command_line.FAILED
    assert run("render", scene_file, "--pattern", "no such pattern") == command_line.FAILED


def test_only_openexr_is_merged(scene_file, tmp_path, capfd):
    for layer in ("1/2", "2/2"):
        output = tmp_path / "picture.exr"
        assert run("render", scene_file, "--samples", "2", "--layer", layer, "--output", output) == command_line.DONE
    assert run("merge", tmp_path / "merged.png", *tmp_path.glob("picture_layer*.exr")) == command_line.FAILED
    assert "OpenEXR" in capfd.readouterr().err and not (tmp_path / "merged.png").exists()


def test_a_refused_comparison_renders_nothing(scene_file, tmp_path):
    assert run("compare", scene_file, "--out", tmp_path / "out", "--pattern", __file__) == command_line.FAILED
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("error", [MemoryError(), ZeroDivisionError("division"), ValueError("two\nlines")])
def test_a_mistake_of_ours_is_one_line_too(scene_file, tmp_path, monkeypatch, capfd, error):
    def fail(*_):
        raise error

    monkeypatch.setattr(command_line.picture_files, "render", fail)
    assert run("render", scene_file, "--json", tmp_path / "summary.json") == command_line.FAILED
    lines = capfd.readouterr().err.splitlines()
    assert len(lines) == 1 and json.loads((tmp_path / "summary.json").read_text())["error"] in lines[0]


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_interrupted_while_cycles_renders(scene_file, tmp_path, number):
    """It ends at once, in one line, and leaves nothing but the summary."""
    folder, summary = tmp_path / "out", tmp_path / "summary.json"
    line = ["render", scene_file, "--samples", "4096", "--percentage", "300", "--output", folder / "picture.exr"]
    program = [
        sys.executable,
        "-c",
        "from addon.interface import command_line; command_line.main()",
        *line,
        "--json",
        summary,
    ]
    # A shell's background job ignores interrupts, and so would what it starts.
    process = subprocess.Popen(
        program,
        cwd=ROOT,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
    )
    assert any(line == "openjd_progress: 0\n" for line in process.stdout)
    time.sleep(1.0)  # by now Cycles renders, which would take a minute
    process.send_signal(number)
    _, errors = process.communicate(timeout=20)
    assert process.returncode == command_line.INTERRUPTED
    assert errors.splitlines() == ["spectral_tiles: interrupted"]
    assert json.loads(summary.read_text())["error"] == "interrupted"
    assert list(folder.iterdir()) == []


@pytest.mark.parametrize(
    "arguments",
    [
        [],
        ["dance"],
        ["render"],
        ["render", "missing.blend"],
        ["render", __file__, "--samples", "0"],
        ["render", __file__, "--samples", "many"],
        ["render", __file__, "--seed", "-1"],
        ["render", __file__, "--seed", "99999999999"],
        ["render", __file__, "--percentage", "99999999999"],
        ["render", __file__, "--frames", "1-99999999999"],
        ["render", __file__, "--frames", "4-1"],
        ["render", __file__, "--frames", "x"],
        ["render", __file__, "--layer", "5/4"],
        ["render", __file__, "--layer", "2"],
        ["render", __file__, "--layer", "1/0"],
        ["render", __file__, "--layer", "1/99999999999"],
        ["render", __file__, "--samples", "1" + 5000 * "0"],
        ["render", __file__, "--frames", "1--"],
        ["render", __file__, "--frames", "1,"],
        ["render", __file__, "--frames=-1048575"],
        ["compare", __file__],
        ["compare", __file__, "--out", ""],
        ["compare", __file__, "--out", "a\0b"],
        ["compare", __file__, "--out", "a", "--reference-samples", "1" + 5000 * "0"],
        ["compare", __file__, "--out", "a", "--frame", "-1048575"],
        ["render", __file__, "--seed", "2147483648"],
        ["render", __file__, "--percentage", "32768"],
        ["render", "\udcff.blend"],
        ["render", __file__, "--frames", "\udcff"],
        ["merge"],
        ["tile", "info", "missing.npz"],
        ["tile"],
    ],
)
def test_wrong_use_is_one_line_and_code_2(arguments, capfd):
    assert run(*arguments) == command_line.WRONG_USE
    (line,) = capfd.readouterr().err.splitlines()
    assert len(line) <= 200


def test_help_and_tiles(tmp_path, capsys):
    for arguments in (["--help"], *([name, "--help"] for name in ("render", "compare", "merge", "tile"))):
        assert run(*arguments) == command_line.DONE
        assert "usage: blender --command spectral_tiles" in capsys.readouterr().out
    run("render", "--help")
    told = " ".join(capsys.readouterr().out.split())
    bounds = (
        "1 to 16777216",
        "-1048574 to 1048574",
        "0 to 2147483647",
        "1 to 32767",
        "65536 pixels",
        "1 to K",
        ".avif",
    )
    assert all(bound in told for bound in bounds)
    tile = tmp_path / "tile.npz"
    make = ("tile", "make", "--size", "8", "--steps", "50", "--dims", "t", "--out", tile, "--json", "-")
    assert run(*make) == command_line.DONE
    printed = capsys.readouterr().out
    percents = [int(number) for number in re.findall(r"^openjd_progress: (\d+)$", printed, re.MULTILINE)]
    assert percents == sorted(set(percents)) and len(percents) > 10 and percents[-1] == 100
    assert json.loads(printed.splitlines()[-1])["files"] == [str(tile)]
    assert run("tile", "info", tile) == command_line.DONE
    assert "8 x 8 pixels" in capsys.readouterr().out


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_making_a_tile_is_interrupted(tmp_path, monkeypatch, capsys, number):
    monkeypatch.setattr(command_line.Percent, "tell", lambda self, part: part > 0.5 and signal.raise_signal(number))
    line = ("tile", "make", "--size", "8", "--steps", "50", "--dims", "t", "--out", tmp_path / "tile.npz")
    before = [signal.getsignal(one) for one in (signal.SIGINT, signal.SIGTERM)]
    assert run(*line) == command_line.INTERRUPTED
    errors = capsys.readouterr().err.strip().splitlines()
    assert len(errors) == 1 and "interrupted" in errors[0] and not list(tmp_path.iterdir())
    assert [signal.getsignal(one) for one in (signal.SIGINT, signal.SIGTERM)] == before


@pytest.mark.parametrize(
    "arguments",
    [
        ["render", "FILE", "--json", "FILE"],
        ["render", "FILE", "--output", "a.png", "--json", "a.png"],
        ["merge", "f.exr", "--json", "f.exr"],
        ["merge", "f.exr", "l.exr", "--json", "./l.exr"],
        ["render", "FILE", "--output", "."],
        ["render", "FILE", "--output", ".."],
        ["render", "FILE", "--output", "out/.png"],
        ["render", "FILE", "--output", "a\0b.png"],
        ["render", "FILE", "--frames=" + ",".join(100 * ["-1048574-1048574"])],
    ],
    ids=lambda arguments: " ".join(arguments)[:60].replace("\0", "0"),
)
def test_what_would_be_lost_or_never_end_is_wrong_use(scene_file, tmp_path, monkeypatch, capfd, arguments):
    monkeypatch.chdir(tmp_path)
    before = Path(scene_file).read_bytes()
    assert run(*(scene_file if word == "FILE" else word for word in arguments)) == command_line.WRONG_USE
    assert len(capfd.readouterr().err.splitlines()) == 1
    assert Path(scene_file).read_bytes() == before and [path.name for path in tmp_path.iterdir()] == ["scene.blend"]


def test_a_summary_does_not_replace_what_a_link_leads_to(scene_file, tmp_path, capfd):
    link = tmp_path / "link.blend"
    link.symlink_to(scene_file)
    before = Path(scene_file).read_bytes()
    assert run("render", link, "--json", scene_file) == command_line.WRONG_USE
    picture = tmp_path / "a.png"
    picture.symlink_to(tmp_path / "nothing")
    assert run("render", scene_file, "--output", picture, "--json", picture) == command_line.WRONG_USE
    assert Path(scene_file).read_bytes() == before and link.is_symlink()


@pytest.mark.parametrize("name", ["\udcff\udcfe", "\ud800", "", "a\0b", "x" * 10000, "a\nb"])
def test_scenes_of_any_name_are_refused_in_one_line(scene_file, capfd, name):
    assert run("render", scene_file, "--scene", name) == command_line.FAILED
    (line,) = (line for line in capfd.readouterr().err.splitlines() if line.startswith("spectral_tiles: "))
    assert "has no scene" in line and len(line) <= 200 and line.isprintable()


def test_names_that_are_no_unicode_work(scene_file, tmp_path, capfd):
    """As Linux allows any bytes, which Python shows by surrogates."""
    folder = tmp_path / "\udcff"
    scene = scene_file.replace("scene", "\udcfe")
    os.rename(scene_file, scene)
    for layer in ("1/2", "2/2"):
        assert run("render", scene, "--output", folder / "\udcfd.exr", "--samples", "2", "--layer", layer) == 0
    assert run("merge", folder / "\udcfd.exr", "--json", folder / "\udcfc.json") == command_line.DONE
    assert json.loads((folder / "\udcfc.json").read_text())["files"] == [str(folder / "\udcfd.exr")]
    assert run("compare", scene, "--out", folder / "c", "--reference-samples", "1") == command_line.DONE
    names = ["c", *(f"\udcfd{rest}" for rest in (".exr", "_layer1of2.exr", "_layer2of2.exr")), "\udcfc.json"]
    assert sorted(path.name for path in folder.iterdir()) == sorted(names)


@pytest.mark.parametrize("percentage", [10000, 32767])
def test_pictures_beyond_blenders_size_are_refused_before_memory_is_taken(tmp_path, capfd, percentage):
    rendering.empty_scene(1920, 1080)
    rendering.add_camera()
    path = tmp_path / "scene.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    for command, option in (("render", "--output"), ("compare", "--out")):
        with effort.within(1, 50e6):
            assert run(command, path, option, tmp_path / "a", "--percentage", percentage) == command_line.FAILED
        (line,) = (line for line in capfd.readouterr().err.splitlines() if line.startswith("spectral_tiles: "))
        assert "too large" in line and len(line) <= 200
    assert [path.name for path in tmp_path.iterdir()] == ["scene.blend"]


def test_progress_of_pictures_in_tiles(scene_file, tmp_path, capfd):
    """Of all of Cycles' own, not of the first."""
    cycles, render = bpy.context.scene.cycles, bpy.context.scene.render
    cycles.use_auto_tile, cycles.tile_size, render.resolution_x, render.resolution_y = True, 64, 256, 256
    bpy.ops.wm.save_mainfile()
    assert run("render", scene_file, "--output", tmp_path / "a.png", "--samples", "2") == command_line.DONE
    percents = [int(line.split()[1]) for line in capfd.readouterr().out.splitlines() if "openjd_progress" in line]
    assert percents == sorted(set(percents)) and len(percents) > 16 and percents[0] == 0 and percents[-1] == 100


def test_a_summary_is_no_frame(scene_file, tmp_path, capfd):
    given = ["--frames", "1-3", "--output", tmp_path / "f####.png", "--json", tmp_path / "f0002.png"]
    assert run("render", scene_file, *given) == command_line.FAILED
    assert not list(tmp_path.glob("f*.png"))


def test_a_folder_in_the_way_of_a_later_frame_is_told_first(scene_file, tmp_path, capfd):
    (tmp_path / "f0003.png").mkdir()
    assert run("render", scene_file, "--frames", "1-3", "--output", tmp_path / "f####.png") == command_line.FAILED
    assert [path.name for path in tmp_path.glob("f*.png")] == ["f0003.png"]


def test_a_number_sign_in_a_folder_is_no_number(scene_file, tmp_path, monkeypatch):
    folder = tmp_path / "shot#2"
    folder.mkdir()
    monkeypatch.chdir(folder)
    assert run("render", scene_file, "--output", "a.png") == command_line.DONE
    assert run("render", scene_file, "--output", folder / "b.png") == command_line.DONE
    assert sorted(path.name for path in folder.iterdir()) == ["a.png", "b.png"]
