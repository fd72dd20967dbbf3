# SPDX-License-Identifier: GPL-3.0-or-later
"""A signal at a bad moment: one line, one exit code, and nothing is left."""

import json
import subprocess
import sys
from pathlib import Path

import bpy
import pytest

from addon.interface import command_line
from tests import rendering

# Runs a command line after some lines that change what is called.
PROGRAM = """
import os, signal, sys, time
from addon.interface import command_line, picture_files
from addon.plan.patterns import atomic_file
write = command_line.generator.write_summary
{changes}
command_line.main()
"""

# The signal comes, and while one thread sees to the end, which takes a while here, the other would go on.
GOES_ON = """
def render(scene, path):
    signal.raise_signal(signal.SIGTERM)
    {before}
    with atomic_file.unfinished_folder(os.path.dirname(path)) as folder:
        while folder.is_dir():
            time.sleep(0.001)
    raise OSError("the folder is gone")
def write_slowly(*arguments):
    time.sleep(0.5)
    write(*arguments)
command_line.generator.write_summary, picture_files.render = write_slowly, render
"""

# Blender makes the folder that it writes into, if it has gone meanwhile.
COMES_BACK = """
def render(scene, path):
    with atomic_file.unfinished_folder(os.path.dirname(path)) as folder:
        signal.raise_signal(signal.SIGTERM)
        while folder.is_dir():
            time.sleep(0.001)
        folder.mkdir()
        time.sleep(10)
def write_slowly(*arguments):
    time.sleep(0.5)
    write(*arguments)
command_line.generator.write_summary, picture_files.render = write_slowly, render
"""

# All is done, and is being told.
TOO_LATE = """
def write_late(*arguments):
    signal.raise_signal(signal.SIGTERM)
    time.sleep(0.5)
    write(*arguments)
command_line.generator.write_summary = write_late
"""


@pytest.fixture
def line(tmp_path):
    rendering.empty_scene(16, 12)
    rendering.add_camera()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scene.blend"))
    (tmp_path / "out").mkdir()
    summary = ["--json", str(tmp_path / "summary.json")]
    return ["render", str(tmp_path / "scene.blend"), "--output", str(tmp_path / "out" / "a.png"), *summary]


def run(changes, line):
    program = [sys.executable, "-c", PROGRAM.format(changes=changes), *line]
    done = subprocess.run(program, cwd=Path(__file__).parents[2], capture_output=True, text=True, timeout=60)
    return done.returncode, done.stderr.splitlines()


@pytest.mark.parametrize(
    "changes",
    [GOES_ON.format(before=""), GOES_ON.format(before="time.sleep(0.2)"), COMES_BACK],
    ids=["goes on", "goes on later", "comes back"],
)
def test_nobody_goes_on_while_a_process_is_ended(line, tmp_path, changes):
    assert run(changes, line) == (command_line.INTERRUPTED, ["spectral_tiles: interrupted"])
    assert not list((tmp_path / "out").iterdir())
    assert json.loads((tmp_path / "summary.json").read_text())["error"] == "interrupted"


def test_what_is_done_cannot_be_interrupted(line, tmp_path):
    assert run(TOO_LATE, line) == (command_line.DONE, [])
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["a.png"]
    assert "error" not in json.loads((tmp_path / "summary.json").read_text())
