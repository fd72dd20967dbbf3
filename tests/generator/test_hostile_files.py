# SPDX-License-Identifier: GPL-3.0-or-later
"""Any damaged or hostile file ends in one line, at once, with little memory, and nothing else is touched."""

import functools
import io
import time
import tracemalloc

import numpy as np
import pytest

from generator import array_file, cli, load_tile, tile_file
from tests import effort

from . import hostile_files

MEMORY = 100e6
SECONDS = 1.0

TRIALS = 140
"""Random damages of each kind of file in the default run."""


@pytest.fixture(scope="module")
def sound(tmp_path_factory):
    return hostile_files.sound_files(tmp_path_factory.mktemp("sound"))


def judge(path, capsys, harmless=False):
    """Compare a file with nothing, into an old table, and see that all ends well; return whether it was read."""
    table = path.with_name("old.md")
    table.write_text("old")
    before = path.read_bytes()
    arguments = ["compare", str(path), "--functions", "1", "--sigmas", "1", "--dims", "t,light.u,light.v"]
    with effort.within(SECONDS, MEMORY + len(before)):
        code = cli.main([*arguments, "--out", str(table)])
    printed, said = capsys.readouterr()
    assert not printed
    assert path.read_bytes() == before
    assert sorted(entry.name for entry in path.parent.iterdir()) == sorted([path.name, table.name])
    if code == 0:
        assert harmless and not said
        return True
    assert code == 2 and table.read_text() == "old"
    assert said.endswith("\n") and len(said) <= 201 and said[:-1].isprintable(), said
    assert said.startswith("generator: ") and path.name in said and "report" not in said, said
    return False


def damage(name, sound, seeds, folder, capsys):
    """Judge random damages of a file; what is still read must be the same values."""
    path = folder / name
    for seed in seeds:
        data = hostile_files.damaged(sound[name], seed)
        path.write_bytes(data)
        if judge(path, capsys, harmless=True) and path.suffix == ".npz":
            tile = load_tile(path)
            assert np.array_equal(tile.values, hostile_files.tile().values), seed


@pytest.mark.parametrize("name", ["packed.npz", "stored.npz", "image.exr", "array.npy"])
def test_random_damage(name, sound, tmp_path, capsys):
    damage(name, sound, range(TRIALS), tmp_path, capsys)


@pytest.mark.fuzz
@pytest.mark.parametrize("name", ["packed.npz", "stored.npz", "image.exr", "array.npy"])
def test_much_random_damage(name, sound, tmp_path, capsys):
    damage(name, sound, range(TRIALS, 3000), tmp_path, capsys)


LIES = {"npz": hostile_files.npz_lies, "npy": hostile_files.npy_lies, "exr": hostile_files.exr_lies}


@functools.cache
def lies(ending):
    """A list of names and bytes."""
    return list(LIES[ending]())


@pytest.mark.parametrize("ending", LIES)
def test_lies(ending, tmp_path, capsys):
    path = tmp_path / f"lie.{ending}"
    for name, data in lies(ending):
        path.write_bytes(data)
        try:
            judge(path, capsys)
        except AssertionError as error:
            raise AssertionError(f"{name}: {error}") from error


def test_there_are_enough_of_them(sound):
    assert len(sound) * TRIALS + sum(len(lies(ending)) for ending in LIES) >= 500


@pytest.mark.parametrize("name", ["packed.npz", "stored.npz", "image.exr"])
def test_the_sound_files_are_read(name, sound, tmp_path):
    (tmp_path / name).write_bytes(sound[name])
    again, tile = load_tile(tmp_path / name), hostile_files.tile()
    assert np.array_equal(again.columns(*tile.dims), tile.values)
    assert again.metadata["seed"] == 5


def test_what_numpy_writes_in_other_ways_is_read(tmp_path):
    values = np.random.default_rng(1).random((8, 8, 2, 1))
    values = values.astype(np.float16).astype(np.float64).clip(0, 0.99)
    for kind in ("<f2", ">f2", "<f4", ">f4", "<f8", ">f8"):
        expected = values.astype(kind).astype(np.float32)
        np.savez(tmp_path / "a.npz", values=np.asfortranarray(values.astype(kind)), dims=np.array([b"t"]), other=1)
        assert np.array_equal(load_tile(tmp_path / "a.npz").values, expected)
        np.savez_compressed(tmp_path / "a.npz", values=values.astype(kind), dims=np.array(["t"], ">U9"))
        assert np.array_equal(load_tile(tmp_path / "a.npz").values, expected)
        np.save(tmp_path / "a.npy", values[:, :, 0].astype(kind))
        assert np.array_equal(tile_file.load_array(tmp_path / "a.npy", ["t"]).values, expected[:, :, :1])


def test_strange_words_in_metadata_are_shown_harmlessly(tmp_path, capsys):
    metadata = '{"a\\nb": "\\u001b[31m\\ud800\\r", "long": "%s", "n": [NaN, {}]}' % ("x" * 5000)
    np.savez(tmp_path / "a.npz", values=np.zeros((4, 4, 1, 1), "f4"), dims=["t"], metadata=metadata)
    assert cli.main(["info", str(tmp_path / "a.npz")]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == 6 and all(line.isprintable() and len(line) < 1100 for line in lines)
    assert cli.main(["info", str(tmp_path / "a.npz"), "--json", "-"]) == 0


def test_the_largest_tile_is_read_in_a_second(tmp_path):
    """16 million numbers; the archive is small because they are all the same."""
    np.savez_compressed(tmp_path / "a.npz", values=np.full((4096, 4096, 1, 1), 0.5, "f4"), dims=["t"])
    tracemalloc.start()
    start = time.process_time()
    tile = load_tile(tmp_path / "a.npz")
    assert time.process_time() - start < 1 and tracemalloc.get_traced_memory()[1] < tile.values.nbytes + MEMORY
    tracemalloc.stop()


@pytest.mark.parametrize("kind", ["<f8", ">f8"])
def test_numbers_take_no_memory_twice_in_either_byte_order(kind):
    values = np.full((512, 512), 0.25, kind)
    file = io.BytesIO()
    np.save(file, values)
    size = file.tell()
    file.seek(0)
    tracemalloc.start()
    found = array_file.read_numbers(file, size, lambda shape: None)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert np.array_equal(found, values) and found.dtype.isnative
    assert peak < 1.6 * values.nbytes
