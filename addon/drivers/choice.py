# SPDX-License-Identifier: GPL-3.0-or-later
"""Which method renders a view layer, and what of its settings cannot be honoured by it."""

from dataclasses import dataclass, replace

from ..blender.refusal import Refused
from ..cycles import denoiser
from ..cycles.sampling import Sampling, is_tiled
from . import gather, rounds, sub_frames


@dataclass(frozen=True)
class Choice:
    """How a view layer is rendered.

    Attributes
    ----------
    method : str
        CYCLES (its own render, as if nobody had asked), ROUNDS, GATHER or SUB_FRAMES.
    refusals : tuple of str
        Why it will not be rendered: of what was chosen by hand.
    differences : tuple of str
        What will differ from Cycles or from what was set, a line each.
    """

    method: str
    refusals: tuple[str, ...] = ()
    differences: tuple[str, ...] = ()


def of_layer(scene, layer, use, scene_messages):
    """The `Choice` for a view layer.

    Parameters
    ----------
    scene : bpy.types.Scene
    layer : bpy.types.ViewLayer
    use : SceneUse
        What its noise comes from.
    scene_messages : callable
        Why what is seen cannot be rendered by Gather (`custom_camera.messages`); asked only where that matters.
    """
    found = _method(scene, layer, use, scene_messages)
    if found.method == "CYCLES":
        return found
    return replace(found, differences=tuple(_differences(found.method, scene, layer)))


def _differences(method, scene, layer):
    """What does not apply of Cycles' settings, a line each."""
    sampling, pattern = Sampling.of_layer(scene, layer), scene.cycles.sampling_pattern
    if method == "GATHER" and scene.spectral_tiles.filter != "AS_CYCLES" and sampling.threshold is not None:
        yield f"Noise Threshold does not apply to a filter: every pixel takes {sampling.samples} samples"
    if method == "SUB_FRAMES" and not sampling.is_even:
        yield f"Noise Threshold and Time Limit do not apply to sub-frames: every pixel takes {sampling.samples} samples"
    if pattern not in {"AUTOMATIC", "BLUE_NOISE"}:
        yield f"Cycles' pattern {pattern.replace('_', ' ').title()} does not apply"
    if is_tiled(scene):
        yield "Tile Size does not apply: memory is taken for all of the frame at once"


def _method(scene, layer, use, scene_messages):
    """As `of_layer`, but for the differences of our own methods."""
    settings, sampling = scene.spectral_tiles, Sampling.of_layer(scene, layer)
    if not sampling.count:
        return Choice("CYCLES")
    cannot_denoise = _refusals((lambda scene, layer: denoiser.check(scene, layer, use),), scene, layer)
    if settings.method == "SUB_FRAMES":
        return Choice("SUB_FRAMES", _refusals(sub_frames.CHECKS, scene, layer) + cannot_denoise)
    if settings.method == "GATHER" or settings.pattern != "AUTO" or settings.filter != "AS_CYCLES":
        if settings.method == "IN_PLACE":
            return Choice("CYCLES", (_NOT_IN_PLACE,))
        # What is seen is asked of a camera that is one, so only after the others.
        refusals = _refusals(gather.CHECKS, scene, layer) + cannot_denoise
        return Choice("GATHER", refusals or tuple(scene_messages()))
    if cannot_denoise:
        return Choice("CYCLES", differences=cannot_denoise)
    if settings.distribution == "BY_NOISE" and rounds.suit(scene, layer, sampling, use):
        return Choice("ROUNDS")
    return Choice("CYCLES")


_NOT_IN_PLACE = (
    "The method In Place takes Cycles' own samples; "
    "set Pattern to Automatic and Filter to As Cycles, or choose another method"
)


def _refusals(checks, scene, layer):
    """What checks, each of which may raise `Refused`, say against a view layer."""
    found = []
    for check in checks:
        try:
            check(scene, layer)
        except Refused as refused:
            found.append(str(refused))
    return tuple(found)
