# SPDX-License-Identifier: GPL-3.0-or-later
"""The method In Place: one call of Cycles, whose numbers are known, so that the noise they explain can be subtracted.

Nothing is planned and nobody aims the camera, so it costs little beside Cycles' render and takes any camera and device
that Cycles has.
"""

from ..cycles import passes, sampling
from ..farm import layers
from ..plan.sample_plan import Plan
from . import steps


def render(session, frame):
    """Render a frame.

    Parameters
    ----------
    session : Session
    frame : Frame

    Returns
    -------
    picture : Picture
    facts : dict of str to str
        Of `farm.layers.facts`.
    """
    plan = Plan.in_place(frame.sampling.frame_seed, frame.region)
    if not frame.sampling.is_whole and passes.can_be_mixed(session.layer):
        passes.add_divisors(session.engine, session.layer)
    steps.add_guides(session, frame)
    samples = frame.sampling.samples
    session.set_sampling(**sampling.exactly(samples))
    picture = steps.pictured(session, session.call())
    picture = steps.without_noise(session, picture, steps.noise_reduction(frame, plan), 0, samples)
    return picture, layers.facts(frame, session.layer_name, plan)
