# SPDX-License-Identifier: GPL-3.0-or-later
"""SIGKILL at any moment: what has a name is whole, and the next run clears what is left."""

import json
import random
import subprocess
import sys
import time
from pathlib import Path

import bpy
import pytest

from addon.farm import seal
from addon.interface import command_line
from tests import rendering

ROOT = Path(__file__).parents[2]

# Runs command lines one after the other, so many times over, from a given one on; lines of Blender go elsewhere.
WORKER = f"""
import json, os, sys
out = os.fdopen(os.dup(1), "w")
os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
sys.path.insert(0, {str(ROOT)!r})
import addon
from addon.interface import command_line
addon.register()
lines, first, rounds = json.loads(sys.argv[1])
print("ready", file=out, flush=True)
sys.stdin.readline() or sys.exit()
for number in range(first, first + rounds * len(lines)):
    line = lines[number % len(lines)]
    assert command_line.run(line) == 0, line
"""


def lines(scene_file, folder):
    """A picture, an animation, layers and their merge."""
    frame = f"{folder}/frame.exr"
    return [
        ["render", scene_file, "--output", f"{folder}/a.png", "--json", f"{folder}/a.json"],
        ["render", scene_file, "--output", f"{folder}/b_#.png", "--frames", "1-3"],
        ["render", scene_file, "--output", frame, "--samples", "2", "--layer", "1/2"],
        ["render", scene_file, "--output", frame, "--samples", "2", "--layer", "2/2"],
        ["merge", frame, "--json", f"{folder}/merge.json"],
    ]


@pytest.fixture
def scene_file(extension, tmp_path):
    rendering.empty_scene(32, 24)
    rendering.add_plane(20, rendering.diffuse())
    rendering.add_light("AREA", 500, (2, 2, 5), size=4.0)
    rendering.add_camera()
    path = tmp_path / "scene.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    return str(path)


@pytest.fixture
def folder(tmp_path):
    made = tmp_path / "out"
    made.mkdir()
    return made


def worker(commands, rounds, first=0):
    """A process that runs commands once it is told to."""
    line = [sys.executable, "-c", WORKER, json.dumps([commands, first, rounds])]
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    return subprocess.Popen(line, **pipes, text=True)


def check_whole(folder):
    """Everything that has a name of its own is what a run that ends well leaves."""
    for path in folder.iterdir():
        if path.name.startswith("."):
            continue
        if path.suffix == ".exr":
            seal.check(str(path))
            assert rendering.read_exr(path)
        elif path.suffix == ".png":
            command_line.picture_files.check(str(path), bpy.context.scene.render)
        else:
            assert path.read_text().endswith("}")


def kill_at_random_moments(scene_file, folder, times, seed):
    """Return how many of the killed left something behind."""
    commands, chance, left = lines(scene_file, folder), random.Random(seed), 0
    begun = time.perf_counter()
    for line in commands:
        assert command_line.run(line) == command_line.DONE
    seconds = time.perf_counter() - begun
    names = sorted(path.name for path in folder.iterdir())
    # While one works the next one gets ready.
    waiting = worker(commands, 1000)
    for time_left in reversed(range(times)):
        process, waiting = waiting, worker(commands, 1000, chance.randrange(len(commands))) if time_left else None
        with process:
            assert process.stdout.readline() == "ready\n", process.stderr.read()
            print(file=process.stdin, flush=True)
            time.sleep(chance.uniform(0, seconds))
            process.kill()
        left += any(path.name.startswith(".") for path in folder.iterdir())
        check_whole(folder)
    for line in commands:
        assert command_line.run(line) == command_line.DONE
    check_whole(folder)
    assert sorted(path.name for path in folder.iterdir()) == names
    return left


def test_a_kill(scene_file, folder):
    kill_at_random_moments(scene_file, folder, 1, seed=1)


@pytest.mark.fuzz
def test_kills(scene_file, folder):
    assert kill_at_random_moments(scene_file, folder, 50, seed=2)


def test_two_processes_into_one_folder(scene_file, folder):
    """... and the same names."""
    both = [worker(lines(scene_file, folder), 5) for _ in range(2)]
    for process in both:
        assert process.stdout.readline() == "ready\n"
    for process in both:
        print(file=process.stdin, flush=True)
    for process in both:
        _, errors = process.communicate(timeout=300)
        # Each may find layers of the other one, which are the same; all are whole.
        assert process.returncode == 0, errors
    check_whole(folder)
    assert not [path for path in folder.iterdir() if path.name.startswith(".")]
