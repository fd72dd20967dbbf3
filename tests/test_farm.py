# SPDX-License-Identifier: GPL-3.0-or-later
"""The farm's job descriptions in docs/farm, run by Open Job Description's runner and compiled as Flamenco does.

`blender` is a stand-in here: a script that hands its command line to the add-on in Blender's Python module.
"""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import bpy
import numpy as np
import pytest

from addon.interface import command_line
from tests import rendering

ROOT = Path(__file__).parents[1]
FARM = ROOT / "docs/farm"

STAND_IN = """#!{python}
import os, sys
sys.path.insert(0, {root!r})
import addon
from addon.interface import command_line
addon.register()
if "DIE" in os.environ:  # when the picture is rendered, but not yet in its place
    os.replace = lambda *paths: os._exit(9)
assert sys.argv[1:3] == ["--command", "spectral_tiles"]
sys.exit(command_line.run(sys.argv[3:]))
"""

# What Flamenco gives a job type's script, and one job; prints the tasks.
FLAMENCO = """
const author = {
    Task: (name, type) => ({
        name, type, commands: [], after: [],
        addCommand(command) { this.commands.push(command); },
        addDependency(task) { this.after.push(task.name); },
    }),
    Command: (name, parameters) => ({ name, parameters }),
};
const frameChunker = (frames, size) => size == 1 ? ["7", "8", "9"] : ["7-8", "9"];
const job = { settings: %s, tasks: [], addTask(task) { this.tasks.push(task); } };
compileJob(job);
console.log(JSON.stringify({ settings: JOB_TYPE.settings, tasks: job.tasks }));
"""


@pytest.fixture
def scene_file(extension, tmp_path):
    scene = rendering.empty_scene(32, 24)
    rendering.add_plane(20, rendering.diffuse())
    rendering.add_light("AREA", 500, (2, 2, 5), size=4.0)
    rendering.add_camera()
    scene.render.image_settings.media_type = "MULTI_LAYER_IMAGE"
    scene.render.image_settings.file_format = "OPEN_EXR_MULTILAYER"
    scene.render.image_settings.color_depth = "32"
    path = tmp_path / "scene.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    return str(path)


@pytest.fixture
def openjd(scene_file, tmp_path):
    """Runner of one of the templates, or of one step or task of it."""
    pytest.importorskip("openjd.cli")
    blender = tmp_path / "blender"
    blender.write_text(STAND_IN.format(python=sys.executable, root=str(ROOT)))
    blender.chmod(0o755)

    def run(template, *options, environment=(), **parameters):
        parameters |= {"SceneFile": scene_file, "Blender": str(blender)}
        given = [item for name, value in parameters.items() for item in ("-p", f"{name}={value}")]
        line = [sys.executable, "-m", "openjd", "run", str(FARM / template), *given, *options]
        return subprocess.run(line, env=os.environ | dict(environment), capture_output=True, text=True, cwd=tmp_path)

    return run


def test_frames(openjd, tmp_path):
    done = openjd("frames.openjd.yaml", Output=tmp_path / "out/frame_###.png", Frames="2")
    assert done.returncode == 0, done.stdout + done.stderr
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["frame_002.png"]
    assert "openjd_progress: 100" in done.stdout


def test_layers_and_a_task_that_dies(openjd, scene_file, tmp_path):
    frame, whole = tmp_path / "frame.exr", tmp_path / "whole.exr"
    job = {"Output": frame, "Samples": 8, "Layers": 2}
    done = openjd("layers.openjd.yaml", **job)
    assert done.returncode == 0, done.stdout + done.stderr
    first = frame.read_bytes()
    assert command_line.run(["render", scene_file, "--samples", "8", "--output", str(whole)]) == command_line.DONE
    merged, expected = (rendering.beauty(rendering.read_exr(path)) for path in (frame, whole))
    np.testing.assert_allclose(merged, expected, rtol=0, atol=4 * np.finfo(np.float32).eps * expected.max())

    second = tmp_path / "frame_layer2of2.exr"
    frame.unlink()
    second.unlink()
    task = ("--step", "Render", "--task-param", "Layer=2")
    assert openjd("layers.openjd.yaml", *task, environment={"DIE": "1"}, **job).returncode != 0
    assert not frame.exists() and not second.exists()
    assert openjd("layers.openjd.yaml", *task, **job).returncode == 0
    assert openjd("layers.openjd.yaml", "--step", "Merge", "--no-run-dependencies", **job).returncode == 0
    assert frame.read_bytes() == first


@pytest.mark.skipif(not shutil.which("node"), reason="Flamenco's job types are JavaScript; there is no node here")
@pytest.mark.parametrize("layers", [1, 2])
def test_flamenco(scene_file, tmp_path, layers):
    settings = {
        "blendfile": scene_file,
        "frames": "7-9",
        "chunk_size": 2,
        "render_output": str(tmp_path / "frame_####.exr"),
        "samples": 4,
        "layers": layers,
    }
    script = tmp_path / "job.js"
    script.write_text((FARM / "spectral_tiles.js").read_text() + FLAMENCO % json.dumps(settings))
    made = json.loads(subprocess.run(["node", script], check=True, capture_output=True, text=True).stdout)
    assert {setting["key"] for setting in made["settings"]} == settings.keys()

    # Run what the workers would run, each task after those it waits for.
    finished = set()
    for task in made["tasks"]:
        assert finished.issuperset(task["after"])
        for step in task["commands"]:
            line = step["parameters"]["args"]
            assert (step["name"], step["parameters"]["exe"]) == ("exec", "{blender}")
            assert line[:2] == ["--command", "spectral_tiles"]
            assert command_line.run(line[2:]) == command_line.DONE
        finished.add(task["name"])
    pictures = {path.name for path in tmp_path.glob("*.exr")}
    assert pictures >= {f"frame_000{frame}.exr" for frame in (7, 8, 9)}
    assert len(pictures) == (3 if layers == 1 else 9)
    assert sum(bool(task["after"]) for task in made["tasks"]) == (0 if layers == 1 else 3)
