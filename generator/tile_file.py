"""Tile files: ``.npz``, the native format, ``.exr`` through `generator.exr`, and plain arrays of other programs.

Files come from anywhere. What a header says is judged before memory is taken (see `generator.array_file`), and
whatever is wrong with a file ends in one line of at most 180 characters.
"""

import io
import json
import os
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from . import exr
from .array_file import Archive, Damaged, read_numbers, read_words
from .atomic_file import check_writable, written_whole
from .dimensions import DIMENSIONS, check_dims
from .messages import about, quoted
from .tile import FORMAT_VERSION, MOST_VALUES, Tile, check_shape

IMPORTED = {"method": "imported"}
"""Metadata of tiles that other programs wrote."""

LONGEST_METADATA = 1 << 16
"""Characters of a tile's metadata, as JSON."""

DEEPEST_METADATA = 16
"""Objects and lists in one another."""

_LARGEST_VALUES = 8 * MOST_VALUES + 4096
_LARGEST_TEXT = 8 * LONGEST_METADATA


def check_path(path):
    """Return `path` as a Path if a tile can be written there, as far as can be told before the work is done.

    Raises
    ------
    ValueError
        If the name does not end in ``.npz`` or ``.exr``.
    OSError
        If there is no such folder, the path is a folder itself, and so on; see `generator.atomic_file.check_writable`.
    """
    return check_writable(_with_known_suffix(path))


def _with_known_suffix(path):
    if not os.fspath(path).lower().endswith((".npz", ".exr")):
        raise ValueError(about(path, "expected a file name ending in .npz or .exr"))
    return Path(path)


@contextmanager
def _named(path):
    """Turn what is wrong with a file into a ValueError of one line that begins with its name."""
    try:
        yield
    except (ValueError, RecursionError) as error:
        # Without its traceback, which would keep all callers' frames, and by them a render's engine, in a cycle.
        raise ValueError(about(path, error)) from error.with_traceback(None)


def save_tile(tile, path):
    """Write a tile to `path`, whole or not at all; it is read back before it takes the name.

    Parameters
    ----------
    tile : Tile
    path : str or Path
        Ending in ``.npz`` or ``.exr``.

    Raises
    ------
    ValueError
        If the ending is another one, or the metadata is none of a tile file.
    OSError
        If the file cannot be written; what was there before is as it was.
    """
    path = _with_known_suffix(path)
    metadata = json.dumps(dict(tile.metadata), sort_keys=True)
    _metadata(metadata)

    def check(temporary):
        again = load_tile(temporary)
        if not np.array_equal(again.columns(*tile.dims), tile.values):
            raise ValueError("other values")

    with written_whole(path, check) as temporary:
        if path.suffix.lower() == ".exr":
            exr.write(temporary, tile.dims, tile.values, metadata)
        else:
            # In memory first: an archive that cannot be finished complains a second time when it is closed.
            archive = io.BytesIO()
            np.savez_compressed(archive, values=tile.values, dims=np.array(tile.dims), metadata=np.array(metadata))
            temporary.write_bytes(archive.getvalue())


def _read_npz(path):
    """Return (dims, values, metadata as JSON text or None) of an ``.npz`` file."""
    with open(path, "rb") as file:
        archive = Archive(file)
        missing = [name for name in ("dims", "values") if name not in archive]
        if missing:
            raise Damaged(f"expected a tile, got an archive without {', '.join(missing)}")
        dims = check_dims(archive.read("dims", _LARGEST_TEXT, read_words, len(DIMENSIONS), 64))
        metadata = None
        if "metadata" in archive:
            (metadata,) = archive.read("metadata", _LARGEST_TEXT, read_words, 1, LONGEST_METADATA)
        values = archive.read("values", _LARGEST_VALUES, read_numbers, lambda shape: check_shape(shape, len(dims)))
    return dims, values, metadata


def _metadata(text):
    """Return the object that a JSON text of unknown origin stands for."""
    if len(text) > LONGEST_METADATA:
        raise ValueError(f"expected metadata of at most {LONGEST_METADATA} characters, got {len(text)}")
    try:
        metadata = json.loads(text)
    except (ValueError, RecursionError):
        raise ValueError(f"expected metadata in JSON, got {quoted(text)}") from None
    if not isinstance(metadata, dict):
        raise ValueError(f"expected metadata as a JSON object, got {quoted(text)}")
    level = [metadata]
    for _ in range(DEEPEST_METADATA):
        level = [part for whole in level if isinstance(whole, dict | list) for part in _parts(whole)]
    if level:
        raise ValueError(f"expected metadata at most {DEEPEST_METADATA} deep, got {quoted(text)}")
    version = metadata.get("format_version", FORMAT_VERSION)
    if isinstance(version, bool) or not isinstance(version, int) or not 1 <= version <= FORMAT_VERSION:
        raise ValueError(f"expected format version {FORMAT_VERSION} or earlier, got {quoted(version)}")
    return metadata


def _parts(whole):
    return whole.values() if isinstance(whole, dict) else whole


def load_tile(path):
    """Read a tile from an ``.npz`` or ``.exr`` file.

    Returns
    -------
    Tile

    Raises
    ------
    ValueError
        If the file is damaged, is not a tile, is of a later format, is larger than a tile may be, or holds values
        outside [0, 1).
    OSError
        If the file cannot be read, such as FileNotFoundError.
    """
    path = _with_known_suffix(path)
    _check_is_file(path)
    with _named(path):
        dims, values, text = exr.read(path) if path.suffix.lower() == ".exr" else _read_npz(path)
        return Tile(dims, values, IMPORTED if text is None else _metadata(text))


def _check_is_file(path):
    with _named(path):
        found = path.is_file()  # a ValueError if there is a zero character in the name
    if not found:
        raise FileNotFoundError(about(path, "no such file"))


def load_array(path, dims):
    """Read a tile of another program, an array without names.

    Parameters
    ----------
    path : str or Path
        A ``.npy`` file of floating point numbers in [0, 1), shape (T, T, D) or (T, T, n, D), y upwards.
    dims : sequence of str
        Names of the D dimensions.

    Returns
    -------
    Tile

    Raises
    ------
    ValueError
        If the file is damaged, or its values are none of a tile of these dimensions.
    OSError
        If the file cannot be read, such as FileNotFoundError.
    """
    path = Path(path)
    _check_is_file(path)
    with _named(path), open(path, "rb") as file:
        dims = check_dims(dims)

        def check(shape):
            check_shape((*shape[:2], 1, *shape[2:]) if len(shape) == 3 else shape, len(dims))

        values = read_numbers(file, os.fstat(file.fileno()).st_size, check)
        return Tile(dims, values[:, :, None] if values.ndim == 3 else values, IMPORTED)
