# SPDX-License-Identifier: GPL-3.0-or-later
"""The tiles a scene can choose from: those shipped in `tiles/`, and a file of the user's."""

import functools
import os
import zlib

import bpy

from .failure import Refused

try:  # as an extension, where the generator is a package beside this one
    from .. import generator
    from ..generator.library import PROFILES, covering
    from ..generator.periodogram import mode_periodogram
except ImportError:  # from a checkout, where `addon` and `generator` are top-level packages
    import generator
    from generator.library import PROFILES, covering
    from generator.periodogram import mode_periodogram

__all__ = ["ITEMS", "generator", "mode_periodogram", "name", "tile"]

_FOLDER = os.path.join(os.path.dirname(__file__), "tiles")


def _number(name):
    """What a .blend file stores for a shipped tile: the same whichever other tiles come or go."""
    return zlib.crc32(name.encode()) >> 1


ITEMS = (
    (
        "AUTO",
        "Automatic",
        "Arrange the samples of Cycles' own sequence for what the scene uses; the best choice for pictures",
        0,
    ),
    ("SPECTRAL", "Spectral", "The shipped spectral tile that is made for what the scene uses", 2),
    *(
        (name.upper(), name.replace("_", " ").capitalize(), f"Tile {name}, shipped with Spectral Tiles", _number(name))
        for name in sorted(file.removesuffix(".npz") for file in os.listdir(_FOLDER) if file.endswith(".npz"))
    ),
    ("FILE", "File…", "A tile of your own", 1),
)


def tile(settings, library=None, dims=PROFILES["full"]):
    """The tile that the settings name, or None for the automatic arrangement.

    Parameters
    ----------
    settings : properties.SpectralTilesSettings
    library : bpy.types.Library, optional
        Of the scene, for paths relative to it.
    dims : tuple of str
        Dimensions that the scene uses (`analysis.SceneUse.dims`).

    Returns
    -------
    generator.Tile or None

    Raises
    ------
    Refused
        No such file, or not a tile.
    """
    if settings.tile == "AUTO":
        return None
    if settings.tile == "FILE":
        if not settings.tile_path:
            raise Refused("No tile file is set; choose one under Render Properties > Spectral Tiles")
        path = bpy.path.abspath(settings.tile_path, library=library)
    elif settings.tile == "SPECTRAL":
        return spectral(dims)
    else:
        path = os.path.join(_FOLDER, settings.tile.lower() + ".npz")
    return _read(path)


def name(settings, dims):
    """What to call the tile that `tile` returns, such as "full-1" or a file's name; None if it returns none."""
    if settings.tile == "AUTO":
        return None
    if settings.tile == "FILE":
        return bpy.path.basename(settings.tile_path) or None
    return covering(dims).name if settings.tile == "SPECTRAL" else settings.tile.lower()


def spectral(dims):
    """The shipped spectral tile for a scene that uses these dimensions; raises `Refused` if it is damaged."""
    return _read(os.path.join(_FOLDER, "spectral", covering(dims).name + ".npz"))


def _read(path):
    try:
        return _load(path, os.stat(path).st_mtime_ns)
    except OSError as error:
        raise Refused(f"Cannot use the tile {path}: {error.strerror or error}") from error
    except ValueError as error:
        raise Refused(f"Cannot use the tile {path}: {str(error).removeprefix(path + ': ')}") from error


def check(scene, layer):
    """Raise `Refused` if the scene's tile cannot be used."""
    tile(scene.spectral_tiles, scene.library)


@functools.lru_cache(maxsize=4)
def _load(path, _modified):
    return generator.load_tile(path)
