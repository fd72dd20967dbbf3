# SPDX-License-Identifier: GPL-3.0-or-later
"""The steps from Cycles' answer to the result, each from picture to picture."""

import time

import numpy as np

from ..blender import failure
from ..cycles import denoiser, passes
from ..picture import denoiser_bias
from ..picture.picture import Picture

# Side of a picture that tells how long it takes to put back what the denoiser was wrong to take.
_TRIED = 160


def pictured(session, answer):
    """The passes that Cycles has rendered, as a picture."""
    kinds = passes.kinds(session.original_layer, {name for name, _ in answer})
    return Picture(answer, kinds, session.region.size)


def add_guides(session, frame):
    """Add the passes that guide the denoiser to the result, if the frame is to be denoised."""
    if frame.denoise:
        denoiser.add_guides(session.engine, session.layer_name)


def denoising_seconds(session, frame):
    """About how long `finish` takes for a picture that is to be denoised, by the scene's prefilter, as small ones tell.

    Raises any of `denoiser.FAILURES`.
    """
    grey = np.full((3, _TRIED, _TRIED), 0.5, np.float32)
    begun = time.perf_counter()
    denoiser_bias.reduced(grey, grey, (grey, grey))
    pixels, taken = frame.region.pixels, time.perf_counter() - begun
    return pixels * taken / _TRIED**2 + denoiser.seconds(session.scene, session.original_layer, pixels)


def set_prefilter(session, errors):
    """Have the denoiser take the prefilter that a picture of these `Picture.errors` needs."""
    session.set_sampling(denoising_prefilter=denoiser.prefilter(session.original_scene, *errors))


def finish(session, frame, picture):
    """Make a picture the engine's result, denoised if its frame says so.

    Where the denoiser fails it stays noisy, and is written: the report is no error, by which Blender would lose it.
    """
    engine, name = session.engine, session.layer_name
    if frame.denoise:
        picture = picture.with_noisy()
    passes.write(engine, frame.region, name, picture.passes)
    if not frame.denoise or engine.test_break():
        return
    engine.update_stats("", "Denoising")
    try:
        if picture.errors:
            set_prefilter(session, picture.errors)
        clean = denoiser.denoise(session.scene, session.original_layer, frame.region, picture.passes)
        clean = _without_bias(picture, clean)
    except denoiser.FAILURES as error:
        failure.report(engine, f"Cannot denoise: {error}", "WARNING")
    else:
        passes.write(engine, frame.region, name, picture.passes | clean)


def _without_bias(noisy, clean):
    """Denoised passes, with what the samples say that the denoiser was wrong to take."""
    if noisy.parts is None:
        return clean
    view = noisy.first_view
    before, after = (passes.NOISY, view), ("Combined", view)
    denoised = noisy.with_passes(clean)
    light = denoiser_bias.reduced(noisy.light_of(before)[:3], denoised.light_of(after)[:3], noisy.parts)
    return clean | {after: denoised.with_light_of({after: light}).passes[after]}
