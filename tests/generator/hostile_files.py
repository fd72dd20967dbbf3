# SPDX-License-Identifier: GPL-3.0-or-later
"""Damaged and hostile tile files: random damage with fixed seeds, and every lie about a file that we could think of."""

import io
import json
import random
import struct
import zipfile
import zlib

import numpy as np

from generator import Tile, exr

SIDE = 8


def tile():
    """A small sound tile of two samples."""
    values = np.random.default_rng(5).random((SIDE, SIDE, 2, 3), dtype=np.float32)
    return Tile(("t", "light.u", "light.v"), values, {"method": "white", "seed": 5})


def _saved(save, *arguments, **arrays):
    file = io.BytesIO()
    save(file, *arguments, **arrays)
    return file.getvalue()


def sound_files(folder):
    """Return a dict of name to bytes: the same tile in every kind of file that is read."""
    sound = tile()
    metadata = json.dumps(dict(sound.metadata))
    arrays = {"values": sound.values, "dims": np.array(sound.dims), "metadata": np.array(metadata)}
    exr.write(folder / "sound.exr", sound.dims, sound.values, metadata)
    return {
        "packed.npz": _saved(np.savez_compressed, **arrays),
        "stored.npz": _saved(np.savez, **arrays),
        "image.exr": (folder / "sound.exr").read_bytes(),
        "array.npy": _saved(np.save, sound.values),
    }


def _flip(data, chance):
    for _ in range(chance.choice((1, 1, 1, 2, 8, 64))):
        data[chance.randrange(len(data))] ^= 1 << chance.randrange(8)


def _truncate(data, chance):
    del data[chance.randrange(len(data)) :]


def _extreme(data, chance):
    """Overwrite a number somewhere by an extreme one, as a rule near the beginning or the end."""
    width = chance.choice((1, 2, 4, 8))
    place = chance.choice((chance.randrange(400), chance.randrange(len(data)), len(data) - 1 - chance.randrange(300)))
    number = chance.choice((0, 1, 2**31 - 1, 2**31, 2**32 - 1, 2**63, 2**64 - 1, 0x7F7F7F7F7F7F7F7F, 0x20))
    data[place : place + width] = (number % 256**width).to_bytes(width, "little")


def _remove(data, chance):
    start = chance.randrange(len(data))
    del data[start : start + chance.choice((1, 3, 30))]


def _repeat(data, chance):
    start = chance.randrange(len(data))
    data[start:start] = data[start : start + chance.choice((1, 8, 100, 1000))]


def _overwrite(data, chance):
    start, length = chance.randrange(len(data)), chance.choice((4, 40, 400))
    data[start : start + length] = chance.choice((bytes(length), b"\xff" * length, chance.randbytes(length)))


DAMAGES = (_flip, _truncate, _extreme, _remove, _repeat, _overwrite)


def damaged(data, seed):
    """Return the bytes of a file with random damage of one kind."""
    chance = random.Random(seed)
    data = bytearray(data)
    DAMAGES[seed % len(DAMAGES)](data, chance)
    return bytes(data)


# Lies


def npy(header, data=b"", version=1):
    """An array with the header that is given."""
    header = header if isinstance(header, bytes) else header.encode("latin-1")
    words = "<H" if version == 1 else "<I"
    return b"\x93NUMPY" + bytes([version, 0]) + struct.pack(words, len(header)) + header + data


def described(descr="'<f4'", order="False", shape="(8, 8, 1, 1)"):
    return f"{{'descr': {descr}, 'fortran_order': {order}, 'shape': {shape}, }}\n"


DATA = np.full(64, 0.5, "<f4").tobytes()

HEADERS = {
    "object": described("'|O'"),
    "complex": described("'<c8'"),
    "integers": described("'<i4'"),
    "long double": described("'<f16'"),
    "raw": described("'|V4'"),
    "time": described("'<M8[ns]'"),
    "huge text": described("'<U1000000000'"),
    "fields": described("[('a', '<f4')]"),
    "fields of fields": described("[" * 400 + "'<f4'" + "]" * 400),
    "no such type": described("'<f3'"),
    "no shape": "{'descr': '<f4', 'fortran_order': False}",
    "two shapes": "{'descr': '<f4', 'shape': (8, 8, 1, 1), 'shape': (8, 8, 1, 1)}",
    "more keys": "{'descr': '<f4', 'fortran_order': False, 'shape': (8, 8, 1, 1), 'x': 1}",
    "list": "['descr', 'fortran_order', 'shape']",
    "code": described(shape="(__import__('os').getpid(), 1)"),
    "sum": described(shape="(4 + 4, 8, 1, 1)"),
    "names": described(order="Maybe"),
    "order as a number": described(order="0"),
    "parentheses": "(" * 900,
    "negative": described(shape="(-8, -8, 1, 1)"),
    "zero": described(shape="(8, 8, 0, 1)"),
    "empty": described(shape="()"),
    "flat": described(shape="(64,)"),
    "five": described(shape="(8, 8, 1, 1, 1)"),
    "fifty": described(shape="(" + "1, " * 50 + ")"),
    "oblong": described(shape="(4, 16, 1, 1)"),
    "long ints of Python 2": described(shape="(8L, 8L, 1L, 1L)"),
    "nothing": "",
    "spaces": " " * 1000,
    "too long": described() + " " * 60000,
    "not text": b"\xff\xfe\x00" * 40,
    "line breaks": described("'<f4\n'"),
    "shape of words": described(shape="('a', 'b', 'c', 'd')"),
    "one missing": described(shape="(8, 8, 1, 2)"),
    "one too many": described(shape="(8, 8, 1, 1)").replace("8, 8", "7, 7"),
    **{f"shape of {n}": described(shape=f"({n}, {n}, 1, 1)") for n in (2**12 + 1, 2**16, 2**31, 2**32, 2**63, 10**30)},
    **{f"samples {n}": described(shape=f"(8, 8, {n}, 1)") for n in (1025, 2**31, 2**63 // 256, 10**400)},
    "large, but no data": described(shape="(4096, 4096, 1, 1)"),
}

VALUES = {
    "not a number": np.nan,
    "infinite": np.inf,
    "minus infinite": -np.inf,
    "one": 1.0,
    "negative": -1e-30,
    "large": 3e38,
}


def _archive(method=zipfile.ZIP_DEFLATED, **members):
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", method) as archive:
        for name, data in members.items():
            archive.writestr(f"{name}.npy", data)
    return file.getvalue()


def _npz(values=None, dims=("t",), metadata=None, **more):
    """An archive of three members: bytes as they are, anything else as numpy would write it."""
    members = {"values": np.full((8, 8, 1, 1), 0.5, np.float32) if values is None else values, "dims": dims, **more}
    if metadata is not None:
        members["metadata"] = metadata
    return _archive(**{k: v if isinstance(v, bytes) else _saved(np.save, np.array(v)) for k, v in members.items()})


def _edited(data, change):
    """Change a field of every entry in an archive's directory: (offset, format, number)."""
    data = bytearray(data)
    offset, words, number = change
    at = data.find(b"PK\1\2")
    while at >= 0:
        struct.pack_into(words, data, at + offset, number)
        at = data.find(b"PK\1\2", at + 4)
    return bytes(data)


def _deep(levels, inside="1"):
    return '{"a": ' * levels + inside + "}" * levels


METADATA = {
    "deep list": '{"a": ' + "[" * 60000,
    "deep objects": _deep(5000),
    "rather deep": _deep(40),
    "text": "hello",
    "number": "1",
    "list": "[1]",
    "long": json.dumps({"a": "x" * 70000}),
    "digits": '{"seed": ' + "1" * 5000 + "}",
    **{f"version {text[:9]}": f'{{"format_version": {text}}}'
       for text in ("2", "0", "-1", "true", '"1"', "1e999", "null", "1.5", "[1]", "9" * 4000, "NaN")},
}  # fmt: skip

DIMS = {
    "line break": ["t\nx"],
    "escape": ["\x1b[31mt"],
    "twice": ["t", "t"],
    "unknown": ["speed"],
    "eleven": ["t"] * 11,
    "many": ["t"] * 10000,
    "long": ["t" * 10000],
    "numbers": [1, 2],
    "none": np.array([], "U1"),
    "square": [["t"]],
    "no Unicode": npy(described("'<U1'", shape="(1,)"), b"\xff\xff\xff\xff"),
    "object": npy(described("'|O'", shape="(1,)"), b"\x80\x04K\x01."),
}


def npz_lies():
    """Yield (name, bytes) of archives that are none, or not what they say."""
    for name, header in HEADERS.items():
        yield f"header {name}", _npz(npy(header, DATA))
    for version in (0, 4, 255):
        yield f"version {version}", _npz(npy(described(), DATA, version))
    yield "header of 4 GB", _npz(b"\x93NUMPY\2\0\xff\xff\xff\xff" + DATA)
    yield "objects", _archive(values=_saved(np.save, np.array([{}]), allow_pickle=True), dims=_saved(np.save, ["t"]))
    for name, value in VALUES.items():
        for kind in ("<f4", ">f4", "<f8"):
            values = np.full((8, 8, 1, 1), 0.5, kind)
            values[3, 4] = value
            yield f"values {name} {kind}", _npz(values)
    for name, kind in {"bool": bool, "int": int, "complex": complex, "text": "U3", "bytes": "S3"}.items():
        yield f"type {name}", _npz(np.zeros((8, 8, 1, 1), kind))
    for name, text in METADATA.items():
        yield f"metadata {name}", _npz(metadata=text)
    yield "metadata of two", _npz(metadata=["{}", "{}"])
    yield "metadata of numbers", _npz(metadata=np.zeros(3))
    yield "metadata of bytes", _npz(metadata=npy(described("'|S2'", shape="()"), b"\xff\xfe"))
    for name, dims in DIMS.items():
        yield f"dims {name}", _npz(dims=dims)
    yield "no values", _archive(dims=_saved(np.save, ["t"]))
    yield "no arrays", _archive()
    yield "values unpack to 150 MB", _npz(npy(described("'<f8'", shape="(4096, 4096, 1, 1)"), bytes(150_000_000)))
    yield "dims unpack to 30 MB", _npz(dims=np.full(75000, "t" * 100))
    sound = _npz()
    for method in (1, 6, 9, 12, 14, 93, 95, 97, 99, 0xFFFF):
        yield f"method {method}", _edited(sound, (10, "<H", method))
    yield "bzip2", _archive(zipfile.ZIP_BZIP2, values=npy(described(), DATA), dims=_saved(np.save, ["t"]))
    yield "lzma", _archive(zipfile.ZIP_LZMA, values=npy(described(), DATA), dims=_saved(np.save, ["t"]))
    for flags in (0x1, 0x20, 0x40, 0x2000, 0xFFFF):
        yield f"flags {flags:x}", _edited(sound, (8, "<H", flags))
    for size in (0, 1, 2**31, 2**32 - 2, 2**32 - 1):
        yield f"packed size {size}", _edited(sound, (20, "<I", size))
        yield f"unpacked size {size}", _edited(sound, (24, "<I", size))
        yield f"header at {size}", _edited(sound, (42, "<I", size or 5))
    for length in (1, 7, 9, 65535):
        yield f"name of {length}", _edited(sound, (28, "<H", length))
        yield f"extra of {length}", _edited(sound, (30, "<H", length))
    yield "many entries", _archive(zipfile.ZIP_STORED, **{f"entry {index}": b"" for index in range(3000)})
    yield "a comment", sound[:-2] + b"\5\0hello"
    yield "only an end", b"PK\5\6" + bytes(18)
    yield "a directory too long", sound[:-10] + b"\xff\xff\xff\x7f" + sound[-6:]
    yield "an end of 64 bits", sound[:-22] + b"PK\6\7" + bytes(16) + sound[-22:]
    yield "values twice", _npz(valuez=npy(described(), DATA)).replace(b"valuez.npy", b"values.npy")
    yield "empty", b""
    yield "a folder of another kind", b"Rar!\x1a\7\0" + bytes(100)


def npy_lies():
    """Yield (name, bytes) of plain arrays."""
    for name, header in HEADERS.items():
        yield f"header {name}", npy(header, DATA)
    yield "pickle", b"\x80\x04cos\nsystem\n(S'true'\ntR."
    yield "objects", _saved(np.save, np.array([{}]), allow_pickle=True)
    yield "archive", _npz()
    yield "two arrays", 2 * npy(described(), DATA)


def _attribute(name, kind, value, size=None):
    return name + b"\0" + kind + b"\0" + struct.pack("<i", len(value) if size is None else size) + value


def channel(name, kind=2, sampling=(1, 1)):
    return name + b"\0" + struct.pack("<iB3xii", kind, 0, *sampling)


def image(channels, compression=3, window=(0, 0, 7, 7), version=2, chunks=None, more=b"", changes=None):
    """An EXR image: channels as bytes of `channel`, everything else as it should be unless it is given."""
    attributes = {
        "channels": _attribute(b"channels", b"chlist", b"".join(channels) + b"\0"),
        "compression": _attribute(b"compression", b"compression", bytes([compression])),
        "window": _attribute(b"dataWindow", b"box2i", struct.pack("<4i", *window)),
    } | (changes or {})
    header = struct.pack("<iI", 20000630, version) + b"".join(attributes.values()) + more + b"\0"
    if chunks is None:
        data = zlib.compress(bytes(8 * 8 * 4 * len(channels)))
        chunks = struct.pack("<Qii", len(header) + 8, 0, len(data)) + data
    return header + chunks


def exr_lies():
    """Yield (name, bytes) of images that are none, or not what they say."""
    t = channel(b"t")
    names = [b"s999999999.t", b"s1024.t", b"s4294967296.t", b"s" + b"9" * 200 + b".t", b"s2.t", b"s1.lens.u", b"s-1.u"]
    for name in names:
        yield f"channel {name[:12]}", image([t, channel(name)])
    for name in (b"t\nx", b"\x1b[31m", b"\xff\xfe", b"", b"R", b"T", b"t" * 250, b"t" * 300, b"s0.t", b"s01.t"):
        yield f"alone {name[:8]}", image([channel(name)])
    yield "channels twice", image([t, t])
    yield "no channels", image([])
    yield "20481 channels", image([channel(b"c%d" % index) for index in range(20481)])
    yield "100000 channels", image([channel(b"c%d" % index) for index in range(100000)])
    yield "whole numbers", image([channel(b"t", 0)])
    for kind in (3, -1, 2**31 - 1):
        yield f"type {kind}", image([channel(b"t", kind)])
    for sampling in ((2, 2), (0, 0), (-1, 1)):
        yield f"sampling {sampling}", image([channel(b"t", 2, sampling)])
    largest = 2**31 - 1
    for window in [(0, 0, largest, largest), (-largest, -largest, largest, largest), (7, 7, 0, 0), (0, 0, 7, 8),
                   (0, 0, 4095, 4095), (0, 0, 4096, 4096), (0, 0, -1, -1), (0, 5, 7, 12), (0, 0, 99, 99)]:  # fmt: skip
        yield f"window {window}", image([t], window=window)
    for compression in (1, 4, 5, 6, 7, 8, 9, 10, 255):
        yield f"compression {compression}", image([t], compression)
    for version in (0, 1, 3, 0x202, 0x802, 0x1002, 0x80000002):
        yield f"version {version:x}", image([t], version=version)
    for part in ("channels", "compression", "window"):
        yield f"without {part}", image([t], changes={part: b""})
        yield f"{part} of another type", image([t], changes={part: _attribute(part.encode(), b"string", b"x")})
    for size in (-1, 2**31 - 1, 1 << 20):
        yield f"attribute of {size}", image([t], more=_attribute(b"a", b"string", b"x", size))
    yield "attributes without end", struct.pack("<iI", 20000630, 2) + b"a\0b\0\1\0\0\0c" * 100000
    yield "an attribute twice", image([t], more=2 * _attribute(b"a", b"string", b"x"))
    yield "a list of channels without end", image([t], changes={"channels": _attribute(b"channels", b"chlist", t)})
    yield "a list cut", image([t], changes={"channels": _attribute(b"channels", b"chlist", t[:9])})
    for name, text in METADATA.items():
        yield f"metadata {name}", image([t], more=_attribute(b"spectral_tiles", b"string", text.encode()))
    yield "metadata no Unicode", image([t], more=_attribute(b"spectral_tiles", b"string", b"\xff\xfe"))
    start = len(image([t], chunks=b""))
    packed = zlib.compress(bytes(256))
    for name, offset, y, size, data in [
        ("bomb", start + 8, 0, None, zlib.compress(bytes(200_000))),
        ("too little", start + 8, 0, None, zlib.compress(bytes(200))),
        ("noise", start + 8, 0, None, random.Random(1).randbytes(200)),
        ("another line", start + 8, 1, None, packed),
        ("line -1", start + 8, -1, None, packed),
        ("negative", start + 8, 0, -1, packed),
        ("huge", start + 8, 0, 2**31 - 1, packed),
        ("empty", start + 8, 0, 0, packed),
        ("short of its checksum", start + 8, 0, None, packed[:-2]),
        ("far away", 2**63, 0, None, packed),
        ("at the end", start + 8 + 8 + len(packed) - 4, 0, None, packed),
        ("in the header", 0, 0, None, packed),
        ("ones", start + 8, 0, None, np.ones(64, "<f4").tobytes()),
        ("not a number", start + 8, 0, None, np.full(64, np.nan, "<f4").tobytes()),
    ]:
        head = struct.pack("<Qii", offset, y, len(data) if size is None else size)
        yield f"chunk {name}", image([t], chunks=head + data)
    yield "no chunks", image([t], chunks=b"")
    yield "empty", b""
    yield "a number only", struct.pack("<i", 20000630)
