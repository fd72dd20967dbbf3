# SPDX-License-Identifier: GPL-3.0-or-later
"""The method Sub-Frames: moments of the shutter, rendered one by one, so that whatever is animated blurs.

The scene is evaluated at each moment, and Cycles renders it with its own lens and filter.  A frame takes no more
samples than it would at once, but has its scene updated as often as there are moments: `plan.sub_frame_plan` says who
is sampled when.  A pattern chosen by hand is followed to the letter instead, cell by cell (`drivers.pattern_cells`).
"""

from ..blender.refusal import Refused
from ..cycles import cell_camera, passes, sampling, shared_sequence
from ..cycles.sampling import Sampling
from ..farm import layers
from ..plan import sub_frame_plan
from . import pattern_cells, steps
from .frame import moments
from .shots import Shots


def _aims(scene, layer):
    """Whether the camera is aimed at single pixels."""
    settings = scene.spectral_tiles
    if settings.pattern != "AUTO" or settings.filter != "AS_CYCLES":
        return True
    return sub_frame_plan.side(max(1, Sampling.of_layer(scene, layer).samples), moments(scene, layer)) > 1


def _check_camera(scene, layer):
    if scene.camera is None:
        raise Refused("Cannot render, no camera in the scene")
    if scene.render.use_motion_blur and scene.cycles.rolling_shutter_type != "NONE":
        raise Refused("A rolling shutter cannot be rendered by sub-frames; set it to None, or set Method to In Place")
    if _aims(scene, layer):
        cell_camera.check(scene, scene.camera)


def _check_passes(scene, layer):
    if layer.use_pass_vector and _aims(scene, layer):
        raise Refused(
            f'The Vector pass of view layer "{layer.name}" cannot be rendered by sub-frames of fewer samples than '
            "moments, or with a pattern or filter; switch the pass off"
        )
    # Cycles takes it for its own pass of this name where it blurs nothing, and so at each moment.
    if scene.render.use_motion_blur and "Vector" in passes.aov_types(layer):
        raise Refused(
            f'The AOV "Vector" of view layer "{layer.name}" stands for a pass of Cycles\' in sub-frames; '
            "rename it, or set Method to In Place"
        )


def _check_culling(scene, layer):
    if scene.render.use_simplify and scene.cycles.use_camera_cull and _aims(scene, layer):
        raise Refused(
            "Camera Culling cannot be done by sub-frames of fewer samples than moments, or with a pattern or filter, "
            "each of which sees more than the picture; switch it off (Simplify), or set Method to In Place"
        )


# Each raises `Refused` if a scene's view layer cannot be rendered this way.  The panel asks them all beforehand.
CHECKS = (_check_camera, _check_passes, _check_culling, pattern_cells.check_count)


def render(session, frame):
    """Render a frame."""
    steps.add_guides(session, frame)
    passes.add_divisors(session.engine, session.layer)
    if frame.tile is not None:
        return pattern_cells.render(session, frame)
    sampled = frame.sampling
    seed = sampled.frame_seed % 2**31
    plan = sub_frame_plan.make(
        sampled.samples,
        frame.sub_frames,
        range(sampled.first, sampled.first + sampled.count),
        sampled.frame_seed,
        one_by_one=frame.filter is not None,
    )
    place = None
    # Cycles cannot make a box as narrow as a pixel of the film is in a cell's picture.
    if frame.filter is not None or (plan.side > 1 and session.scene.cycles.pixel_filter_type == "BOX"):
        places = shared_sequence.values(("film.x", "film.y"), shared_sequence.length(plan.length), seed)

        def place(shot):
            return places[shot.first]

    shots = Shots(session, frame, plan, sampling.exactly(plan.length, seed), place)
    return shots.picture(), layers.facts(frame, session.layer_name)
