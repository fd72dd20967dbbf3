"""Tile files: ``.npz``, the native format, ``.exr`` through `generator.exr`, and plain arrays of other programs."""

import json
import zipfile
import zlib
from pathlib import Path

import numpy as np

from . import exr
from .atomic_file import check_writable, replacing
from .tile import FORMAT_VERSION, Tile

IMPORTED = {"method": "imported"}
"""Metadata of tiles that other programs wrote."""


def check_path(path):
    """Return `path` as a Path if a tile can be written there, as far as can be told before the work is done.

    Raises
    ------
    ValueError
        If the name does not end in ``.npz`` or ``.exr``, or there is no module that writes EXR images.
    OSError
        If there is no such folder, or the path is a folder itself.
    """
    path = _with_known_suffix(path)
    if path.suffix.lower() == ".exr":
        exr.open_image_io()
    check_writable(path)
    return path


def _with_known_suffix(path):
    path = Path(path)
    if path.suffix.lower() not in (".npz", ".exr"):
        raise ValueError(f"{path}: expected a file name ending in .npz or .exr")
    return path


def save_tile(tile, path):
    """Write a tile to `path`; an interrupted write leaves what was there before.

    Parameters
    ----------
    tile : Tile
    path : str or Path
        Ending in ``.npz`` or ``.exr``.

    Raises
    ------
    ValueError
        If the ending is another one.
    OSError
        If the file cannot be written.
    """
    path = check_path(path)
    metadata = json.dumps(dict(tile.metadata), sort_keys=True)
    with replacing(path) as temporary:
        if path.suffix.lower() == ".exr":
            exr.write(temporary, tile.dims, tile.values, metadata)
        else:
            np.savez_compressed(temporary, values=tile.values, dims=np.array(tile.dims), metadata=np.array(metadata))


def _read_npz(path):
    """Return (dims, values, metadata as JSON text) of an ``.npz`` file."""
    if not zipfile.is_zipfile(path):
        raise ValueError(f"{path}: expected a tile, got a truncated file or one that is no .npz archive")
    try:
        with np.load(path, allow_pickle=False) as archive:
            arrays = {name: archive[name] for name in ("values", "dims", "metadata") if name in archive}
    except (ValueError, zipfile.BadZipFile, zlib.error, EOFError) as error:
        raise ValueError(f"{path}: expected a tile, got a damaged file ({error})") from error
    missing = {"values", "dims"} - set(arrays)
    if missing:
        raise ValueError(f"{path}: expected a tile, got an archive without {', '.join(sorted(missing))}")
    dims = tuple(str(name) for name in np.atleast_1d(arrays["dims"]))
    return dims, arrays["values"], str(arrays.get("metadata", json.dumps(IMPORTED)))


def load_tile(path):
    """Read a tile from an ``.npz`` or ``.exr`` file.

    Returns
    -------
    Tile

    Raises
    ------
    ValueError
        If the file is damaged, is not a tile, is of a later format, or holds values outside [0, 1).
    OSError
        If the file cannot be read, such as FileNotFoundError.
    """
    path = _with_known_suffix(path)
    if not path.is_file():
        raise FileNotFoundError(f"{path}: no such file")
    dims, values, text = exr.read(path) if path.suffix.lower() == ".exr" else _read_npz(path)
    try:
        metadata = json.loads(text)
    except json.JSONDecodeError as error:
        raise ValueError(f"{path}: expected metadata in JSON, got {text[:40]!r}") from error
    if not isinstance(metadata, dict):
        raise ValueError(f"{path}: expected metadata as a JSON object, got {text[:40]!r}")
    version = metadata.get("format_version", FORMAT_VERSION)
    if not isinstance(version, int) or version > FORMAT_VERSION:
        raise ValueError(f"{path}: expected format version {FORMAT_VERSION} or earlier, got {version!r}")
    try:
        return Tile(dims, values, metadata)
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from error


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
    try:
        values = np.load(path, allow_pickle=False)
        if not isinstance(values, np.ndarray):
            raise ValueError("expected one array, got an archive of several")
        return Tile(dims, values[:, :, None] if values.ndim == 3 else values, IMPORTED)
    except (ValueError, EOFError) as error:
        raise ValueError(f"{path}: {error}") from error
