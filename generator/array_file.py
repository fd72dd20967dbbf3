# SPDX-License-Identifier: GPL-3.0-or-later
"""Arrays in ``.npy`` and ``.npz`` files of unknown origin.

numpy's own reader evaluates a header as Python, takes the memory that it names and unpacks archives of any size. Here
the header is matched word for word and judged before anything else is read, and an array is read only if the file holds
exactly as many bytes as the header says. Pickled objects have no place in the grammar. Format: the description of
`numpy.lib.format`, and PKWARE's APPNOTE 6.3 for archives.
"""

import math
import os
import re
import struct
import zipfile
import zlib
from dataclasses import dataclass

import numpy as np

from .messages import quoted

_LONGEST_HEADER = 1024  # numpy writes 118 bytes for a tile
_LARGEST_DIRECTORY = 1 << 16  # of an archive; numpy writes about 55 bytes an array
_MOST_DIMENSIONS = 8
_HIGHEST_RATIO = 1100  # deflate makes a byte of 1032 at most
_BLOCK = 1 << 20

_ITEM = r"\s*'(?:descr'\s*:\s*'([^'\\]{2,16})'|fortran_order'\s*:\s*(True|False)|shape'\s*:\s*\(([\d\s,]*)\))\s*"
_HEADER = re.compile(r"\s*\{(?:" + _ITEM + r",){2}(?:" + _ITEM + r"),?\s*\}\s*")
_NUMBERS = re.compile(r"[<>=|]f[248]")
_TEXT = re.compile(r"[<>=|]?([US])([1-9]\d{0,9})")
_DAMAGES = (zipfile.BadZipFile, zlib.error, struct.error, EOFError, RuntimeError, OverflowError, IndexError, OSError)
"""What zipfile raises where an archive is damaged; OSError where it is sent to a place before the file's beginning."""


class Damaged(ValueError):
    """A file is not what its name says; the message does not name it."""


@dataclass(frozen=True)
class Header:
    """What a ``.npy`` stream says of itself.

    Attributes
    ----------
    kind : str
        numpy's word for the type, such as ``<f4``.
    fortran_order : bool
    shape : tuple of int
    length : int
        Bytes of the header itself.
    """

    kind: str
    fortran_order: bool
    shape: tuple[int, ...]
    length: int


def _exactly(stream, count):
    """Read `count` bytes, a block at a time, so that no more memory is taken than the stream has data."""
    parts, left = [], count
    while left:
        part = stream.read(min(left, _BLOCK))
        if not part:
            raise Damaged(f"expected {count} more bytes, got {count - left}")
        parts.append(part)
        left -= len(part)
    return b"".join(parts)


def read_header(stream):
    """Read the header of a ``.npy`` stream.

    Returns
    -------
    Header

    Raises
    ------
    Damaged
        If it is none, or longer or stranger than numpy writes them.
    """
    start = _exactly(stream, 8)
    if start[:6] != b"\x93NUMPY" or start[6] not in (1, 2, 3):
        raise Damaged(f"expected an array of numpy's format 1 to 3, got one that begins with {quoted(start)}")
    words = "<H" if start[6] == 1 else "<I"
    (length,) = struct.unpack(words, _exactly(stream, struct.calcsize(words)))
    if length > _LONGEST_HEADER:
        raise Damaged(f"expected a header of at most {_LONGEST_HEADER} bytes, got {length}")
    text = _exactly(stream, length).decode("latin-1")
    found = re.findall(_ITEM, text) if _HEADER.fullmatch(text) else []
    kind, order, shape = (max(column) for column in zip(*found, strict=True)) if found else ("", "", "")
    if not kind or not order or [bool(item[0]) + bool(item[1]) for item in found].count(0) != 1:
        raise Damaged(f"expected descr, fortran_order and shape as the header of an array, got {quoted(text)}")
    sizes = [part.strip() for part in shape.split(",") if part.strip()]
    if len(sizes) > _MOST_DIMENSIONS or not all(size.isdecimal() and len(size) <= 10 for size in sizes):
        raise Damaged(f"expected a shape of at most {_MOST_DIMENSIONS} numbers, got {quoted(shape)}")
    return Header(kind, order == "True", tuple(map(int, sizes)), 8 + struct.calcsize(words) + length)


def read_numbers(stream, size, check_shape):
    """Read an array of floating point numbers.

    Parameters
    ----------
    stream : binary file
    size : int
        Bytes that are in it.
    check_shape : callable
        Is given the shape before memory is taken; raises a ValueError if it is not wanted.

    Returns
    -------
    ndarray
        float16, float32 or float64, of the machine's byte order.

    Raises
    ------
    ValueError
        If it is of another type, of another length than its header says, or refused by `check_shape`.
    """
    header = read_header(stream)
    if not _NUMBERS.fullmatch(header.kind):
        raise Damaged(f"expected floating point numbers of 2, 4 or 8 bytes, got {quoted(header.kind)}")
    check_shape(header.shape)
    kind = np.dtype(header.kind)
    count = math.prod(header.shape)
    _check_length(header, size, count * kind.itemsize)
    values = np.empty(count, kind)
    into = memoryview(values).cast("B")
    for begin in range(0, len(into), _BLOCK):
        part = into[begin : begin + _BLOCK]
        part[:] = _exactly(stream, len(part))
    _check_end(stream)
    if not kind.isnative:  # in place: a copy would take as much again
        values = values.byteswap(inplace=True).view(kind.newbyteorder("="))
    values = values.reshape(header.shape[::-1]).T if header.fortran_order else values.reshape(header.shape)
    return values


def read_words(stream, size, most, longest):
    """Read an array of words, or a single word.

    Parameters
    ----------
    stream : binary file
    size : int
        Bytes that are in it.
    most, longest : int
        Words, and characters of each, that are taken at most.

    Returns
    -------
    list of str

    Raises
    ------
    Damaged
        If it holds anything else.
    """
    header = read_header(stream)
    match = _TEXT.fullmatch(header.kind)
    if not match:
        raise Damaged(f"expected text, got an array of {quoted(header.kind)}")
    count = math.prod(header.shape)
    width = int(match[2])
    if len(header.shape) > 1 or not 1 <= count <= most or width > longest:
        raise Damaged(f"expected at most {most} texts of at most {longest} characters, got {count} of {width}")
    width *= 4 if match[1] == "U" else 1
    _check_length(header, size, count * width)
    data = _exactly(stream, count * width)
    _check_end(stream)
    encoding = "latin-1" if match[1] == "S" else "utf-32-be" if header.kind[0] == ">" else "utf-32-le"
    try:
        return [data[i : i + width].decode(encoding).rstrip("\0") for i in range(0, len(data), width)]
    except UnicodeDecodeError:
        raise Damaged("expected text, got something that is no Unicode") from None


def _check_length(header, size, wanted):
    if size != header.length + wanted:
        raise Damaged(f"expected {wanted} bytes after the header, as it says, got {size - header.length}")


def _check_end(stream):
    """Read on to the end, where an archive compares its checksum."""
    if stream.read(1):
        raise Damaged("expected the end of the array, got more")


class Archive:
    """An ``.npz`` file, of which only the list of its arrays has been read.

    Parameters
    ----------
    file : binary file

    Raises
    ------
    Damaged
        If it is no archive, or not one of those that numpy writes.
    """

    def __init__(self, file):
        self._size = os.fstat(file.fileno()).st_size
        _check_directory(file, self._size)
        try:
            self._archive = zipfile.ZipFile(file)
            entries = self._archive.infolist()
        except (ValueError, *_DAMAGES) as error:
            raise Damaged(f"expected an archive, got a damaged one ({error})") from error
        self._entries = {entry.filename: entry for entry in entries}
        if len(self._entries) < len(entries):
            raise Damaged("expected each array once in the archive, got one twice")

    def __contains__(self, name):
        return f"{name}.npy" in self._entries

    def read(self, name, largest, reader, *arguments):
        """Return ``reader(stream, size, *arguments)`` of one array, see `read_numbers` and `read_words`.

        Parameters
        ----------
        name : str
        largest : int
            Bytes that it may have unpacked.
        reader : callable

        Raises
        ------
        ValueError
            If it is damaged, too large, encrypted, packed in an unknown way, or refused by the reader.
        """
        entry = self._entries[f"{name}.npy"]
        if entry.flag_bits & ~0x080E:  # all but hints for the packer, sizes that follow the data, and names in UTF-8
            raise Damaged(f"expected {name} as it is, got it encrypted or patched")
        if entry.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
            raise Damaged(f"expected {name} stored or deflated, got compression method {entry.compress_type}")
        if entry.file_size > largest:
            raise Damaged(f"expected {name} to unpack to at most {largest} bytes, got {entry.file_size}")
        if entry.compress_size > self._size or entry.file_size > _HIGHEST_RATIO * entry.compress_size:
            raise Damaged(f"expected {name} to unpack to {entry.file_size} bytes, got too little of it")
        try:
            with self._archive.open(entry) as stream:
                return reader(stream, entry.file_size, *arguments)
        except _DAMAGES as error:
            raise Damaged(f"expected {name}, got a damaged archive ({error})") from error


def _check_directory(file, size):
    """Raise Damaged unless the file ends as a plain archive does, with a short directory of what is in it.

    zipfile would make objects of a directory of any length, some hundred times as large as the file.
    """
    file.seek(max(0, size - 42))
    end = file.read(42)
    file.seek(0)
    if size < 22 or end[-22:-18] != b"PK\5\6" or end[-2:] != b"\0\0":
        raise Damaged("expected a tile, got a truncated file or one that is no .npz archive")
    directory = struct.unpack("<I", end[-10:-6])[0]
    if end[:4] == b"PK\6\7" or directory > _LARGEST_DIRECTORY:
        raise Damaged("expected an archive of a few arrays, got one of very many")
