"""The shipped library: its recipes, and that an interrupted making goes on."""

import pytest

from generator import library, load_tile


@pytest.fixture
def small(monkeypatch):
    monkeypatch.setattr(library, "SIZE", 8)
    monkeypatch.setattr(library, "STEPS", {1: 3, 4: 3, 16: 3})


def test_every_recipe_makes_the_tile_it_names(small, tmp_path):
    library.make_library(tmp_path, say=lambda line: None)
    for recipe in library.RECIPES:
        tile = load_tile(tmp_path / f"{recipe.name}.npz")
        assert tile.dims == library.PROFILES[recipe.profile] and tile.samples == recipe.samples


def test_what_is_there_is_kept_and_the_rest_is_made(small, tmp_path):
    said = []
    library.make_library(tmp_path, only=["lens-1"], say=said.append)
    kept = (tmp_path / "lens-1.npz").stat().st_mtime_ns
    (tmp_path / "motion-1.npz").write_text("half a file")
    reported = []
    library.make_library(
        tmp_path, ["lens-1", "motion-1"], progress=lambda *numbers: reported.append(numbers), say=said.append
    )
    assert (tmp_path / "lens-1.npz").stat().st_mtime_ns == kept and "lens-1: is there" in said
    assert load_tile(tmp_path / "motion-1.npz").dims == ("t",)
    assert reported == [(1, 3), (2, 3), (3, 3)]


def test_unknown_names_are_refused(tmp_path):
    with pytest.raises(ValueError, match="'sound-1'"):
        library.make_library(tmp_path, only=["sound-1"])


def test_the_library_is_small_enough():
    """Raw size; the files are compressed."""
    values = sum(library.SIZE**2 * r.samples * len(library.PROFILES[r.profile]) for r in library.RECIPES)
    assert 4 * values < 10e6
