# SPDX-License-Identifier: GPL-3.0-or-later
"""Known noise of a frame that was rendered in layers: it is taken out of the merged picture, as of one render's.

Whether the noise goes with the random numbers shows only when all samples are there.  So layers are left as they are,
and say in their headers what their numbers followed; whoever merges them makes the same plan again.
"""

import json
import zlib
from dataclasses import asdict

import numpy as np

from . import automatic, cell_plan, control_variates, film
from .analysis import SceneUse
from .plan import Plan
from .region import Region


def digest(plan):
    """What tells plans apart, `plan.Plan` or `cell_plan.CellPlan`, as eight hexadecimal digits."""
    return f"{zlib.crc32(plan.film):08x}"


def described(use, region, settings, frame, driver, added):
    """What `taken_out` must know of a view layer's render.

    Parameters
    ----------
    use : SceneUse
    region : Region
    settings : properties.Settings
        The scene's.
    frame : int or None
        Of an animation whose pattern changes from frame to frame.
    driver : str
        As `spectral_tiles.driver` calls it.
    added : list of str
        Passes that the frame has for being merged only.

    Returns
    -------
    str
        Empty if no noise is to be taken out.
    """
    if settings.samples > control_variates.MOST_SAMPLES:
        return ""
    return json.dumps([asdict(use), region, settings.seed, frame, driver, added])


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
        As of `film.read_passes`, of one view.
    size : (int, int)
        Width and height of the picture, which may be more than the part that was rendered.

    Returns
    -------
    dict or None
        None if the plan cannot be made again here: a machine with another processor may round its choices differently.
    """
    used, region, seed, frame, driver, added = json.loads(description)
    use, region = SceneUse(**used), Region(*map(tuple, region))
    if driver == "SUBRENDER":
        plan = cell_plan.arranged(use, samples, seed, frame)
    elif driver == "GATHER":
        plan = automatic.make(use, region, samples, seed, frame)
    else:
        plan = Plan.in_place(seed + (frame or 0), region)
    if digest(plan) != plan_digest:
        return None
    if driver == "SUBRENDER":
        clean = control_variates.of_picture(use, plan.drawn(region), plan.side)
    else:
        clean = control_variates.of_picture(use, automatic.drawn(plan, region, samples))
    if clean is None:
        return passes
    left, bottom = region.corner if size == region.frame else (0, 0)
    window = (..., slice(bottom, bottom + region.size[1]), slice(left, left + region.size[0]))
    lit = {key: pixels for key, pixels in passes.items() if key[0] not in added}
    planes = np.array(film.colours(lit, *size[::-1]))
    planes[window] = clean(np.ascontiguousarray(planes[window]), 0, samples)
    return passes | film.with_colours(lit, planes)
