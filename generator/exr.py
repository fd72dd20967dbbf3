"""Tiles as OpenEXR images, one channel a dimension, for exchange with other tools.

Channels bear the dimension's name, ``t`` or ``lens.u``, for the first sample of the pixel, and ``s1.t``,
``s1.lens.u`` and so on for sample 1, 2, .... Values are 32-bit floats. EXR rows run downwards, those of a tile upwards,
so the image is seen in a viewer as the tile lies on the film. The metadata travels as a string attribute.
"""

import re
import sys
from importlib import import_module
from pathlib import Path

import numpy as np

from .dimensions import DIMENSIONS

_ATTRIBUTE = "spectral_tiles"
_CHANNEL = re.compile(r"(?:s([1-9]\d*)\.)?(.+)")


def open_image_io():
    """Import Blender's own OpenImageIO; raises ValueError if there is none.

    Blender puts it on the path; its wheel on PyPI carries it in a folder that is not. A second copy from PyPI must not
    be installed beside it: both register the same types, and Blender's then fails.
    """
    try:
        return import_module("OpenImageIO")
    except ImportError:
        pass
    for entry in map(Path, sys.path):
        for folder in sorted(entry.glob("bpy/*/python/lib/python3*/site-packages")):
            if (folder / "OpenImageIO").is_dir():
                sys.path.append(str(folder))
                return import_module("OpenImageIO")
    raise ValueError("EXR tiles need the module OpenImageIO, which official Blender builds and bpy's wheel bring along")


def write(path, dims, values, metadata):
    """Write an image; see the module's description for its layout.

    Parameters
    ----------
    path : Path
    dims : tuple of str
    values : ndarray of float32, shape (T, T, n, D)
    metadata : str
        JSON text.
    """
    oiio = open_image_io()
    size, _, samples, count = values.shape
    spec = oiio.ImageSpec(size, size, samples * count, "float")
    spec.channelnames = tuple(name if k == 0 else f"s{k}.{name}" for k in range(samples) for name in dims)
    spec.attribute(_ATTRIBUTE, metadata)
    spec.attribute("compression", "zip")
    output = oiio.ImageOutput.create(str(path))
    if output is None or not output.open(str(path), spec):
        raise OSError(f"{path}: cannot write the image ({oiio.geterror()})")
    pixels = np.ascontiguousarray(values[::-1].reshape(size, size, samples * count))
    written = output.write_image(pixels)
    if not output.close() or not written:
        raise OSError(f"{path}: cannot write the image ({output.geterror()})")


def _layout(path, names):
    """Return (dims, channel index of every (sample, dim)) of an image whose channels are called `names`."""
    position = {}
    for index, name in enumerate(names):
        sample, dim = _CHANNEL.fullmatch(name).groups()
        if dim in DIMENSIONS:
            position[int(sample or 0), dim] = index
    # OpenEXR sorts channels by name, so the tile's own order is lost: take that of the format.
    dims = tuple(dim for dim in DIMENSIONS if (0, dim) in position)
    if not dims:
        raise ValueError(f"{path}: expected channels out of {', '.join(DIMENSIONS)}, got {', '.join(names)}")
    samples = 1 + max(sample for sample, _ in position)
    wanted = [(sample, dim) for sample in range(samples) for dim in dims]
    for key in wanted:
        if key not in position:
            raise ValueError(f"{path}: expected channel s{key[0]}.{key[1]} beside the others, got none")
    if len(position) != len(wanted):
        raise ValueError(f"{path}: expected the same dimensions in every sample, got {', '.join(names)}")
    return dims, [position[key] for key in wanted]


def read(path):
    """Read an image.

    Returns
    -------
    dims : tuple of str
    values : ndarray of float32, shape (T, T, n, D)
    metadata : str
        JSON text; that of an empty object if the image was written by another program.

    Raises
    ------
    ValueError
        If it is not a square image, is truncated, or lacks the named channels.
    """
    oiio = open_image_io()
    image = oiio.ImageInput.open(str(path))
    if image is None:
        raise ValueError(f"{path}: expected an EXR image, got a file that cannot be read ({oiio.geterror()})")
    try:
        spec = image.spec()
        if spec.width != spec.height:
            raise ValueError(f"{path}: expected a square image, got {spec.width} x {spec.height}")
        dims, order = _layout(path, list(spec.channelnames))
        pixels = image.read_image("float")
        if pixels is None:
            raise ValueError(f"{path}: expected an EXR image, got a damaged or truncated one ({image.geterror()})")
        values = pixels[::-1][..., order].reshape(spec.width, spec.width, -1, len(dims))
        return dims, values, spec.get_string_attribute(_ATTRIBUTE) or '{"method": "imported"}'
    finally:
        image.close()
