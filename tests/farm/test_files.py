# SPDX-License-Identifier: GPL-3.0-or-later
"""What the command line writes is whole or not there at all: full disks, quotas, links, and what may only be read."""

import contextlib
import json
import os
import resource
import subprocess

import bpy
import numpy as np
import pytest

from addon.interface import command_line
from generator import atomic_file
from tests import rendering

ENDINGS = ("png", "jpg", "exr", "tif", "tga", "dpx", "hdr", "bmp", "jp2", "j2c", "webp")


@pytest.fixture
def scene_file(tmp_path):
    """A picture that no format makes small."""
    rendering.empty_scene(200, 150)
    material = rendering.diffuse()
    noise = material.node_tree.nodes.new("ShaderNodeTexWhiteNoise")
    emission = material.node_tree.nodes.new("ShaderNodeEmission")
    material.node_tree.links.new(noise.outputs["Color"], emission.inputs["Color"])
    coordinates = material.node_tree.nodes.new("ShaderNodeTexCoord")
    material.node_tree.links.new(coordinates.outputs["Window"], noise.inputs["Vector"])
    output = next(node for node in material.node_tree.nodes if node.type == "OUTPUT_MATERIAL")
    material.node_tree.links.new(emission.outputs[0], output.inputs["Surface"])
    rendering.add_plane(20, material)
    rendering.add_camera()
    path = tmp_path / "scene.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    return str(path)


@contextlib.contextmanager
def _quota(folder):
    """No file may grow beyond a few kilobytes."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (3000, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


@contextlib.contextmanager
def _full_disk(folder):
    """There is room for a page and names."""
    filler = folder / "filler"
    with open(filler, "wb") as file, contextlib.suppress(OSError):
        while True:
            file.write(bytes(4096))
            file.flush()
    os.truncate(filler, filler.stat().st_size - 4096)
    try:
        yield
    finally:
        filler.unlink()


@pytest.fixture(params=["quota", "full disk"])
def folder_and_limit(request, tmp_path):
    """A folder, and a context in which little can be written to it."""
    folder = tmp_path / "out"
    folder.mkdir()
    if request.param == "quota":
        yield folder, _quota
        return
    mounted = ["mount", "-t", "tmpfs", "-o", "size=1m", "tmpfs", str(folder)]
    if os.geteuid() or subprocess.run(mounted, capture_output=True).returncode:
        pytest.skip("no disk can be mounted here")
    try:
        yield folder, _full_disk
    finally:
        subprocess.run(["umount", "-l", str(folder)], check=True)


def run(*arguments):
    return command_line.run([str(argument) for argument in arguments])


def said(capfd, is_rendered=False):
    """The one line that says what went wrong, and that nobody was told that all is done before."""
    out, err = capfd.readouterr()
    lines = [line for line in err.splitlines() if line.startswith("spectral_tiles: ")]
    assert is_rendered or "openjd_progress: 100" not in out
    assert len(lines) == 1 and len(lines[0]) <= 200 and "report this" not in lines[0], lines
    return lines[0]


def names(folder):
    return sorted(path.name for path in folder.iterdir() if path.name != "filler")


def test_a_picture_that_does_not_fit(scene_file, folder_and_limit, capfd):
    folder, limit = folder_and_limit
    for ending in ENDINGS:
        picture = folder / f"a.{ending}"
        picture.write_bytes(b"old")
        with limit(folder):
            assert run("render", scene_file, "--output", picture) == command_line.FAILED, ending
        said(capfd)
        assert picture.read_bytes() == b"old" and names(folder) == [picture.name]
        assert run("render", scene_file, "--output", picture) == command_line.DONE
        assert picture.stat().st_size > 6000, ending
        capfd.readouterr()
        picture.unlink()


def test_layers_and_a_merge_that_do_not_fit(scene_file, folder_and_limit, capfd):
    folder, limit = folder_and_limit
    frame = folder / "a.exr"
    line = ("render", scene_file, "--output", frame, "--samples", 2, "--percentage", 50, "--layer")
    for layer in ("1/2", "2/2"):
        with limit(folder):
            assert run(*line, layer) == command_line.FAILED
        said(capfd)
        assert run(*line, layer) == command_line.DONE
        capfd.readouterr()
    frame.write_bytes(b"old")
    before = names(folder)
    with limit(folder):
        assert run("merge", frame) == command_line.FAILED
    assert "a.exr: not written" in said(capfd)
    assert frame.read_bytes() == b"old" and names(folder) == before
    assert run("merge", frame) == command_line.DONE


def test_a_comparison_that_does_not_fit(scene_file, folder_and_limit, capfd):
    folder, limit = folder_and_limit
    line = ("compare", scene_file, "--out", folder, "--reference-samples", 1, "--percentage", 50)
    with limit(folder):
        assert run(*line) == command_line.FAILED
    said(capfd)
    assert not names(folder)
    assert run(*line) == command_line.DONE
    assert names(folder) == ["cycles.exr", "cycles.png", "spectral_tiles.exr", "spectral_tiles.png"]


def test_a_summary_that_does_not_fit(scene_file, tmp_path, capfd):
    summary = tmp_path / "a.json"
    summary.write_text("old")
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    write = command_line.generator.write_summary
    with pytest.MonkeyPatch.context() as patch:

        def limited(*arguments):
            resource.setrlimit(resource.RLIMIT_FSIZE, (20, before[1]))
            try:
                write(*arguments)
            finally:
                resource.setrlimit(resource.RLIMIT_FSIZE, before)

        patch.setattr(command_line.generator, "write_summary", limited)
        line = ("render", scene_file, "--output", tmp_path / "a.png", "--percentage", 10, "--json", summary)
        assert run(*line) == command_line.FAILED
    said(capfd, is_rendered=True)
    assert summary.read_text() == "old" and names(tmp_path) == ["a.json", "a.png", "scene.blend"]


@pytest.mark.parametrize("command", ["render", "compare", "merge"])
def test_nothing_is_written_through_links(scene_file, tmp_path, command):
    aim, folder = tmp_path / "aim", tmp_path / "out"
    folder.mkdir()
    aim.write_bytes(b"aim")
    link, summary = folder / ("cycles.png" if command == "compare" else "a.exr"), folder / "a.json"
    line = ["--percentage", 10, "--json", summary]
    if command == "merge":
        for layer in ("1/2", "2/2"):
            assert run("render", scene_file, "--output", link, "--samples", 2, "--layer", layer, *line) == 0
        summary.unlink()
    link.symlink_to(aim)
    summary.symlink_to(aim)
    rest = {"render": [scene_file, "--output", link, *line], "compare": [scene_file, "--out", folder, *line]}
    assert run(command, *rest.get(command, [link, "--json", summary])) == command_line.DONE
    assert aim.read_bytes() == b"aim" and not link.is_symlink() and not summary.is_symlink()
    assert json.loads(summary.read_text())["command"] == command


@pytest.mark.parametrize("command", ["render", "compare"])
def test_what_cannot_be_replaced_is_said_before_rendering(scene_file, tmp_path, capfd, command):
    (tmp_path / "cycles.png").mkdir()
    rest = ["--output", tmp_path / "cycles.png"] if command == "render" else ["--out", tmp_path]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(command_line.picture_files, "render_into", lambda *_: pytest.fail("rendered"))
        assert run(command, scene_file, *rest) == command_line.FAILED
    assert "cycles.png: expected a file, got a folder" in said(capfd)


def test_what_killed_runs_left_is_cleared(scene_file, tmp_path):
    killed = subprocess.Popen(["sleep", "0"])
    killed.wait()
    stem = f"{atomic_file._PREFIX}{atomic_file._machine()}-"
    (tmp_path / f"{stem}{killed.pid}-00000000").mkdir()
    (tmp_path / f"{stem}{killed.pid}-00000000/a.png").write_bytes(b"half")
    (tmp_path / f"{stem}{killed.pid}-00000001.exr").write_bytes(b"half")
    alive = tmp_path / f"{stem}1-00000002"
    alive.mkdir()
    assert run("render", scene_file, "--output", tmp_path / "a.png", "--percentage", 10) == command_line.DONE
    assert names(tmp_path) == [alive.name, "a.png", "scene.blend"]


def test_every_ending_that_blender_writes_works(tmp_path):
    """... as Blender itself lists formats; movies are the only ones that are refused."""
    image = bpy.context.scene.render.image_settings
    formats = {item.identifier for item in image.bl_rna.properties["file_format"].enum_items}
    endings = set()
    for image.media_type in ("IMAGE", "MULTI_LAYER_IMAGE"):
        for made in formats - {"FFMPEG"}:
            for codec in ("JP2", "J2K"):
                with contextlib.suppress(TypeError):  # it is of the other media
                    image.file_format, image.jpeg2k_codec = made, codec
                    endings.add(bpy.context.scene.render.file_extension)
    assert endings | {".jpeg", ".tiff"} == set(command_line.picture_files._FORMATS)


@pytest.mark.parametrize("codec", ["JP2", "J2K"])
def test_jpeg_2000(scene_file, tmp_path, codec):
    image = bpy.context.scene.render.image_settings
    image.file_format, image.jpeg2k_codec = "JPEG2000", codec
    bpy.ops.wm.save_mainfile()
    for name, begin in (("a.jp2", b"\0\0\0\x0cjP"), ("b.J2C", b"\xff\x4f\xff")):
        assert run("render", scene_file, "--output", tmp_path / name) == command_line.DONE
        assert (tmp_path / name).read_bytes().startswith(begin)
    assert run("render", scene_file, "--output", tmp_path / "c") == command_line.DONE
    assert (tmp_path / f"c{'.jp2' if codec == 'JP2' else '.j2c'}").is_file()


@pytest.fixture
def stereo_file(scene_file):
    bpy.context.scene.render.use_multiview = True
    bpy.context.scene.render.image_settings.views_format = "INDIVIDUAL"
    bpy.ops.wm.save_mainfile()
    return scene_file


@pytest.mark.parametrize(
    ("output", "options", "says"),
    [
        ("a.png", ("--json", "out/a_R.png"), "--json names the picture"),
        ("b.png", (), "b_R.png: expected a file, got a folder"),
        ("n" * 250 + ".png", (), "File name too long"),
        ("a.exr", ("--json", "out/a_layer1of2_L.exr", "--layer", "1/2", "--samples", 2), "--json names the picture"),
        ("c#.png", ("--frames", "1,2", "--json", "out/c2_L.png"), "--json names the picture"),
    ],
)
def test_names_of_views_are_checked_before_rendering(stereo_file, tmp_path, monkeypatch, capfd, output, options, says):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "out/b_R.png").mkdir(parents=True)
    monkeypatch.setattr(command_line.picture_files, "render_into", lambda *_: pytest.fail("rendered"))
    assert run("render", stereo_file, "--output", f"out/{output}", *options) == command_line.FAILED
    assert says in said(capfd) and names(tmp_path / "out") == ["b_R.png"]


def test_views_in_folders_with_long_paths(stereo_file, tmp_path, capfd):
    """Blender cuts off names of views that become too long; ours are whole, or told and none."""
    codes = set()
    for length in (900, *range(960, 1012, 3)):
        path = str(tmp_path) + 4 * f"/{180 * 'd'}"
        folder = tmp_path / f"{path}/{(length - len(path) - 1) * 'e'}"
        capfd.readouterr()
        codes.add(code := run("render", stereo_file, "--output", folder / "a.png", "--percentage", 10))
        assert names(folder) == ([] if code else ["a_L.png", "a_R.png"]), length
        assert not code or "takes no path" in said(capfd)
    assert codes == {command_line.DONE, command_line.FAILED}


def test_views_are_replaced_together(stereo_file, tmp_path, capfd):
    """None, if one cannot be."""
    render_into = command_line.picture_files.render_into
    with pytest.MonkeyPatch.context() as patch:

        def in_the_way(scene, path):
            render_into(scene, path)
            (tmp_path / "a_R.png").mkdir()

        patch.setattr(command_line.picture_files, "render_into", in_the_way)
        (tmp_path / "a_L.png").write_bytes(b"old")
        assert run("render", stereo_file, "--output", tmp_path / "a.png") == command_line.FAILED
    said(capfd)
    assert (tmp_path / "a_L.png").read_bytes() == b"old"
    assert not [name for name in names(tmp_path) if name.startswith(".")]


def test_braces_and_long_paths(scene_file, tmp_path, capfd):
    folder = tmp_path / "{scene} {}"
    folder.mkdir()
    os.chdir(folder)
    line = ("render", scene_file, "--percentage", 10, "--output")
    assert run(*line, "{{a}}.png") in (command_line.DONE, command_line.FAILED)
    assert not [path for path in folder.iterdir() if path.name.startswith(".")]
    capfd.readouterr()
    assert run(*line, tmp_path / ("x" * 252 + ".png")) == command_line.FAILED
    said(capfd)
    assert run(*line, str(tmp_path) + "/" + "/".join(["y" * 200] * 6) + "/a.png") == command_line.FAILED
    said(capfd)


def test_pictures_are_read_back(scene_file, tmp_path, capfd):
    """Of every format, what a full disk would cut off is missed, and OpenEXR does not say so in lines of its own."""
    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y = 64, 48
    scene.render.resolution_percentage = 100
    image = bpy.data.images.new("noise", 64, 48, float_buffer=True)
    image.pixels.foreach_set(np.random.default_rng(1).random(64 * 48 * 4, dtype=np.float32))
    for ending, made in command_line.picture_files._FORMATS.items():
        if "MULTILAYER" in made:
            made = "OPEN_EXR"
        scene.render.image_settings.media_type = "IMAGE"
        scene.render.image_settings.file_format = made
        scene.render.image_settings.jpeg2k_codec = "J2K" if ending == ".j2c" else "JP2"
        path = tmp_path / f"a{ending}"
        image.save_render(str(path), scene=scene)
        data = path.read_bytes()
        command_line.picture_files.check(str(path), scene.render)
        for size in (0, 20, len(data) // 10, len(data) // 2, len(data) - 200, len(data) - 1):
            path.write_bytes(data[:size])
            with pytest.raises(command_line.Refused, match="could not write all"):
                command_line.picture_files.check(str(path), scene.render)
    assert "EXR_ERR" not in capfd.readouterr().err
