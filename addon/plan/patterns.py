# SPDX-License-Identifier: GPL-3.0-or-later
"""The patterns a scene can choose from: the tiles shipped in `tiles/`, and a file of the user's."""

import functools
import os
import zlib

from ..blender.refusal import Refused

try:  # as an extension, where the generator is a package beside this one
    from ... import generator
    from ...generator import atomic_file, messages
    from ...generator import cli as generator_cli
    from ...generator.library import PROFILES, covering
except ImportError:  # from a checkout, where `addon` and `generator` are top-level packages
    import generator
    from generator import atomic_file, messages
    from generator import cli as generator_cli
    from generator.library import PROFILES, covering

__all__ = [
    "ITEMS",
    "PROFILES",
    "atomic_file",
    "generator",
    "generator_cli",
    "messages",
    "tile",
]

_FOLDER = os.path.join(os.path.dirname(os.path.dirname(__file__)), "tiles")


def _number(name):
    """What a .blend file stores for a shipped tile: the same whichever other tiles come or go."""
    return zlib.crc32(name.encode()) >> 1


ITEMS = (
    (
        "AUTO",
        "Automatic",
        "Cycles' own samples, arranged for what the scene uses where that helps; the best choice for pictures",
        0,
    ),
    ("SPECTRAL", "Spectral", "The shipped spectral tile that is made for what the scene uses", 2),
    *(
        (name.upper(), name.replace("_", " ").capitalize(), f"Tile {name}, shipped with Spectral Tiles", _number(name))
        for name in sorted(file.removesuffix(".npz") for file in os.listdir(_FOLDER) if file.endswith(".npz"))
    ),
    ("FILE", "File…", "A tile of your own", 1),
)


def tile(name, path="", dims=PROFILES["full"]):
    """The tile that a pattern is made of, or None for the automatic one.

    Parameters
    ----------
    name : str
        Identifier out of `ITEMS`.
    path : str
        Of the tile file, if that is FILE; absolute.
    dims : tuple of str
        Dimensions that the scene uses (`SceneUse.dims`).

    Raises
    ------
    Refused
        No such file, or not a tile.
    """
    if name == "AUTO":
        return None
    if name == "FILE":
        if not path:
            raise Refused("No pattern file is set; choose one under Sampling > Spectral Tiles > Advanced")
        return _read(path)
    shipped = os.path.join("spectral", covering(dims).name) if name == "SPECTRAL" else name.lower()
    return _read(os.path.join(_FOLDER, shipped + ".npz"))


def _read(path):
    try:
        return _load(path, os.stat(path).st_mtime_ns)
    except OSError as error:
        raise Refused(f"Cannot use the pattern {path}: {error.strerror or error}") from error
    except ValueError as error:
        raise Refused(f"Cannot use the pattern {path}: {str(error).removeprefix(path + ': ')}") from error


@functools.lru_cache(maxsize=4)
def _load(path, _modified):
    return generator.load_tile(path)
