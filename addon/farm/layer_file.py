# SPDX-License-Identifier: GPL-3.0-or-later
"""A layer's file.  What its header says is data like any other: believed as far as it agrees with the picture."""

import itertools
import os
import re
from dataclasses import dataclass, field
from typing import NamedTuple

from ..blender import openimageio
from ..blender.refusal import Refused
from ..cycles import passes
from ..cycles.passes import Kind
from ..plan.patterns import messages
from . import layers, seal
from .layers import AOVS, PLAN, PREFIX

# Compression makes nothing smaller than by this: Deflate's limit.  Whatever is said to be more is not there.
_MOST_PACKED = 1100

# What facts look like: those of the picture, and those of each view layer.
_FORMS = {
    "format": str(layers.FORMAT),
    "blender": r"\d{1,4}\.\d{1,4}\.\d{1,4}.{0,40}",
    "frame": r"-?\d{1,7}",
    "samples": r"\d{1,10}",
    "seed": r"-?\d{1,10}",
    "subset": r"\d{1,10} \d{1,10}",
    "pattern": r".{1,200}",
    "sub_frames": r"\d{1,3}",
}
_OF_LAYERS = {PLAN: "[0-9a-f]{8}|none", AOVS: ".+"}


class Channel(NamedTuple):
    """A channel of a picture: its view, view layer, pass, component such as R, and what its values are.

    The view layer is empty where nobody knows it.
    """

    view: str
    layer: str
    render_pass: str
    component: str
    kind: Kind

    def __str__(self):
        return ".".join(part for part in (self.layer, self.render_pass, self.component) if part)


@dataclass(frozen=True)
class LayerFile:
    """A layer's file.

    Attributes
    ----------
    path : str
    known : dict of str to str
        Its facts (`layers.facts`) but for those below, its size and passes.
    first, count, samples : int
        First sample, how many, and those of the whole frame.
    size : (int, int)
        Width and height in pixels.
    channels : list of Channel
        Of all parts.
    divisors : dict of int to int
        By the numbers of channels whose light Cycles has divided, those of the colours by which.
    is_sealed : bool
        Whether its digest has told that it is whole.
    changed : int
        When it was written.
    held : tuple or None
        As of `openimageio.opened`, whoever replaces the file; None if it is opened anew each time.
    """

    path: str
    known: dict
    first: int
    count: int
    samples: int
    size: tuple
    channels: list
    divisors: dict
    is_sealed: bool
    changed: int
    held: tuple | None = field(repr=False)

    @classmethod
    def read(cls, path, stays_open=True):
        """Open a file and read what it says of itself.

        Parameters
        ----------
        path : str
        stays_open : bool
            A process may have but some hundred open files; the others must not change.

        Raises
        ------
        Refused
            It is missing, damaged, or no layer; its header contradicts itself or the picture; or it cannot be merged.
        """
        if not os.path.isfile(path):
            raise Refused(messages.one_line(f"Missing: {path}"))
        changed = os.stat(path).st_mtime_ns
        is_sealed = seal.check(path)
        try:
            return cls._read(path, is_sealed, changed, stays_open)
        except UnicodeDecodeError:
            raise seal.refusal(path, "is damaged: there is no text in its header where text should be") from None
        except ValueError as error:
            raise seal.refusal(path, f"is damaged or truncated: {error}") from None

    @classmethod
    def _read(cls, path, is_sealed, changed, stays_open):
        image, specs = opened = openimageio.opened(path)
        if image.format_name() != "openexr":
            raise seal.refusal(path, "is no OpenEXR picture")
        _check_size(path, specs)
        # Of all parts, so that a name that is no text is found here.
        names = [[attribute.name for attribute in spec.extra_attribs] for spec in specs]
        known = {name.removeprefix(PREFIX): specs[0].getattribute(name) for name in names[0] if name.startswith(PREFIX)}
        if not known:
            raise seal.refusal(path, "was not rendered with Spectral Tiles")
        _check_forms(path, known)
        samples = int(known["samples"])
        first, count = map(int, known.pop("subset").split())
        if not 0 < count <= samples - first:
            raise seal.refusal(
                path, f"its header has samples {first + 1} to {first + count}, but the frame has {samples}"
            )
        owners = {name.removeprefix(PLAN) for name in known if name.startswith(PLAN)}
        types = {owner: layers.aovs_of(known[AOVS + owner]) for owner in owners}
        for owner, found in types.items():
            if found is None:
                raise _contradiction(path, AOVS + owner, known[AOVS + owner])
        channels = _channels(specs, types)
        if len(set(channels)) < len(channels):
            raise seal.refusal(path, "cannot be merged: two of its channels have the same name")
        for channel in channels:
            if channel.render_pass == passes.NOISY and channel.render_pass not in types.get(channel.layer, {}):
                raise seal.refusal(path, "was denoised; denoise after merging")
        divisors = _divisors(path, channels, types)
        known["size"] = "{0.width} x {0.height}".format(specs[0])
        known["window"] = "{0.x} {0.y} in {0.full_width} x {0.full_height}".format(specs[0])
        known["passes"] = ", ".join(f"{channel.view}:{channel}" for channel in channels)
        size = specs[0].width, specs[0].height
        held = opened if stays_open else None
        return cls(path, known, first, count, samples, size, channels, divisors, is_sealed, changed, held)

    def opened(self):
        """As `openimageio.opened`; raises `Refused` if it has become another file, and ValueError if it is damaged."""
        if self.held:
            return self.held
        if os.stat(self.path).st_mtime_ns != self.changed:
            raise seal.refusal(self.path, "has become another file meanwhile")
        return openimageio.opened(self.path)

    def rows(self, band):
        """Some rows of all channels, float32 (rows, width, channels); raises `Refused` if they are damaged."""
        try:
            return openimageio.rows(*self.opened(), band)
        except ValueError as error:
            raise seal.refusal(self.path, f"is damaged or truncated: {error}") from None


def _check_size(path, specs):
    """Raise `Refused` unless all parts are of one size, which the file can hold."""
    sizes = {(spec.width, spec.height, spec.x, spec.y) for spec in specs}
    spec = specs[0]
    frame = spec.full_width, spec.full_height
    values = sum(spec.width * spec.height * spec.nchannels for spec in specs)
    if len(sizes) > 1 or spec.depth != 1 or spec.width > frame[0] or spec.height > frame[1]:
        raise seal.refusal(path, "is damaged: the sizes in its header contradict each other")
    # Of two bytes each, at least.
    if not 0 < 2 * values <= _MOST_PACKED * os.path.getsize(path):
        raise seal.refusal(
            path, f"is damaged: its header has {spec.width} x {spec.height} pixels, more than it can hold"
        )


def _check_forms(path, known):
    """Raise `Refused` unless all facts are there, and look as they should."""
    for name, value in known.items():
        if not isinstance(value, str):
            raise _contradiction(path, name, value)
    if "format" not in known:
        raise seal.refusal(path, "was rendered by another version of Spectral Tiles, or is damaged")
    forms = dict(_FORMS)
    for layer in {name.partition(".")[2] for name in known if name.startswith(tuple(_OF_LAYERS))} or {""}:
        forms |= {name + layer: form for name, form in _OF_LAYERS.items()}
    for name, form in forms.items():
        if re.fullmatch(form, known.get(name, ""), re.ASCII) is None:
            raise _contradiction(path, name, known.get(name))


def _contradiction(path, name, value):
    has = "nothing" if value is None else messages.quoted(value)
    return seal.refusal(path, f"is damaged or no layer: its header has {has} for {messages.one_line(name, 40)}")


def _channels(specs, types):
    """All parts' channels, in order; `types` are those of AOVs, by view layer and name."""
    channels = []
    for spec in specs:
        view = spec.get_string_attribute("view")
        for name in spec.channelnames:
            owner = max((owner for owner in types if name.startswith(f"{owner}.")), key=len, default="")
            render_pass, _, component = (name.removeprefix(f"{owner}.") if owner else name).rpartition(".")
            kind = passes.kind(render_pass, types.get(owner, {}).get(render_pass))
            channels.append(Channel(view, owner, render_pass, component, kind))
    return channels


def _divisors(path, channels, types):
    """The `LayerFile.divisors`; raises `Refused` if there are none where there should be."""
    places = {channel: number for number, channel in enumerate(channels)}
    divisors = {}
    for number, channel in enumerate(channels):
        if channel.kind is not Kind.DIVIDED or not channel.layer:
            continue
        colour = channel._replace(render_pass=passes.divisor(channel.render_pass), kind=Kind.COLOUR)
        if colour.render_pass in types[channel.layer]:
            raise seal.refusal(path, f"cannot be merged: call the AOV {colour.render_pass} otherwise")
        if colour not in places:
            raise seal.refusal(path, f"cannot be merged: switch on the pass {colour.render_pass} as well")
        divisors[number] = places[colour]
    return divisors


def check_alike(files):
    """Raise `Refused` unless all are layers of one frame; return whether they also followed one plan."""
    exact = True
    for one, other in itertools.product(files[:1], files[1:]):
        for name in sorted(one.known.keys() | other.known.keys()):
            values = [layer.known.get(name, "none") for layer in (one, other)]
            if values[0] == values[1] or name == "digest":
                continue
            if not name.startswith(PLAN):
                said = " and ".join(messages.one_line(value, 24) for value in reversed(values))
                raise Refused(f"{both(other, one)} differ in {messages.one_line(name, 24)}: {said}")
            exact = False
    return exact


def check_complete(files):
    """Raise `Refused` unless the layers, in order of their first samples, hold every sample once."""
    reached, samples = 0, files[0].samples
    for before, layer in zip([None, *files], files, strict=False):
        if layer.first > reached:
            raise Refused(f"No layer holds samples {reached + 1} to {layer.first} of {samples}")
        if layer.first < reached:
            raise Refused(f"{both(before, layer)} hold the same samples")
        reached += layer.count
    if reached < samples:
        raise Refused(f"No layer holds samples {reached + 1} to {samples} of {samples}")


def both(one, other):
    """Names of two layers for a person, with their folders if nothing else tells them apart."""
    names = [os.path.basename(layer.path) for layer in (one, other)]
    if names[0] == names[1]:
        names = [one.path, other.path]
    return " and ".join(messages.one_line(name, 56) for name in names)
