# SPDX-License-Identifier: GPL-3.0-or-later
"""OpenImageIO as Blender bundles it."""

import importlib
import os
import sys

import bpy
import numpy as np

from .refusal import Refused
from .region import bands


def load():
    """The `OpenImageIO` module that this Blender bundles.

    Blender itself has its bundled site-packages on `sys.path`; with the `bpy` wheel they lie beside the module and
    must be added.  Installing OpenImageIO from PyPI is no way out: a second copy in one process breaks `oslquery`.

    Raises
    ------
    Refused
        The build has none (distribution packages).
    """
    python = f"python{sys.version_info[0]}.{sys.version_info[1]}"
    bundled = os.path.join(bpy.utils.resource_path("LOCAL"), "python", "lib", python, "site-packages")
    if bpy.app.module and os.path.isdir(bundled) and bundled not in sys.path:
        sys.path.append(bundled)
    try:
        return importlib.import_module("OpenImageIO")
    except ImportError as error:
        raise Refused("This build of Blender has no OpenImageIO module, which Spectral Tiles needs") from error


def opened(path):
    """Open a picture.

    Returns
    -------
    image : OpenImageIO.ImageInput
    specs : list of OpenImageIO.ImageSpec
        Of its parts, at least one.

    Raises
    ------
    ValueError
        It cannot be read.
    """
    oiio = load()
    oiio.attribute("openexr:core", 1)  # its reader says only to us what is wrong
    image = oiio.ImageInput.open(os.fsencode(path))
    oiio.attribute("openexr:core", 0)
    if image is None:
        raise ValueError(oiio.geterror())
    specs = []
    while image.seek_subimage(len(specs), 0):
        specs.append(image.spec())
    image.geterror()  # that there are no more parts
    return image, specs


def rows(image, specs, band):
    """Some rows of all parts of an `opened` picture, float32 (rows, width, channels); raises ValueError as that."""
    parts = []
    for index, spec in enumerate(specs):
        start, stop = spec.y + band.start, spec.y + band.stop
        pixels = image.read_scanlines(index, 0, start, stop, 0, 0, spec.nchannels, "float")
        if pixels is None:
            raise ValueError(image.geterror())
        parts.append(pixels.reshape(stop - start, spec.width, -1))
    return np.concatenate(parts, axis=2)


def check(path):
    """Raise ValueError unless a picture whose parts are of one size can be read to its end."""
    image, specs = opened(path)
    for band in bands(specs[0].height):
        rows(image, specs, band)
