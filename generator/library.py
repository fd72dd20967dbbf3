"""The tiles that the add-on ships: what is in the library, and the making of it.

One tile for each set of effects that a scene may use, so that no dimension competes for quality that it does not need.
All have one sample a pixel, since the add-on's drivers follow one: when Cycles' four samples are matched to the means
of a tile of four, the error after a Gaussian of one pixel is larger (t .166, light .324) than with a tile of one
(.086, .292).
"""

from dataclasses import dataclass
from pathlib import Path

from .messages import one_line, quoted
from .methods import make_tile
from .tile import GENERATOR_VERSION
from .tile_file import load_tile, save_tile

SEED = 1991

_LENS, _LIGHT, _BSDF = ("lens.u", "lens.v"), ("light.u", "light.v"), ("bsdf.u", "bsdf.v")
PROFILES = {
    "motion": ("t",),
    "lens": _LENS,
    "light": _LIGHT,
    "lights": (*_LIGHT, "light.pick"),
    "motion-light": ("t", *_LIGHT),
    "motion-lights": ("t", *_LIGHT, "light.pick"),
    "motion-lens": ("t", *_LENS),
    "motion-lens-light": ("t", *_LENS, *_LIGHT),
    "full": ("t", *_LENS, *_LIGHT, "light.pick", *_BSDF),
}
"""Name of a set of effects to its dimensions."""

SIZE = 64
"""Side of the tiles: 128 was no better in the step test (t, one sample: .169 .040 .032 against .165 .040 .031)."""

STEPS = 4000


@dataclass(frozen=True)
class Recipe:
    """Everything that a tile of the library depends on, besides the generator's version."""

    profile: str

    @property
    def name(self):
        return f"{self.profile}-1"

    def make(self, progress=None):
        """Return the tile."""
        return make_tile("spectral", SIZE, PROFILES[self.profile], SEED, progress=progress, steps=STEPS)


RECIPES = [Recipe(profile) for profile in PROFILES]


def covering(dims):
    """Return the recipe of the tile, one sample a pixel, that has all of some dimensions and the fewest others.

    Parameters
    ----------
    dims : sequence of str
        Names that are all in the profile ``full``.

    Returns
    -------
    Recipe
    """
    profiles = [profile for profile, own in PROFILES.items() if set(dims) <= set(own)]
    return Recipe(min(profiles, key=lambda profile: len(PROFILES[profile])))


def is_made(recipe, path):
    """Whether `path` already holds what the recipe would make."""
    try:
        tile = load_tile(path)
    except (OSError, ValueError):
        return False
    parameters = {"size": SIZE, "samples": 1, "steps": STEPS}
    made_as = (tile.dims, tile.metadata.get("parameters"), tile.metadata.get("seed"))
    wanted = (PROFILES[recipe.profile], parameters, SEED)
    return made_as == wanted and tile.metadata["generator_version"] == GENERATOR_VERSION


def make_library(folder, only=None, progress=None, say=print):
    """Make the tiles that are not there yet; an interrupted run goes on where it was.

    Parameters
    ----------
    folder : str or Path
        Is made if it does not exist.
    only : sequence of str, optional
        Names of recipes, such as ``motion-1``; all of them by default.
    progress : callable, optional
        Called as ``progress(done, total)`` with the steps of all tiles together.
    say : callable
        Is given a line for each tile.

    Raises
    ------
    ValueError
        If a name is unknown.
    """
    names = {recipe.name: recipe for recipe in RECIPES}
    for name in only or ():
        if name not in names:
            raise ValueError(f"only: expected names out of {one_line(', '.join(names), 110)}, got {quoted(name)}")
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    wanted = [recipe for recipe in RECIPES if not only or recipe.name in only]
    todo = [recipe for recipe in wanted if not is_made(recipe, folder / f"{recipe.name}.npz")]
    for recipe in wanted:
        if recipe not in todo:
            say(f"{recipe.name}: is there")
    for index, recipe in enumerate(todo):

        def report(done, total, before=index * STEPS):
            progress(before + STEPS * done // total, len(todo) * STEPS)

        path = folder / f"{recipe.name}.npz"
        save_tile(recipe.make(progress and report), path)
        say(f"{recipe.name}: {path.stat().st_size / 1e6:.2f} MB")
