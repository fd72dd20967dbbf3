# SPDX-License-Identifier: GPL-3.0-or-later
"""Known noise of a frame that was rendered in layers: it is taken out of the merged picture, as of one render's.

Whether the noise goes with the random numbers shows only when all samples are there.  So layers are left as they are,
and say in their headers what their numbers followed; whoever merges them makes the same plan again.
"""

import json
import zlib
from dataclasses import asdict

import numpy as np

from ..blender.region import Region
from ..cycles import passes as cycles_passes
from ..cycles.scene_use import SceneUse
from ..picture import control_variates
from ..picture.picture import Picture
from ..plan import arranged_plan
from ..plan.sample_plan import Plan


def digest(plan):
    """What tells plans apart, `Plan` or `CellPlan`, as eight hexadecimal digits."""
    return f"{zlib.crc32(plan.film):08x}"


def drawn(plan, region, samples):
    """What Cycles draws at the film pixels of a plan, and the period of that, as `control_variates.of_picture` asks.

    Parameters
    ----------
    plan : Plan
    region : Region
    samples : int
        Of a pixel's whole sequence.

    Returns
    -------
    (callable, int)
    """
    return arranged_plan.drawn(plan, region, samples), 0


def described(use, region, sampled, method, added):
    """What `taken_out` must know of a view layer's render.

    Parameters
    ----------
    use : SceneUse
    region : Region
    sampled : Sampling
    method : str
        As `spectral_tiles.method` calls it.
    added : list of str
        Passes that the frame has for being merged only.

    Returns
    -------
    str
    """
    return json.dumps([asdict(use), region, sampled.seed, sampled.frame, sampled.frame_seed, method, added])


def taken_out(description, samples, plan_digest, passes, size):
    """Passes of a merged picture without the noise that Cycles' numbers explain.

    Parameters
    ----------
    description : str
        Of `described`.
    samples : int
        Samples a pixel.
    plan_digest : str
        Of the layers' plan.
    passes : dict
        As of `mixing.read_passes`, of one view.
    size : (int, int)
        Width and height of the picture, which may be more than the part that was rendered.

    Returns
    -------
    dict or None
        None if the plan cannot be made again here: a machine with another processor may round its choices differently.
    """
    used, region, seed, frame, frame_seed, method, added = json.loads(description)
    use, region = SceneUse(**used), Region(*map(tuple, region))
    if method == "GATHER":
        plan = arranged_plan.make(use, region, samples, seed, frame)
    else:
        plan = Plan.in_place(frame_seed, region)
    if digest(plan) != plan_digest:
        return None
    clean = control_variates.of_picture(use, *drawn(plan, region, samples))
    if clean is None:
        return passes
    left, bottom = region.corner if size == region.frame else (0, 0)
    window = (..., slice(bottom, bottom + region.size[1]), slice(left, left + region.size[0]))
    lit = {key: pixels for key, pixels in passes.items() if key[0] not in added}
    picture = Picture(lit, {name: cycles_passes.kind(name) for name, _ in lit}, size)
    planes = np.array(picture.light)
    planes[window] = clean(np.ascontiguousarray(planes[window]), 0, samples)
    return passes | picture.with_light(planes).passes
