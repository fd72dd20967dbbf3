# SPDX-License-Identifier: GPL-3.0-or-later
"""A pattern followed to the letter: each of its cells is rendered by itself, for each sample.

All film pixels of a cell share their random numbers (Mitchell 1991, section 6).  So a cell is a picture of the scene at
one moment, through one point of the lens, with one sample of the lights, seen on every n-th pixel each way.  It needs no
motion blur, no depth of field and no special camera: the scene is set to the moment, a pinhole stands at the lens point
(`cycles.cell_camera`), and Cycles' sample offset chooses the numbers of light and bounces.
"""

import numpy as np

from ..blender.refusal import Refused
from ..cycles.sampling import Sampling
from ..plan import cell_plan
from .frame import pattern_tile

# Calls of a picture, at most: more would take seconds to plan, and days to render.
_MOST = 2**20


def check_count(scene, layer):
    """Raise `Refused` if a scene's pattern would take too many calls."""
    tile = pattern_tile(scene)
    count = 0 if tile is None else tile.size**2 * Sampling.of_layer(scene, layer).samples
    if count > _MOST:
        raise Refused(
            f"This pattern would take {count:,} sub-renders, for more than {_MOST:,} of which there is no plan; "
            "lower Max Samples, set Pattern to Automatic, or set Method to Gather"
        )


def render(session, frame):
    raise NotImplementedError
