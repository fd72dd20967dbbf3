# SPDX-License-Identifier: GPL-3.0-or-later
"""A sample plan as images that `camera.osl` reads."""

import numpy as np

from ..blender import openimageio
from ..blender.refusal import Refused
from ..blender.region import bands


def write(plan, path):
    """Write film column and row, then the lens shift, as 16-bit integers.

    Parameters
    ----------
    plan : Plan
    path : str

    Raises
    ------
    Refused
        The folder is not writable, the disk is full.
    """

    def entries(pixels):
        row, column = np.divmod(plan.film[pixels], np.int32(plan.width))
        if plan.lens_shift is None:
            return np.column_stack([column, row, np.zeros((row.size, 2), np.int32)])
        # A shift by 1 may come out as 65535 / 65535; modulo 1 that is the same as none.
        return np.column_stack([column, row, np.rint(65535.0 * plan.lens_shift[pixels])])

    _write(plan, path, 4, entries)


def write_positions(plan, path, positions):
    """Write where in its film pixel each render pixel's sample lies.

    Parameters
    ----------
    plan : Plan
    path : str
    positions : uint16 array, shape (2, pixels)
        Of `reconstruction.positions`, at each render pixel.

    Raises
    ------
    Refused
        The folder is not writable, the disk is full.
    """

    def entries(pixels):
        where = positions[:, pixels]
        return np.column_stack([*where, np.zeros(where.shape[1], np.uint16)])

    _write(plan, path, 3, entries)


def _write(plan, path, channels, entries):
    """Write an image band by band; `entries` of a slice of pixels are (pixels, channels)."""
    height = plan.film.size // plan.width
    oiio = openimageio.load()
    spec = oiio.ImageSpec(plan.width, height, channels, "uint16")
    spec.attribute("compression", "none")
    output = oiio.ImageOutput.create(path)
    written = bool(output) and output.open(path, spec)
    for band in bands(height):
        part = entries(slice(band.start * plan.width, band.stop * plan.width)).astype(np.uint16)
        part = part.reshape(-1, plan.width, channels)
        written = written and output.write_scanlines(band.start, band.stop, 0, part)
    if not (written and output.close()):
        raise Refused(f"Cannot write the sample plan to {path}: {output.geterror() if output else oiio.geterror()}")
