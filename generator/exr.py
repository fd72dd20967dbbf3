"""Tiles as OpenEXR images, one channel a dimension, for exchange with other tools.

Channels bear the dimension's name, ``t`` or ``lens.u``, for the first sample of the pixel, and ``s1.t``,
``s1.lens.u`` and so on for sample 1, 2, .... Values are 32-bit floats. EXR rows run downwards, those of a tile upwards,
so the image is seen in a viewer as the tile lies on the film. The metadata travels as a string attribute.

Read are images of one part in scan lines, without compression or with ZIP or ZIPS: those that keep every bit and that
every program writes. The header is judged before any pixel is looked at. Layout: "OpenEXR File Layout" on openexr.com;
the order of the bytes before ZIP: ``ImfZip.cpp`` of the OpenEXR library.
"""

import os
import re
import struct
import zlib
from dataclasses import dataclass

import numpy as np

from .dimensions import DIMENSIONS
from .messages import quoted
from .tile import LARGEST_SIDE, MOST_SAMPLES, MOST_VALUES, check_shape

_ATTRIBUTE = "spectral_tiles"
_CHANNEL = re.compile(r"(?:s([1-9]\d{0,9})\.)?([a-z.]+)")
_MAGIC = 20000630
_LONG_NAMES = 0x400
_LARGEST_HEADER = 1 << 21
_MOST_ATTRIBUTES = 500
_MOST_CHANNELS = 2 * MOST_SAMPLES * len(DIMENSIONS)
_HIGHEST_RATIO = 1100  # deflate makes a byte of 1032 at most

_TYPES = {0: np.dtype("<u4"), 1: np.dtype("<f2"), 2: np.dtype("<f4")}
_LINES = {0: 1, 2: 1, 3: 16}
"""Lines of a chunk by the compression's number: none, ZIPS, ZIP."""

_COMPRESSIONS = ["none", "RLE", "ZIPS", "ZIP", "PIZ", "PXR24", "B44", "B44A", "DWAA", "DWAB"]


# Writing


def _attribute(name, kind, value):
    return name.encode() + b"\0" + kind.encode() + b"\0" + struct.pack("<i", len(value)) + value


def write(path, dims, values, metadata):
    """Write an image; see the module's description for its layout.

    Parameters
    ----------
    path : Path
    dims : tuple of str
    values : ndarray of float32, shape (T, T, n, D)
    metadata : str
        JSON text in ASCII.
    """
    size, _, samples, count = values.shape
    names = [name if k == 0 else f"s{k}.{name}" for k in range(samples) for name in dims]
    order = sorted(range(len(names)), key=names.__getitem__)  # as every EXR file has its channels
    channels = b"".join(names[i].encode() + b"\0" + struct.pack("<iB3xii", 2, 0, 1, 1) for i in order)
    window = struct.pack("<4i", 0, 0, size - 1, size - 1)
    header = struct.pack("<ii", _MAGIC, 2)
    header += _attribute("channels", "chlist", channels + b"\0")
    header += _attribute("compression", "compression", b"\3")
    header += _attribute("dataWindow", "box2i", window) + _attribute("displayWindow", "box2i", window)
    header += _attribute("lineOrder", "lineOrder", b"\0")
    header += _attribute("pixelAspectRatio", "float", struct.pack("<f", 1))
    header += _attribute("screenWindowCenter", "v2f", struct.pack("<2f", 0, 0))
    header += _attribute("screenWindowWidth", "float", struct.pack("<f", 1))
    header += _attribute(_ATTRIBUTE, "string", metadata.encode("ascii")) + b"\0"
    rows = values[::-1].reshape(size, size, samples * count)
    chunks = []
    for y in range(0, size, _LINES[3]):
        lines = rows[y : y + _LINES[3], :, order].transpose(0, 2, 1)
        data = _packed(np.ascontiguousarray(lines, dtype="<f4").tobytes())
        chunks.append(struct.pack("<ii", y, len(data)) + data)
    first = len(header) + 8 * len(chunks)
    offsets = first + np.cumsum([0, *map(len, chunks[:-1])])
    with open(path, "wb") as file:
        file.write(header + offsets.astype("<u8").tobytes())
        file.writelines(chunks)


def _packed(data):
    """Return a chunk's bytes as ZIP has them: the even ones before the odd ones, each as a difference, deflated."""
    data = np.frombuffer(data, np.uint8)
    apart = np.concatenate([data[::2], data[1::2]])
    apart[1:] = (apart[1:] - apart[:-1]) ^ 0x80
    packed = zlib.compress(apart.tobytes())
    return packed if len(packed) < len(data) else data.tobytes()


# Reading


@dataclass(frozen=True)
class _Header:
    """What is needed of an image's header: channels are (name, numpy type), in the file's order."""

    channels: list
    compression: int
    top: int
    size: int
    metadata: str | None
    length: int


def _until_zero(data, start):
    """Return the text from `start` to the next zero byte, and the position after it."""
    end = data.find(b"\0", start, start + 256)
    if end < 0:
        raise ValueError("expected an EXR image, got a damaged or truncated header")
    return data[start:end].decode("utf-8", errors="replace"), end + 1


def _attributes(data):
    """Return a dict of name to (type, value) and where it ends in the bytes of a file's beginning."""
    found, at = {}, 8
    while data[at : at + 1] != b"\0":
        name, at = _until_zero(data, at)
        kind, at = _until_zero(data, at)
        size = int.from_bytes(data[at : at + 4], "little")
        at += 4
        if at + size >= len(data) or len(found) >= _MOST_ATTRIBUTES or name in found:
            raise ValueError("expected an EXR image, got a damaged or truncated header, or one that is too long")
        found[name] = kind, data[at : at + size]
        at += size
    return found, at + 1


def _channels(data):
    """Return (name, numpy type) of each channel of a channel list."""
    channels, at, taken = [], 0, set()
    while data[at : at + 1] != b"\0":
        name, at = _until_zero(data, at)
        if len(data) < at + 16:
            raise ValueError("expected a list of channels, got a damaged one")
        kind, across, down = struct.unpack("<i4xii", data[at : at + 16])
        at += 16
        if kind not in _TYPES or (across, down) != (1, 1):
            raise ValueError(f"expected channels of one number a pixel, got {quoted(name)} otherwise")
        if name in taken or len(channels) == _MOST_CHANNELS:
            raise ValueError(f"expected at most {_MOST_CHANNELS} channels, each once, got {quoted(name)} as another")
        taken.add(name)
        channels.append((name, _TYPES[kind]))
    return channels


def _read_header(file):
    data = file.read(_LARGEST_HEADER)
    magic, version = struct.unpack("<iI", data[:8].ljust(8, b"\0"))
    if magic != _MAGIC:
        raise ValueError("expected an EXR image, got another or an empty file")
    if version & ~_LONG_NAMES != 2:
        raise ValueError("expected an EXR image of one part in scan lines, got a tiled, deep or multi-part one")
    attributes, length = _attributes(data)
    wanted = {"channels": ("chlist", None), "compression": ("compression", 1), "dataWindow": ("box2i", 16)}
    for name, (kind, size) in wanted.items():
        got = attributes.get(name, ("", b""))
        if got[0] != kind or size not in (None, len(got[1])):
            raise ValueError(f"expected an EXR image, got a header without {name}")
    compression = attributes["compression"][1][0]
    if compression not in _LINES:
        name = _COMPRESSIONS[compression] if compression < len(_COMPRESSIONS) else str(compression)
        raise ValueError(f"expected an EXR image without compression or with ZIP or ZIPS, got {name}")
    left, top, right, bottom = struct.unpack("<4i", attributes["dataWindow"][1])
    width, height = right - left + 1, bottom - top + 1
    if width != height or not 1 <= width <= LARGEST_SIDE:
        raise ValueError(f"expected a square image of at most {LARGEST_SIDE} pixels a side, got {width} x {height}")
    kind, text = attributes.get(_ATTRIBUTE, ("string", None))
    try:
        metadata = None if text is None or kind != "string" else text.decode()
    except UnicodeDecodeError:
        raise ValueError(f"expected text as {_ATTRIBUTE}, got something that is no Unicode") from None
    return _Header(_channels(attributes["channels"][1]), compression, top, width, metadata, length)


def _layout(channels):
    """Return the dims of an image and a dict of channel index to (sample, column)."""
    position = {}
    names = [name for name, _ in channels]
    for index, name in enumerate(names):
        match = _CHANNEL.fullmatch(name)
        if match and match[2] in DIMENSIONS:
            sample = int(match[1] or 0)
            if sample >= MOST_SAMPLES:
                raise ValueError(f"expected at most {MOST_SAMPLES} samples, got the channel {quoted(name)}")
            if channels[index][1].kind != "f":
                raise ValueError(f"expected floating point numbers, got integers in the channel {quoted(name)}")
            position[sample, match[2]] = index
    # OpenEXR sorts channels by name, so the tile's own order is lost: take that of the format.
    dims = tuple(dim for dim in DIMENSIONS if (0, dim) in position)
    if not dims:
        got = quoted(", ".join(names[:20]), 20)
        raise ValueError(f"expected channels out of {', '.join(DIMENSIONS)}, got {got}")
    samples = 1 + max(sample for sample, _ in position)
    wanted = [(sample, dim) for sample in range(samples) for dim in dims]
    for sample, dim in wanted:
        if (sample, dim) not in position:
            raise ValueError(f"expected channel s{sample}.{dim} beside the others, got none")
    if len(position) != len(wanted):
        raise ValueError(f"expected the same dimensions in every sample, got others than {', '.join(dims)}")
    return dims, {position[sample, dim]: (sample, dims.index(dim)) for sample, dim in wanted}


def read(path):
    """Read an image.

    Returns
    -------
    dims : tuple of str
    values : ndarray of float32, shape (T, T, n, D)
    metadata : str or None
        JSON text; None if the image was written by another program.

    Raises
    ------
    ValueError
        If it is not a square image, is damaged, or lacks the named channels. The message does not name the file.
    OSError
        If the file cannot be read.
    """
    with open(path, "rb") as file:
        header = _read_header(file)
        dims, places = _layout(header.channels)
        shape = (header.size, header.size, len(places) // len(dims), len(dims))
        check_shape(shape, len(dims))
        if header.size**2 * len(header.channels) > MOST_VALUES:
            raise ValueError(f"expected at most {MOST_VALUES} numbers, got {len(header.channels)} channels")
        length = os.fstat(file.fileno()).st_size
        line = header.size * sum(kind.itemsize for _, kind in header.channels)
        if line * header.size > _HIGHEST_RATIO * length:
            raise ValueError("expected an EXR image, got a truncated one")
        values = np.empty(shape, np.float32)
        for first, rows in _chunks(file, header, line, length):
            begin = 0
            for index, (_, kind) in enumerate(header.channels):
                end = begin + header.size * kind.itemsize
                if index in places:
                    last = header.size - first
                    channel = np.ascontiguousarray(rows[:, begin:end]).view(kind)
                    values[last - len(rows) : last, :, *places[index]] = channel[::-1]
                begin = end
        return dims, values, header.metadata


def _chunks(file, header, line, length):
    """Yield the first line and the bytes, shape (lines, `line`), of each chunk of a file of `length` bytes."""
    count = _LINES[header.compression]
    starts = range(0, header.size, count)
    file.seek(header.length)
    offsets = np.frombuffer(file.read(8 * len(starts)), "<u8") if length >= header.length + 8 * len(starts) else ()
    if len(offsets) != len(starts):
        raise ValueError("expected an EXR image, got a truncated one")
    for first, offset in zip(starts, map(int, offsets), strict=True):
        wanted = min(count, header.size - first) * line
        if offset + 8 > length:
            raise ValueError("expected an EXR image, got a truncated one")
        file.seek(offset)
        y, size = struct.unpack("<ii", file.read(8))
        if y != header.top + first or not 0 < size <= wanted or offset + 8 + size > length:
            raise ValueError("expected an EXR image, got a damaged or truncated one")
        data = file.read(size)
        if len(data) != size:
            raise ValueError("expected an EXR image, got a truncated one")
        if size < wanted:  # what does not become smaller is stored as it is
            data = _unpacked(data, wanted) if header.compression else b""
        if len(data) != wanted:
            raise ValueError("expected an EXR image, got a damaged one")
        yield first, np.frombuffer(data, np.uint8).reshape(-1, line)


def _unpacked(data, length):
    """Return the bytes that `_packed` was given; not more than `length` are unpacked."""
    unpacker = zlib.decompressobj()
    try:
        apart = np.frombuffer(unpacker.decompress(data, length + 1), np.uint8).copy()
    except zlib.error as error:
        raise ValueError(f"expected an EXR image, got a damaged one ({error})") from error
    if len(apart) != length or not unpacker.eof:
        return b""
    apart[1:] ^= 0x80
    np.cumsum(apart, dtype=np.uint8, out=apart)
    together = np.empty_like(apart)
    half = (length + 1) // 2
    together[::2], together[1::2] = apart[:half], apart[half:]
    return together.tobytes()
