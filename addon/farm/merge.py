# SPDX-License-Identifier: GPL-3.0-or-later
"""The exact merge of the layers of a frame (`layers`) into the picture that one render would have made."""

import os
import re

import numpy as np

from ..blender import openimageio
from ..blender.refusal import Refused
from ..blender.region import bands
from ..cycles.passes import LARGEST_SUM, Kind
from ..picture import cryptomatte
from ..plan.patterns import atomic_file, messages
from . import seal
from .layer_file import LayerFile, check_alike, check_complete
from .layers import PREFIX

# Facts of the layers' own renders, which say nothing about the merged picture.
_OF_ONE_RENDER = re.compile(r"Date|RenderTime|cycles\..*time|openexr:chunkCount|oiio:subimages")

# Layers that stay open: a process may have but some hundred files.
_MOST_OPEN = 64

# Components of a pass of Cryptomatte: two identifiers, each with its coverage.
_RANKS = ("r", "g", "b", "a")

# OpenEXR's compressions that keep every bit.
_LOSSLESS = {"", "none", "rle", "zip", "zips", "piz"}


def merge(files, path, tell=lambda part: None):
    """Merge the layers of a frame; the result does not depend on their order.

    Parameters
    ----------
    files : list of str
        Multilayer EXR files, all of one frame.
    path : str
        The merged picture, which appears complete or not at all.
    tell : callable
        Told which part of it is done, but for writing.

    Returns
    -------
    samples : int
        Samples a pixel of the frame.
    exact : bool
        Whether all layers followed one plan, so that the picture is that of one render.  Machines with another
        processor or other libraries may round a plan's choices differently; the mean is then sound, but not the same.
    sealed : bool
        Whether all layers bear a digest, so that no changed bit is in the picture.

    Raises
    ------
    Refused
        A file is missing, damaged or no layer; they are of different frames, patterns, seeds, sizes or Blender
        versions; samples are missing or in two files.
    OSError
        The picture cannot be written.
    """
    atomic_file.check_writable(path)
    if atomic_file.would_replace(path, *files):
        raise Refused(f"{path} is one of the layers; name another file for the merged picture")
    told = enumerate(_told(files, tell, 0.0, 0.5))
    layers = sorted((LayerFile.read(file, number < _MOST_OPEN) for number, file in told), key=lambda layer: layer.first)
    exact = check_alike(layers)
    check_complete(layers)
    one = layers[0]
    width, height = one.size
    merged = np.empty((height, width, len(one.channels)), np.float32)
    weights = [layer.count / one.samples for layer in layers]
    for band in bands(height):
        told = _told(layers, tell, 0.5 + 0.5 * band.start / height, 0.5 + 0.5 * band.stop / height)
        merged[band] = _mean((layer.rows(band) for layer in told), weights, one)
    _write(path, one, merged)
    return one.samples, exact, all(layer.is_sealed for layer in layers)


def _told(items, tell, begin, end):
    """Yield items one by one, and tell that with the last of them that part is done."""
    for number, item in enumerate(items, 1):
        yield item
        tell(begin + (end - begin) * number / len(items))


def _mean(pictures, weights, layer):
    """Weighted mean of the same rows of all layers, (rows, width, channels), in the order given."""
    total, coverages = 0.0, {}
    cryptomattes = _cryptomattes(layer)
    at_first = [column for column, channel in enumerate(layer.channels) if channel.kind is Kind.FIRST_SAMPLE]
    for number, (weight, picture) in enumerate(zip(weights, pictures, strict=True)):
        if not number:
            seen_first = picture[..., at_first]
        light = picture.astype(np.float64)
        for column, colour in layer.divisors.items():
            light[..., column] *= picture[..., colour]
        total = total + weight * light
        for key, columns in cryptomattes.items():
            coverages[key] = cryptomatte.added(coverages.get(key), picture[..., columns], weight)
    for column, colour in layer.divisors.items():
        seen = total[..., colour] != 0.0
        total[..., column] = np.divide(total[..., column], total[..., colour], out=np.zeros(seen.shape), where=seen)
    averaged = [column for column, channel in enumerate(layer.channels) if channel.kind is Kind.MEAN]
    total[..., averaged] = np.minimum(total[..., averaged], LARGEST_SUM / layer.samples)
    total[..., at_first] = seen_first
    for key, columns in cryptomattes.items():
        total[..., columns] = cryptomatte.ranked(coverages[key], len(columns))
    return total


def _cryptomattes(layer):
    """Columns of the ranks of each Cryptomatte, by its view, view layer and kind."""
    places = {}
    for column, channel in enumerate(layer.channels):
        if channel.kind is Kind.CRYPTOMATTE and channel.component.lower() in _RANKS:
            place = channel.render_pass[-2:], _RANKS.index(channel.component.lower()), column
            places.setdefault((channel.view, channel.layer, channel.render_pass[:-2]), []).append(place)
    if any(len(columns) % 2 for columns in places.values()):
        raise Refused(f"{layer.path} cannot be merged: it has half a rank of Cryptomatte")
    return {key: [column for *_, column in sorted(columns)] for key, columns in places.items()}


def _write(path, layer, pixels):
    """Write a picture of the form of `layer`, with what its header says of the frame."""
    oiio = openimageio.load()
    specs = []
    for spec in layer.opened()[1]:
        kept = oiio.ImageSpec(spec)
        for name in [attribute.name for attribute in spec.extra_attribs]:
            if _OF_ONE_RENDER.fullmatch(name):
                kept.erase_attribute(name)
            elif re.fullmatch(r"cycles\..*\.samples", name):
                kept.attribute(name, str(layer.samples))
        # Or else OpenImageIO writes the time of merging, and the same layers give another file each time.
        kept.attribute("DateTime", "")
        specs.append(kept)
    specs[0].attribute(PREFIX + "subset", f"0 {layer.samples}")
    specs[0].attribute(seal.NAME, seal.OPEN)
    with atomic_file.written_whole(path, lambda written: _check_written(str(written), specs, pixels)) as temporary:
        name = os.fsencode(temporary)
        output = oiio.ImageOutput.create(name)
        written = bool(output) and output.open(name, tuple(specs))
        column = 0
        for index, spec in enumerate(specs):
            if written and index:
                written = output.open(name, spec, "AppendSubimage")
            columns = pixels[..., column : column + spec.nchannels]
            written = written and output.write_image(np.ascontiguousarray(columns))
            column += spec.nchannels
        if not (written and output.close()):
            raise OSError(messages.one_line(output.geterror() if output else oiio.geterror(), 80))
        seal.seal(temporary)


def _check_written(path, specs, pixels):
    """Raise ValueError unless a picture can be read to its end, and holds these pixels."""
    image, found = openimageio.opened(path)
    shapes, wanted = ([(spec.width, spec.height, spec.nchannels) for spec in parts] for parts in (found, specs))
    if shapes != wanted:
        raise ValueError("its parts are others")
    is_exact = all(spec.format == "float" and spec.get_string_attribute("compression") in _LOSSLESS for spec in found)
    for band in bands(len(pixels)):
        read = openimageio.rows(image, found, band)
        if is_exact and not np.array_equal(read, pixels[band], equal_nan=True):
            raise ValueError("its pixels are others")
