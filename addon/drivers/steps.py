# SPDX-License-Identifier: GPL-3.0-or-later
"""The steps from Cycles' answer to the result, each from picture to picture."""

from ..blender import failure
from ..blender.refusal import Refused
from ..cycles import denoiser, passes
from ..farm import known_noise as noise
from ..picture import control_variates
from ..picture.picture import Picture
from ..plan import arranged_plan


def pictured(session, answer):
    """The passes that Cycles has rendered, as a picture."""
    kinds = passes.kinds(session.original_layer, {name for name, _ in answer})
    return Picture(answer, kinds, session.region.size)


def add_guides(session, frame):
    """Add the passes that guide the denoiser to the result, if the frame is to be denoised; return their names."""
    return denoiser.add_guides(session.engine, session.layer_name) if frame.denoise else []


def known_noise(frame, plan, method, added):
    """What subtracts the noise that known numbers explain.

    Parameters
    ----------
    frame : Frame
    plan : Plan
    method : str
        As `spectral_tiles.method` calls it.
    added : list of str
        Passes that the result has for being merged or denoised only.

    Returns
    -------
    clean : callable or None
        Of `control_variates.of_picture`; None leaves the noise in.
    description : str
        What a merge of layers must know to do it later (`known_noise.described`); else empty.
    """
    sampled = frame.sampling
    if not frame.noise_reduction:
        return None, ""
    if not sampled.is_whole:
        return None, noise.described(frame.use, frame.region, sampled, method, added)
    return control_variates.of_picture(frame.use, arranged_plan.drawn(plan, frame.region, sampled.samples)), ""


def without_noise(session, picture, clean, first, count):
    """The picture of some samples without known noise, if `clean` is given.

    Only of its first view: Cycles' numbers in the others are not those of the plan.
    """
    # A cancelled picture has not all of the samples whose numbers are known.
    if clean is None or session.engine.test_break():
        return picture
    seen = picture.of_view(picture.first_view)
    return picture.with_passes(clean(seen, first, count).passes)


def finish(session, frame, picture):
    """Make a picture the engine's result, denoised if its frame says so."""
    engine, name = session.engine, session.layer_name
    if frame.denoise:
        picture = picture.with_noisy()
    passes.write(engine, frame.region, name, picture.passes)
    if not frame.denoise or engine.test_break():
        return
    engine.update_stats("", "Denoising")
    try:
        noisy = picture.with_nonnegative_light_of(key for key in picture.passes if key[0] in passes.NOISY.values())
        clean = denoiser.denoise(session.original_scene, session.original_layer, frame.region, noisy.passes)
    except Refused as refused:
        failure.report(engine, str(refused))
    else:
        passes.write(engine, frame.region, name, picture.passes | clean)
