# SPDX-License-Identifier: GPL-3.0-or-later
"""A pattern followed to the letter: each of its cells is rendered by itself, for each sample.

All film pixels of a cell share their random numbers (Mitchell 1991, section 6).  So a cell is a picture of the scene
at one moment, through one point of the lens, with one sample of the lights, seen on every n-th pixel each way.  It
needs no motion blur, no depth of field and no special camera: the scene is set to the moment, a pinhole stands at the
lens point (`cycles.cell_camera`), and Cycles' sample offset chooses the numbers of light and bounces.
"""

from ..blender.refusal import Refused
from ..cycles import aperture, exposure, sampling, shared_sequence
from ..cycles.sampling import Sampling
from ..farm import layers
from ..plan import cell_plan
from ..plan.sub_frame_plan import SubFramePlan
from .frame import pattern_tile
from .shots import PINNED, Shots

# Calls of a picture, at most: more would take seconds to plan, and days to render.
_MOST = 2**20


def check_count(scene, layer):
    """Raise `Refused` if a scene's pattern cannot be used, or would take too many calls."""
    tile = pattern_tile(scene)
    count = 0 if tile is None else tile.size**2 * Sampling.of_layer(scene, layer).samples
    if count > _MOST:
        raise Refused(
            f"This pattern would take {count:,} sub-frames, for more than {_MOST:,} of which there is no plan; "
            "lower Max Samples, set Pattern to Automatic, or set Method to Gather"
        )


def render(session, frame):
    """Render a frame."""
    tile, use, sampled = aperture.fitted(frame.tile, frame.use.blades), frame.use, frame.sampling
    dims = tuple(name for name in use.dims if name in tile.dims)
    plan = cell_plan.following(tile, dims, sampled.samples, sampled.frame_seed % 2**31)
    settings = sampling.exactly(plan.count, plan.seed) | {
        "sampling_pattern": "TABULATED_SOBOL",
        "scrambling_distance": 0.0,
        "auto_scrambling_distance": False,
    }
    cycles = session.scene.cycles
    kind = "BOX" if frame.filter else cycles.pixel_filter_type
    offsets = exposure.filter_offsets(plan.film, kind, cycles.filter_width)
    # As in Cycles, the first sample is in the middle.
    if not frame.filter:
        offsets[:, :, 0] = 0.0
    # How far Cycles' own filter moves each point of the sequence, in pixels of a cell's picture.  Further views draw
    # from another sequence: their pixels are blurred by that, with a standard deviation below .05 pixels.
    points = shared_sequence.values(("film.x", "film.y"), plan.count, plan.seed)
    drift = exposure.filter_offsets(points, "GAUSSIAN", PINNED)
    drift[0] = 0.0
    shots = Shots(
        session,
        frame,
        SubFramePlan(plan.side, plan.count, plan.groups(range(sampled.first, sampled.first + sampled.count))),
        settings,
        lambda shot: plan.film[shot.index],
        lambda shot: offsets[shot.index] - plan.side * drift[shot.first],
        lambda shot: plan.lens[shot.index],
    )
    return shots.picture(), layers.facts(frame, session.layer_name, plan)
