# SPDX-License-Identifier: GPL-3.0-or-later
"""A digest over every byte of an OpenEXR file, in the file's own header, so that a changed bit anywhere is found.

The header has an attribute of 64 zeros when Blender has written the file (`layers.facts`).  They are the place of the
SHA-256 of the file as it is then, which is written over them.  So the picture needs no other writer than Blender's,
and whoever does not know the attribute reads the file as ever.
"""

import hashlib
import re

from ..blender.refusal import Refused
from ..plan.patterns import messages

#: Name of the attribute, and what it holds until the file is sealed.
NAME, OPEN = "spectral_tiles.digest", "0" * 64

# An attribute of OpenEXR: name, type, size, value.
_BEFORE = NAME.encode() + b"\0string\0" + (64).to_bytes(4, "little")
_PLACE = re.compile(re.escape(_BEFORE) + rb"([0-9a-f]{64})")

# Bytes that hold the headers of all parts, and bytes that are read at a time.
_HEADERS, _BLOCK = 2**24, 2**20


def refusal(path, says):
    """`Refused` with a sentence about a file, of which the path is shortened first."""
    says = messages.one_line(says, 120)
    return Refused(f"{messages.one_line(path, messages.LONGEST - 1 - len(says))} {says}")


def seal(path):
    """Write its digest into a file that has a place for it; others stay as they are."""
    with open(path, "r+b") as file:
        digest, places = _digest(file)
        for place, _ in places:
            file.seek(place)
            file.write(digest)


def check(path):
    """Raise `Refused` if a file is not as it was sealed, or none of Spectral Tiles'; return whether it was sealed.

    A file that nobody has sealed passes: one that Blender has rendered by itself, without our command line.
    """
    with open(path, "rb") as file:
        digest, places = _digest(file)
        found = {value for _, value in places}
    if not found:
        raise refusal(path, "is damaged or truncated, or was not rendered with Spectral Tiles: it has no digest")
    if found not in ({digest}, {OPEN.encode()}):
        raise refusal(path, "is damaged or truncated: its digest is another one")
    return OPEN.encode() not in found


def _digest(file):
    """Digest of an open file, and where in it digests are, with those: (place, bytes) each."""
    headers = file.read(_HEADERS)
    places = [(match.start(1), match[1]) for match in _PLACE.finditer(headers)]
    summed = hashlib.sha256(_PLACE.sub(lambda _: _BEFORE + OPEN.encode(), headers))
    while block := file.read(_BLOCK):
        summed.update(block)
    return summed.hexdigest().encode(), places
