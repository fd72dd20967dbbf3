# SPDX-License-Identifier: GPL-3.0-or-later
"""SIGKILL at any moment: what has a name is whole, and the next run clears what is left."""

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

# Renders, layers and their merge, again and again; lines of Blender go elsewhere.
WORKER = f"""
import os, sys
out = os.fdopen(os.dup(1), "w")
os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
sys.path.insert(0, {str(ROOT)!r})
import addon
from addon.interface import command_line
addon.register()
scene, folder = sys.argv[1:3]
frame = f"{{folder}}/frame.exr"
lines = [
    ["render", scene, "--output", f"{{folder}}/a.png", "--json", f"{{folder}}/a.json"],
    ["render", scene, "--output", frame, "--samples", "2", "--layer", "1/2"],
    ["render", scene, "--output", frame, "--samples", "2", "--layer", "2/2"],
    ["merge", frame, "--json", f"{{folder}}/merge.json"],
]
for _ in range(int(sys.argv[3])):
    for line in lines:
        assert command_line.run(line) == 0, line
    print("round", file=out, flush=True)
"""


@pytest.fixture
def scene_file(extension, tmp_path):
    rendering.empty_scene(32, 24)
    rendering.add_plane(20, rendering.diffuse())
    rendering.add_light("AREA", 500, (2, 2, 5), size=4.0)
    rendering.add_camera()
    path = tmp_path / "scene.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    return str(path)


def worker(scene_file, folder, rounds):
    line = [sys.executable, "-c", WORKER, scene_file, str(folder), str(rounds)]
    return subprocess.Popen(line, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


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


def kill_at_random_moments(scene_file, tmp_path, times, seed):
    chance = random.Random(seed)
    folder = tmp_path / "out"
    folder.mkdir()
    left = 0
    for _ in range(times):
        with worker(scene_file, folder, 1000) as process:
            assert process.stdout.readline() == "round\n", process.stderr.read()
            time.sleep(chance.uniform(0, 1.5))
            process.kill()
        left += any(path.name.startswith(".") for path in folder.iterdir())
        check_whole(folder)
    assert command_line.run(["render", scene_file, "--output", str(folder / "a.png")]) == command_line.DONE
    assert command_line.run(["merge", str(folder / "frame.exr")]) == command_line.DONE
    check_whole(folder)
    names = ["a.json", "a.png", "frame.exr", "frame_layer1of2.exr", "frame_layer2of2.exr", "merge.json"]
    assert sorted(path.name for path in folder.iterdir()) == names
    return left


def test_a_kill(scene_file, tmp_path):
    kill_at_random_moments(scene_file, tmp_path, 1, seed=1)


@pytest.mark.fuzz
def test_kills(scene_file, tmp_path):
    assert kill_at_random_moments(scene_file, tmp_path, 20, seed=2)


def test_two_processes_into_one_folder(scene_file, tmp_path):
    """... and the same names."""
    folder = tmp_path / "out"
    folder.mkdir()
    both = [worker(scene_file, folder, 8) for _ in range(2)]
    for process in both:
        _, errors = process.communicate(timeout=300)
        # Each may find layers of the other one, which are the same; all are whole.
        assert process.returncode == 0, errors
    check_whole(folder)
    assert not [path for path in folder.iterdir() if path.name.startswith(".")]
