"""Sample tiles for distribution ray tracing after Mitchell 1991: designs, optimiser, analysis, files. Knows no Blender.

`Tile` is the noun, `make_tile`, `load_tile` and `save_tile` the verbs; ``python -m generator --help`` the command line.
"""

from .methods import METHODS, make_tile
from .tile import FORMAT_VERSION, GENERATOR_VERSION, Tile
from .tile_file import load_tile, save_tile

__version__ = GENERATOR_VERSION
__all__ = ["FORMAT_VERSION", "GENERATOR_VERSION", "METHODS", "Tile", "load_tile", "make_tile", "save_tile"]
