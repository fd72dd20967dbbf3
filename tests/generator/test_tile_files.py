"""Tiles survive a round trip through files; bad tiles and bad files are refused with a reason."""

import re
from pathlib import Path

import numpy as np
import pytest

import generator
from generator import Tile, load_tile, save_tile
from generator.atomic_file import written_whole

DIMS = ("light.u", "t", "light.v")


@pytest.fixture
def tile():
    values = np.random.default_rng(3).random((5, 5, 3, 3), dtype=np.float32)
    return Tile(DIMS, values, {"method": "white", "parameters": {"size": 5}, "seed": 3})


def test_npz_round_trip_is_exact(tile, tmp_path):
    save_tile(tile, tmp_path / "a.npz")
    again = load_tile(tmp_path / "a.npz")
    assert again.dims == DIMS
    assert again.values.dtype == np.float32 and again.values.flags.c_contiguous
    assert np.array_equal(again.values, tile.values)
    assert again.metadata == tile.metadata


def test_exr_round_trip_is_exact_by_name(tile, tmp_path):
    save_tile(tile, tmp_path / "a.exr")
    again = load_tile(tmp_path / "a.exr")
    assert np.array_equal(again.columns(*DIMS), tile.values)
    assert again.metadata == tile.metadata


def test_values_cannot_be_changed(tile):
    with pytest.raises(ValueError):
        tile.values[0, 0, 0, 0] = 0.5


@pytest.mark.parametrize(
    ("dims", "values", "expected"),
    [
        ((), np.zeros((4, 4, 1, 0)), "at least one"),
        (("t", "t"), np.zeros((4, 4, 1, 2)), "at most once"),
        (("time",), np.zeros((4, 4, 1, 1)), "'time'"),
        ("t", np.zeros((4, 4, 1, 1)), "sequence"),
        (("t",), np.zeros((4, 5, 1, 1)), r"\(T, T, n, 1\), got \(4, 5, 1, 1\)"),
        (("t",), np.zeros((4, 4, 1, 2)), "shape"),
        (("t",), np.zeros((0, 0, 1, 1)), "shape"),
        (("t",), np.zeros((4, 4, 1, 1), dtype=int), "floating"),
        (("t",), np.full((4, 4, 1, 1), np.nan), "finite numbers, got 16"),
        (("t",), np.full((4, 4, 1, 1), 1.0), r"\[0, 1\)"),
        (("t",), np.full((4, 4, 1, 1), -0.1), r"\[0, 1\)"),
    ],
)
def test_bad_tiles_are_refused(dims, values, expected):
    with pytest.raises(ValueError, match=expected):
        Tile(dims, values)


def test_truncated_files_are_refused(tile, tmp_path):
    for name in ("a.npz", "a.exr"):
        path = tmp_path / name
        save_tile(tile, path)
        content = path.read_bytes()
        path.write_bytes(content[: len(content) // 2])
        with pytest.raises(ValueError, match=name):
            load_tile(path)


def test_files_that_are_no_tiles_are_refused(tile, tmp_path):
    np.savez(tmp_path / "other.npz", a=np.zeros(3))
    with pytest.raises(ValueError, match="without dims, values"):
        load_tile(tmp_path / "other.npz")
    (tmp_path / "text.npz").write_text("hello")
    with pytest.raises(ValueError, match=r"text\.npz"):
        load_tile(tmp_path / "text.npz")
    with pytest.raises(ValueError, match=r"\.npz or \.exr"):
        load_tile(tmp_path / "a.png")
    with pytest.raises(FileNotFoundError):
        load_tile(tmp_path / "missing.npz")
    later = Tile(DIMS, tile.values, {"format_version": 99})
    with pytest.raises(ValueError, match="99"):
        save_tile(later, tmp_path / "later.npz")
    np.savez(tmp_path / "later.npz", values=tile.values, dims=DIMS, metadata='{"format_version": 99}')
    with pytest.raises(ValueError, match="99"):
        load_tile(tmp_path / "later.npz")


def test_exr_without_the_named_channels_is_refused(tile, tmp_path):
    generator.exr.write(tmp_path / "rgb.exr", ("R", "G", "B"), tile.values, "{}")
    with pytest.raises(ValueError, match="expected channels out of t"):
        load_tile(tmp_path / "rgb.exr")


def test_an_interrupted_write_leaves_the_old_file_and_nothing_else(tmp_path):
    path = tmp_path / "a.npz"
    path.write_text("old")
    with pytest.raises(KeyboardInterrupt), written_whole(path) as temporary:
        temporary.write_text("half of the n")
        raise KeyboardInterrupt
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_the_example_of_the_documentation_runs(tmp_path, monkeypatch):
    """Images become a tile with the middles of their levels' strata, turned upside down."""
    pytest.importorskip("bpy")
    from addon.blender import openimageio

    oiio = openimageio.load()
    monkeypatch.chdir(tmp_path)
    levels = np.random.default_rng(4).integers(0, 256, (4, 8, 8, 2), dtype=np.uint8)
    for k in range(4):
        image = oiio.ImageOutput.create(f"texture_{k}.png")
        spec = oiio.ImageSpec(8, 8, 2, "uint8")
        spec.attribute("oiio:UnassociatedAlpha", 1)
        assert image.open(f"texture_{k}.png", spec)
        assert image.write_image(levels[k]) and image.close()
    text = (Path(__file__).parents[2] / "docs/tile_format.md").read_text(encoding="utf-8")
    (example,) = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    exec(example, {})
    tile = load_tile("texture.npz")
    assert tile.dims == ("light.u", "light.v")
    np.testing.assert_allclose(tile.values[::-1].transpose(2, 0, 1, 3), (levels + 0.5) / 256, rtol=1e-6)
