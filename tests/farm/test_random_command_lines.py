# SPDX-License-Identifier: GPL-3.0-or-later
"""Random command lines: an exit code, one line about what is wrong, old files as they were, nothing left behind."""

import itertools
import os
import random
import re

import bpy
import pytest

from addon.farm import layers
from addon.interface import command_line
from tests import effort, rendering

SECONDS, MEMORY = 2.0, 100e6  # of processor time for a render; of memory, which Cycles takes most of

NUMBERS = ("1", "2", "3", "4", "0", "-1", "1e3", "x", "", "99999999999999999999", "1.5", " 2", "٣", "nan", "0x2")
FRAMES = ("1", "1,3", "2-3", "-2--1", "all", "3-1", "1-99999999999", "x", "", ",", "1-", "--", "1,2,x", "-5")
PATTERNS = ("auto", "spectral", "spectral_64", "none.npz", "", "scene.blend", "AUTO", "x" * 300, "a\nb", ".")
OUTPUTS = (
    "a.png",
    "b_##.jpg",
    "c",
    "d/",
    "e.exr",
    "f.mp4",
    "",
    ".",
    "old.png",
    "old.png/x.png",
    "{x}.png",
    "{scene_name}.png",
    "{{y}}.png",
    "ä ö.png",
    "n" * 260 + ".png",
    "/dev/null",
    "/dev/null/a.png",
    "/proc/a.png",
    "link.png",
    "new\nline.png",
    "folder.png",
    "%s%d.png",
    "-a.png",
)
SUMMARIES = ("s.json", "-", "", "none/s.json", "folder.png", "old.json", "/dev/full", "/proc/s.json", "x" * 300)
LAYERS = ("1/2", "2/2", "1/1", "3/2", "0/2", "x", "1/99999999", "-1/2", "1/2/3", "")
SCENES = ("Scene", "None", "", "S" * 500)
MERGED = (
    "e.exr",
    "frame.exr",
    "old.png",
    "",
    "x.exr",
    "none/x.exr",
    "frame_layer1of2.exr",
    "folder.exr",
    "q" * 300 + ".exr",
)


def random_line(chance):
    command = chance.choice(("render", "render", "render", "compare", "merge", "merge", "x", ""))
    line = [command] if command or chance.random() < 0.5 else []
    if command == "merge":
        line.append(chance.choice(MERGED))
        line += chance.choices(
            ("frame_layer1of2.exr", "frame_layer2of2.exr", "old.png", "none.exr", "."), k=chance.choice((0, 0, 1, 2, 3))
        )
    else:
        line.append(
            chance.choice(("scene.blend",) * 8 + ("none.blend", "old.png", ".", "", "empty.blend", "notes.blend"))
        )
    options = {
        "--samples": NUMBERS,
        "--seed": NUMBERS,
        "--percentage": ("10", "20", *NUMBERS[4:]),
        "--pattern": PATTERNS,
        "--scene": SCENES,
        "--json": SUMMARIES,
        "--frames": FRAMES,
        "--layer": LAYERS,
        "--unknown": NUMBERS,
    }
    # Half of the lines have nothing wrong in their options, or one thing.
    for name in chance.sample(sorted(options), k=chance.choice((0, 1, 1, 2, 4))):
        good = chance.random() < 0.5
        value = options[name][0] if good else chance.choice(options[name])
        line += [f"{name}={value}"] if chance.random() < 0.7 else [name, value]
    if command == "render":
        line += ["--output", chance.choice(OUTPUTS)]
    elif command == "compare":
        line += [
            "--out",
            chance.choice(("out", ".", "old.png", "", "folder.png", "none/deep")),
            "--reference-samples=1",
        ]
    return line


@pytest.fixture
def folder(extension, tmp_path, monkeypatch):
    scene = rendering.empty_scene(16, 12)
    rendering.add_plane(20, rendering.diffuse())
    rendering.add_light("AREA", 500, (2, 2, 5), size=4.0)
    rendering.add_camera()
    scene.frame_start, scene.frame_end = 1, 3
    scene.render.filepath = str(tmp_path / "by_scene_")
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scene.blend"))
    monkeypatch.chdir(tmp_path)
    for layer in (1, 2):
        line = ["render", "scene.blend", "--output", "frame.exr", "--samples", "2", "--layer", f"{layer}/2"]
        assert command_line.run(line) == command_line.DONE
        assert os.path.isfile(layers.file_of("frame.exr", layer, 2))
    for name in ("old.png", "old.json", "notes.blend", "aim"):
        (tmp_path / name).write_text("old")
    (tmp_path / "empty.blend").touch()
    (tmp_path / "folder.png").mkdir()
    (tmp_path / "folder.exr").mkdir()
    (tmp_path / "link.png").symlink_to("aim")
    return tmp_path


def tree(folder):
    return {
        path.relative_to(folder): None if path.is_dir() else path.read_bytes()
        for path in folder.rglob("*")
        if not re.search(r"\.blend\d?$", path.name)
    }


def try_lines(folder, capfd, seeds):
    codes = set()
    for seed in seeds:
        line = random_line(random.Random(seed))
        before = tree(folder)
        capfd.readouterr()
        with effort.within(SECONDS, MEMORY):
            code = command_line.run(line)
        codes.add(code)
        printed = capfd.readouterr().err
        errors = [said for said in printed.splitlines() if said.startswith("spectral_tiles")]
        assert "Traceback" not in printed, (seed, line, printed)
        after = tree(folder)
        assert code in (0, 1, 2), line
        assert len(errors) == (1 if code else 0), (seed, line, errors)
        assert not any("report this" in said for said in errors), (seed, line, errors)
        assert all(len(said) <= 200 for said in errors), (seed, line, errors)
        hidden = [path for path in after if path.name.startswith(".spectral") or path.name == "room"]
        assert not hidden, (seed, line, hidden)
        said = [after for before, after in itertools.pairwise(line) if before == "--json"]
        said += [word.removeprefix("--json=") for word in line if word.startswith("--json=")]
        changed = {str(path) for path in before if after.get(path, b"") != before[path]}
        if code == command_line.WRONG_USE:
            assert after == before, (seed, line)
        elif code:  # of what was there only the summary, which tells the error
            assert changed <= set(said), (seed, line)
        assert all(path in after for path in before), (seed, line)
        assert all(data for data in after.values() if data is not None), (seed, line)
        assert (folder / "aim").read_text() == "old"
    return codes


def test_random_command_lines(folder, capfd):
    assert try_lines(folder, capfd, range(200)) == {0, 1, 2}


@pytest.mark.fuzz
def test_many_random_command_lines(folder, capfd):
    try_lines(folder, capfd, range(1000, 2500))
