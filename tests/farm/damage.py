# SPDX-License-Identifier: GPL-3.0-or-later
"""Damaged layers: random damage with fixed seeds, and lies in headers that are sealed again."""

import re

from addon.blender import openimageio
from addon.farm import layers, seal

ZEROS = seal.OPEN.encode()


def flip(data, chance, most=None):
    """Change some bits; `most` is the number of bytes at the beginning that are touched."""
    for _ in range(chance.choice((1, 1, 1, 2, 8, 64))):
        data[chance.randrange(min(most or len(data), len(data)))] ^= 1 << chance.randrange(8)


def truncate(data, chance):
    del data[chance.randrange(len(data)) :]


def extreme(data, chance):
    """Overwrite a number in the headers by an extreme one."""
    width = chance.choice((1, 2, 4, 8))
    place = chance.randrange(3000)
    number = chance.choice((0, 1, 2**31 - 1, 2**31, 2**32 - 1, 2**63, 2**64 - 1, 0x7F7F7F7F7F7F7F7F, 0x20))
    data[place : place + width] = (number % 256**width).to_bytes(width, "little")


def move(data, chance):
    """Put a piece of the file somewhere else in it."""
    length = chance.randrange(1, 64)
    start, to = (chance.randrange(len(data) - length) for _ in range(2))
    data[to : to + length] = data[start : start + length]


def wipe(data, chance):
    length = chance.randrange(1, 400)
    start = chance.randrange(len(data))
    stop = min(len(data), start + length)
    data[start:stop] = bytes(stop - start)


DAMAGES = (flip, truncate, extreme, move, wipe)


def unsealed(data):
    """The same file as Blender has written it: without its digest."""
    return bytearray(re.sub(rb"(spectral_tiles\.digest\0string\0@\0\0\0)[0-9a-f]{64}", rb"\g<1>" + ZEROS, bytes(data)))


def lie(path, target, facts):
    """Write a layer again with other facts, and seal it; None removes one."""
    oiio = openimageio.load()
    source = oiio.ImageBuf(str(path))
    parts = []
    for part in range(source.nsubimages):
        image = oiio.ImageBuf(str(path), part, 0)
        image.read(part, 0, True, "float")
        parts.append((oiio.ImageSpec(image.spec()), image.get_pixels("float")))
    for name, value in facts.items():
        if value is None:
            parts[0][0].erase_attribute(layers.PREFIX + name)
        else:
            parts[0][0].attribute(layers.PREFIX + name, value)
    parts[0][0].attribute(seal.NAME, seal.OPEN)
    output = oiio.ImageOutput.create(str(target))
    assert output.open(str(target), tuple(spec for spec, _ in parts))
    for part, (spec, pixels) in enumerate(parts):
        assert not part or output.open(str(target), spec, "AppendSubimage")
        assert output.write_image(pixels)
    assert output.close()
    seal.seal(target)
