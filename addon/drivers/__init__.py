# SPDX-License-Identifier: GPL-3.0-or-later
"""How Cycles is called: the methods, each a way from the description of a frame to a picture."""

from cycles import CyclesRender

from ..blender.refusal import Refused
from ..cycles import session as cycles_session
from ..farm import layers
from . import checks, choice, frame, gather, in_place, rounds, steps, sub_frames

__all__ = ["checks", "choice", "frame", "gather", "in_place", "render", "rounds", "steps", "sub_frames"]

_METHODS = {"IN_PLACE": in_place, "GATHER": gather, "ROUNDS": rounds, "SUB_FRAMES": sub_frames}


def render(engine, depsgraph, render_by_cycles):
    """Render a view layer as its scene's settings ask for.

    Parameters
    ----------
    engine : cycles.CyclesRender
    depsgraph : bpy.types.Depsgraph
    render_by_cycles : callable
        What renders where nothing is to be done: Cycles' own method, or what another add-on has put in its place.

    Raises
    ------
    Refused
        The scene cannot be rendered as was chosen by hand.
    """
    described = frame.Frame.of_depsgraph(depsgraph)
    scene, layer = depsgraph.scene_eval, depsgraph.view_layer_eval
    chosen = choice.of_layer(
        scene, layer, described.sampling, described.use, lambda: gather.scene_messages(depsgraph, scene.camera)
    )
    if chosen.refusals:
        raise Refused(chosen.refusals[0])
    method = _METHODS.get(chosen.method)
    # Another add-on in Cycles' place wants to see one call, and the whole picture.
    if method is None or render_by_cycles.__module__ != CyclesRender.__module__:
        name = layer.name
        render_by_cycles(engine, depsgraph)
        facts = layers.facts(described, name)
    else:
        with cycles_session.Session(engine, depsgraph) as session:
            picture, facts = method.render(session, described)
            steps.finish(session, described, picture)
    layers.stamp(engine, facts)
