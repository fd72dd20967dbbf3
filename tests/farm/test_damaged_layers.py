# SPDX-License-Identifier: GPL-3.0-or-later
"""Damaged and hostile sets of layers: the frame, or one line that says why not, soon and in little memory."""

import random
import shutil

import bpy
import pytest

from addon.farm import layers, seal
from addon.interface import command_line
from tests import effort, rendering
from tests.farm import damage

COUNT = 3
SAMPLES = 6


@pytest.fixture(scope="module")
def sound(extension, tmp_path_factory):
    """Bytes of the layers of a small frame with passes of every kind, of foreign ones, and of their merge."""
    folder = tmp_path_factory.mktemp("sound")
    scene = rendering.empty_scene(16, 12)
    rendering.add_plane(20, rendering.diffuse())
    rendering.add_light("AREA", 500, (2, 2, 5), size=4.0)
    rendering.add_camera()
    layer = bpy.context.view_layer
    layer.use_pass_z = layer.use_pass_cryptomatte_object = layer.use_pass_diffuse_direct = True
    layer.aovs.add().name = "Rim"
    image = scene.render.image_settings
    image.media_type, image.file_format, image.color_depth = "MULTI_LAYER_IMAGE", "OPEN_EXR_MULTILAYER", "32"
    scene_file = str(folder / "scene.blend")
    bpy.ops.wm.save_as_mainfile(filepath=scene_file)

    def rendered(name, *options, count=COUNT):
        files = []
        for number in range(1, count + 1):
            line = ["render", scene_file, "--output", str(folder / name), "--layer", f"{number}/{count}"]
            assert command_line.run([*line, "--samples", str(SAMPLES), *options]) == command_line.DONE
            files.append((folder / layers.file_of(name, number, count)).read_bytes())
        return files

    made = {"sound": rendered("frame.exr")}
    made["foreign"] = [
        rendered("seed.exr", "--seed", "7")[0],
        rendered("size.exr", "--percentage", "50")[1],
        rendered("halves.exr", count=2)[0],
        *rendered("frame2.exr", "--frames", "2")[1:],
    ]
    assert command_line.run(["merge", str(folder / "frame.exr")]) == command_line.DONE
    made["merged"] = (folder / "frame.exr").read_bytes()
    return made


@pytest.fixture
def merged(tmp_path, sound, capfd):
    """Merge files beside an old picture; return the exit code and the line that was said."""

    def run(files):
        folder = tmp_path / "set"
        folder.mkdir()
        for name, data in files.items():
            (folder / name).write_bytes(data)
        frame = folder / "frame.exr"
        frame.write_bytes(b"old")
        with effort.within(1.0, 100e6):
            code = command_line.run(["merge", str(frame)])
        # Blender and its libraries say nothing either.
        lines = capfd.readouterr().err.splitlines()
        line = " ".join(lines)
        assert code in (command_line.DONE, command_line.FAILED)
        assert len(lines) <= 1 and len(line) <= 200 and line.isprintable() and "report this" not in line, line
        if code == command_line.FAILED:
            assert line.startswith("spectral_tiles: ")
            assert frame.read_bytes() == b"old"
        else:
            assert not line or "without a digest" in line or "plans differ" in line
        assert {path.name for path in folder.iterdir()} == files.keys() | {"frame.exr"}
        assert all((folder / name).read_bytes() == data for name, data in files.items())
        written = frame.read_bytes()
        shutil.rmtree(folder)
        return code, line, written

    return run


def named(files):
    return {f"frame_layer{number}of{len(files)}.exr": data for number, data in enumerate(files, 1)}


def damaged_set(sound, chance):
    """Files of a set in which something is wrong, whether that must be found, and what it is."""
    files = [bytearray(data) for data in sound["sound"]]
    one = chance.randrange(COUNT)
    kind = chance.choice(("flip", "flip", "damage", "foreign", "twice", "missing", "name", "open", "sealed", "swap"))
    must = kind not in ("open", "sealed", "swap")
    if kind == "flip":
        damage.flip(files[one], chance, chance.choice((None, 4000)))
    elif kind == "damage":
        chance.choice(damage.DAMAGES)(files[one], chance)
    elif kind == "foreign":
        files[one] = chance.choice(sound["foreign"])
    elif kind == "twice":
        files[one] = files[one - 1]
    elif kind in ("open", "sealed"):  # as Blender left it; damage that was there before the seal
        files[one] = damage.unsealed(files[one])
        chance.choice(damage.DAMAGES)(files[one], chance)
    elif kind == "swap":
        chance.shuffle(files)
    found = named(files)
    if kind == "missing":
        del found[layers.file_of("frame.exr", one + 1, COUNT)]
    elif kind == "name":
        names = ("frame_layer1of10000000.exr", "frame_layer4of3.exr", "frame_layer999999999of3.exr")
        found[chance.choice(names)] = files[one]
    is_same = found == named(sound["sound"])
    return found, must and not is_same, kind


def _try(sound, merged, tmp_path, seed):
    chance = random.Random(seed)
    files, must, kind = damaged_set(sound, chance)
    if kind == "sealed":
        for name in files:
            (tmp_path / "sealed").write_bytes(files[name])
            seal.seal(tmp_path / "sealed")
            files[name] = (tmp_path / "sealed").read_bytes()
    code, line, written = merged(files)
    if must:
        assert code == command_line.FAILED, (seed, kind)
    if kind == "swap":
        assert (code, written) == (command_line.DONE, sound["merged"])
    return kind, code, line


def test_damaged_sets(sound, merged, tmp_path):
    seen = {_try(sound, merged, tmp_path, seed)[:2] for seed in range(300)}
    assert len({kind for kind, _ in seen}) == 9


@pytest.mark.fuzz
def test_many_damaged_sets(sound, merged, tmp_path):
    for seed in range(1000, 3000):
        _try(sound, merged, tmp_path, seed)


def test_every_changed_byte_of_a_header_is_found(sound, merged):
    data = sound["sound"][1]
    for place in range(0, min(len(data), 6000), 41):
        changed = bytearray(data)
        changed[place] ^= 1 << (place // 41) % 8
        code, line, _ = merged(named([sound["sound"][0], changed, sound["sound"][2]]))
        assert code == command_line.FAILED and "frame_layer2of3.exr" in line, (place, line)


LIES = {
    "hold the same samples": [{"subset": "1 2"}, {"subset": "0 2"}],
    "No layer holds samples 3 to 3 of 6": [{"subset": "3 1"}],
    "No layer holds samples 4 to 4 of 6": [{"subset": "2 1"}],
    "its header has samples 3 to 8, but the frame has 6": [{"subset": "2 6"}],
    "its header has samples 5 to 4": [{"subset": "4 0"}],
    "for subset": [{"subset": value} for value in ("2", "2 -2", "2 2 2", "", "x y", "2 99999999999", None)],
    "for samples": [{"samples": value} for value in ("", "-6", "6.0", "٦", None)],
    "the frame has 0": [{"samples": "0"}],
    "samples": [{"samples": "7"}, {"samples": "9999999999"}],
    "seed": [{"seed": "1"}, {"seed": "x"}, {"seed": None}],
    "frame": [{"frame": "2"}, {"frame": "1e9"}],
    "format": [{"format": "1"}],
    "another version": [{"format": None}],
    "blender": [{"blender": "5.3.0"}, {"blender": "x" * 4000}],
    "plan.ViewLayer": [{"plan.ViewLayer": "x"}, {"plan.ViewLayer": None}],
    "aovs.ViewLayer": [{"aovs.ViewLayer": value} for value in ("x", "[]", '{"Rim": "x"}', "[" * 100000, "{}", None)],
    "damaged": [{"samples": 6}, {"subset": 2.0}],
    "sub_frames": [{"sub_frames": "8"}, {"sub_frames": "-1"}, {"sub_frames": None}],
    "differ in": [{"something": "else"}, {"pattern": "GATHER"}],
}


@pytest.mark.parametrize(("said", "facts"), [(said, one) for said, group in LIES.items() for one in group])
def test_lies_in_a_header_are_named(sound, merged, tmp_path, said, facts):
    source = tmp_path / "source.exr"
    source.write_bytes(sound["sound"][1])
    damage.lie(source, tmp_path / "lie.exr", facts)
    lie = (tmp_path / "lie.exr").read_bytes()
    code, line, _ = merged(named([sound["sound"][0], lie, sound["sound"][2]]))
    assert code == command_line.FAILED and said in line, line
    assert "frame_layer2of3.exr" in line or "No layer" in line


def test_sizes_that_the_file_cannot_hold(sound, merged):
    for name in (b"dataWindow\0box2i\0\x10\0\0\0", b"displayWindow\0box2i\0\x10\0\0\0"):
        for size in (20000, 2**31 - 2, 15):
            data = damage.unsealed(sound["sound"][1])
            start, places = 0, 0
            while (start := data.find(name, start)) >= 0:
                start += len(name)
                data[start + 8 : start + 16] = size.to_bytes(4, "little") * 2
                places += 1
            assert places
            code, line, _ = merged(named([sound["sound"][0], data, sound["sound"][2]]))
            assert code == command_line.FAILED and "frame_layer2of3.exr" in line


@pytest.mark.parametrize(
    "name", ["frame_layer1of0.exr", "frame_layer0of3.exr", "frame_layer01of3.exr", "frame_layer.exr"]
)
def test_names_that_are_no_layers(sound, merged, name):
    code, _, written = merged(named(sound["sound"]) | {name: b"x"})
    assert (code, written) == (command_line.DONE, sound["merged"])


def test_a_layer_is_never_overwritten(sound, tmp_path, capfd):
    for name, data in named(sound["sound"]).items():
        (tmp_path / name).write_bytes(data)
    files = [str(tmp_path / name) for name in named(sound["sound"])]
    assert command_line.run(["merge", files[0], *files]) == command_line.FAILED
    assert "is one of the layers" in capfd.readouterr().err
    assert (tmp_path / files[0]).read_bytes() == sound["sound"][0]
