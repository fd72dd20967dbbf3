"""The shipped library: its recipes, its figures, and that an interrupted making goes on."""

from pathlib import Path

import pytest

from generator import library, load_tile
from generator.step_test import step_test

SHIPPED = Path(__file__).parents[2] / "addon" / "tiles" / "spectral"


@pytest.fixture
def small(monkeypatch):
    monkeypatch.setattr(library, "SIZE", 8)
    monkeypatch.setattr(library, "STEPS", 3)


def test_every_recipe_makes_the_tile_it_names(small, tmp_path):
    library.make_library(tmp_path, say=lambda line: None)
    for recipe in library.RECIPES:
        tile = load_tile(tmp_path / f"{recipe.name}.npz")
        assert tile.dims == library.PROFILES[recipe.profile] and tile.samples == 1


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


def test_the_whole_library_is_there_and_small():
    files = {path.stem: path for path in SHIPPED.glob("*.npz")}
    assert set(files) == {recipe.name for recipe in library.RECIPES}
    assert sum(path.stat().st_size for path in files.values()) < 8e6


@pytest.mark.parametrize("recipe", library.RECIPES, ids=lambda recipe: recipe.name)
def test_shipped_tiles_say_how_to_remake_them(recipe):
    assert library.is_made(recipe, SHIPPED / f"{recipe.name}.npz")


def test_every_cell_of_the_shipped_table_beats_openqmc_and_cycles():
    """The best of OpenQMC's blue-noise samplers and Cycles at sigma = 1, 2, 4, as `docs/tiles.md` has it."""
    best = {
        "t": (0.401, 0.168, 0.058),
        "lens": (0.408, 0.265, 0.134),
        "light": (0.403, 0.251, 0.129),
        "t+lens": (0.487, 0.319, 0.191),
        "t+light": (0.481, 0.377, 0.351),
        "lens+light": (0.506, 0.412, 0.375),
        "all": (0.521, 0.433, 0.369),
    }
    table = step_test(load_tile(SHIPPED / "motion-lens-light-1.npz"), functions=200, seed=5)
    assert table.keys() == best.keys()
    for label, errors in table.items():
        assert (errors < best[label]).all(), label
        assert errors[0] < (0.75 if "+" in label or label == "all" else 0.65) * best[label][0], label


def test_the_smallest_tile_that_covers_a_scene():
    assert library.covering(("t",)).name == "motion-1"
    assert library.covering(("light.u", "light.v")).name == "light-1"
    assert library.covering(("lens.u", "lens.v", "light.u", "light.v")).name == "motion-lens-light-1"
    assert library.covering(("light.pick",)).name == "lights-1"
    assert library.covering(("bsdf.u",)).name == "full-1"
    assert library.covering(()).name == "motion-1"
