# SPDX-License-Identifier: GPL-3.0-or-later
"""The exact merge of the layers of a frame (`layers`) into the picture that one render would have made."""

import os
import re
from dataclasses import dataclass

import numpy as np

from ..blender import interruption, openimageio
from ..blender.refusal import Refused
from ..blender.region import bands
from ..cycles.passes import FIRST_SAMPLE
from . import known_noise
from .layers import NOISE, PLAN, PREFIX

# Passes of light that Cycles has divided by the mean colour of what it fell on.
_DIVIDED = re.compile(r"(.*\.(?:Diffuse|Glossy|Transmission)) (?:Direct|Indirect)(\.[RGB])")
_COLOUR = r"\1 Color\2"
_CRYPTOMATTE = re.compile(r"(.*\.Crypto[A-Za-z]+)\d\d\.[rgba]")

# Facts of the layers' own renders, which say nothing about the merged picture.
_OF_ONE_RENDER = re.compile(r"Date|RenderTime|cycles\..*time|openexr:chunkCount|oiio:subimages")


def merge(files, path):
    """Merge the layers of a frame; the result does not depend on their order.

    Parameters
    ----------
    files : list of str
        Multilayer EXR files, all of one frame.
    path : str
        The merged picture, which appears complete or not at all.

    Returns
    -------
    samples : int
        Samples a pixel of the frame.
    exact : bool
        Whether all layers followed one plan, so that the picture is that of one render.  Machines with another
        processor or other libraries may round a plan's choices differently; the mean is then sound, but not the same,
        and the noise that is known only from the plan stays in.

    Raises
    ------
    Refused
        A file is missing, damaged or no layer; they are of different frames, tiles, seeds, sizes or Blender versions;
        samples are missing or in two files.
    OSError
        The picture cannot be written.
    """
    layers = sorted((_Layer.read(file) for file in files), key=lambda layer: layer.first)
    exact = _check_alike(layers)
    _check_complete(layers)
    specs = layers[0].specs
    names = _channels(specs)
    height, width = specs[0].height, specs[0].width
    merged = np.empty((height, width, len(names)), np.float32)
    weights = [layer.count / layers[0].samples for layer in layers]
    for band in bands(height):
        merged[band] = _mean([layer.rows(band) for layer in layers], weights, names)
    exact = exact and _take_out_noise(merged, layers[0], names)
    _write(path, layers[0], merged)
    return layers[0].samples, exact


@dataclass(frozen=True)
class _Layer:
    """A layer's file.

    Attributes
    ----------
    path : str
    known : dict of str to str
        Its `facts`, size and passes.
    first, count, samples : int
        First sample, how many, and those of the whole frame.
    specs : list of OpenImageIO.ImageSpec
        Of its parts, which hold a pass each, or all passes.
    image : OpenImageIO.ImageInput
    """

    path: str
    known: dict
    first: int
    count: int
    samples: int
    specs: list
    image: object

    @classmethod
    def read(cls, path):
        """Open a file and read what it says of itself."""
        if not os.path.isfile(path):
            raise Refused(f"Missing: {path}")
        oiio = openimageio.load()
        image = oiio.ImageInput.open(path)
        if image is None:
            raise Refused(f"{path} is damaged or truncated: {_one_line(oiio.geterror())}")
        specs = []
        while image.seek_subimage(len(specs), 0):
            specs.append(image.spec())
        attributes = {attribute.name: attribute.value for attribute in specs[0].extra_attribs}
        known = {name.removeprefix(PREFIX): value for name, value in attributes.items() if name.startswith(PREFIX)}
        if "subset" not in known:
            raise Refused(f"{path} was not rendered with Spectral Tiles")
        names = _channels(specs)
        if any(".Noisy Image." in name for name in names):
            raise Refused(f"{path} was denoised; denoise after merging")
        for name in names:
            if (match := _DIVIDED.fullmatch(name)) and match.expand(_COLOUR) not in names:
                raise Refused(
                    f"{path} cannot be merged: switch on the pass {match[1].rpartition('.')[2]} Color as well"
                )
        known["size"] = f"{specs[0].width} x {specs[0].height}"
        known["passes"] = ", ".join(names)
        first, count = map(int, known.pop("subset").split())
        return cls(path, known, first, count, int(known["samples"]), specs, image)

    def rows(self, band):
        """Some rows of all channels, float32 (rows, width, channels)."""
        parts = []
        for index, spec in enumerate(self.specs):
            start, stop = spec.y + band.start, spec.y + band.stop
            pixels = self.image.read_scanlines(index, 0, start, stop, 0, 0, spec.nchannels, "float")
            if pixels is None:
                raise Refused(f"{self.path} is damaged or truncated: {_one_line(self.image.geterror())}")
            parts.append(pixels.reshape(stop - start, spec.width, -1))
        return np.concatenate(parts, axis=2)


def _channels(specs):
    """Names of all parts' channels, behind the view of a stereoscopic picture."""
    return [f"{spec.get_string_attribute('view')}:{name}" for spec in specs for name in spec.channelnames]


def _check_alike(layers):
    """Raise `Refused` unless all are layers of one frame; return whether they also followed one plan."""
    one = layers[0]
    exact = True
    for other in layers[1:]:
        # What makes the noise differ is named first.
        for name in sorted(one.known.keys() | other.known.keys(), key=lambda name: (name.startswith(NOISE), name)):
            values = [layer.known.get(name, "none") for layer in (one, other)]
            if values[0] == values[1]:
                continue
            if name.startswith(NOISE):
                raise Refused(f"{other.path} and {one.path} differ in Control Variates, or in what is left to chance")
            if not name.startswith(PLAN):
                raise Refused(f"{other.path} and {one.path} differ in {name}: {values[1]} and {values[0]}")
            exact = False
    return exact


def _check_complete(layers):
    """Raise `Refused` unless the layers, in order, hold every sample once."""
    reached = 0
    for before, layer in zip([None, *layers], layers, strict=False):
        if layer.first > reached:
            raise Refused(_missing(reached, layer.first, layer.samples))
        if layer.first < reached:
            raise Refused(f"{before.path} and {layer.path} hold the same samples")
        reached += layer.count
    if reached < layers[0].samples:
        raise Refused(_missing(reached, layers[0].samples, layers[0].samples))


def _missing(start, stop, samples):
    return f"No layer holds samples {start + 1} to {stop} of {samples}"


def _mean(pictures, weights, names):
    """Weighted mean of the same rows of all layers, (rows, width, channels), in the order given."""
    total = 0.0
    divided = {
        column: names.index(match.expand(_COLOUR))
        for column, name in enumerate(names)
        if (match := _DIVIDED.fullmatch(name))
    }
    for weight, picture in zip(weights, pictures, strict=True):
        light = picture.astype(np.float64)
        for column, colour in divided.items():
            light[..., column] *= light[..., colour]
        total = total + weight * light
    for column, colour in divided.items():
        seen = total[..., colour] != 0.0
        total[..., column] = np.divide(total[..., column], total[..., colour], out=np.zeros(seen.shape), where=seen)
    cryptomattes = {}
    for column, name in enumerate(names):
        if not FIRST_SAMPLE.isdisjoint(name.split(".")[1:]):
            total[..., column] = pictures[0][..., column]
        if match := _CRYPTOMATTE.fullmatch(name):
            cryptomattes.setdefault(match[1], []).append((name[:-1], "rgba".index(name[-1]), column))
    for columns in cryptomattes.values():
        order = [column for *_, column in sorted(columns)]
        total[..., order] = _cryptomatte([picture[..., order] for picture in pictures], weights)
    return total


def _take_out_noise(merged, layer, names):
    """Free a merged picture of known noise, in place; return whether that could be done where it was to be.

    Parameters
    ----------
    merged : float32 array, shape (height, width, channels)
        Rows from the top.
    layer : _Layer
        Any.
    names : list of str
        Of the channels.
    """
    height, width, _ = merged.shape
    first_view = names[0].partition(":")[0]
    view_layers = [name.removeprefix(NOISE) for name in layer.known if name.startswith(NOISE)]
    columns = {view_layer: {} for view_layer in view_layers}
    for column, name in enumerate(names):
        view, _, name = name.partition(":")
        owner = max((owner for owner in view_layers if name.startswith(f"{owner}.")), key=len, default=None)
        if owner is not None and view == first_view:
            render_pass = name.removeprefix(f"{owner}.").rpartition(".")[0]
            columns[owner].setdefault((render_pass, view), []).append(column)
    done = True
    for view_layer, places in columns.items():
        noise = layer.known[NOISE + view_layer]
        if not noise:
            continue
        passes = {key: merged[::-1, :, place].reshape(height * width, -1) for key, place in places.items()}
        clean = known_noise.taken_out(noise, layer.samples, layer.known[PLAN + view_layer], passes, (width, height))
        for key, place in places.items() if clean else ():
            merged[::-1, :, place] = clean[key].reshape(height, width, -1)
        done = done and clean is not None
    return done


def _cryptomatte(pictures, weights):
    """Merged ranks of identifiers and coverages, (rows, width, 2 * ranks): coverages of one identifier add up."""
    shape = pictures[0].shape
    ranks = shape[-1] // 2
    ids = np.concatenate([picture[..., 0::2] for picture in pictures], axis=-1).reshape(-1, len(pictures) * ranks)
    coverage = np.concatenate(
        [weight * picture[..., 1::2].astype(np.float64) for weight, picture in zip(weights, pictures, strict=True)],
        axis=-1,
    ).reshape(ids.shape)
    order = np.argsort(ids, axis=1, kind="stable")
    ids, coverage = (np.take_along_axis(values, order, axis=1) for values in (ids, coverage))
    pixel = np.arange(len(ids))[:, None]
    run = np.cumsum(np.diff(ids, axis=1, prepend=ids[:, :1]) != 0, axis=1)
    total, owner = np.zeros_like(coverage), np.zeros_like(ids)
    np.add.at(total, (pixel, run), coverage)
    owner[pixel, run] = ids
    best = np.argsort(-total, axis=1, kind="stable")[:, :ranks]
    ranked = (np.take_along_axis(values, best, axis=1) for values in (owner, total))
    return np.stack(list(ranked), axis=-1).reshape(shape)


def _write(path, layer, pixels):
    """Write a picture of the form of `layer`, with what its header says of the frame."""
    oiio = openimageio.load()
    specs = []
    for spec in layer.specs:
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
    folder, name = os.path.split(os.path.abspath(path))
    with interruption.unfinished(folder) as unfinished:
        temporary = os.path.join(unfinished, name)
        output = oiio.ImageOutput.create(temporary)
        written = bool(output) and output.open(temporary, tuple(specs))
        column = 0
        for index, spec in enumerate(specs):
            if written and index:
                written = output.open(temporary, spec, "AppendSubimage")
            columns = pixels[..., column : column + spec.nchannels]
            written = written and output.write_image(np.ascontiguousarray(columns))
            column += spec.nchannels
        if not (written and output.close()):
            raise OSError(f"Cannot write {path}: {_one_line(output.geterror() if output else oiio.geterror())}")
        os.replace(temporary, path)


def _one_line(text):
    return " ".join(text.split())
