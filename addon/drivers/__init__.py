# SPDX-License-Identifier: GPL-3.0-or-later
"""How Cycles is called: the methods, each a way from the description of a frame to a picture."""

from ..blender.refusal import Refused
from ..cycles import custom_camera, passes
from ..cycles import session as cycles_session
from ..farm import layers
from . import choice, frame, gather, rounds, steps, sub_frames

__all__ = ["choice", "frame", "gather", "render", "rounds", "shots", "steps"]

# Each renders a `Frame` by a `Session`, and returns a `Picture`, and `farm.layers.facts` of it.
_METHODS = {"GATHER": gather.render, "ROUNDS": rounds.render, "SUB_FRAMES": sub_frames.render}


def render(engine, depsgraph, render_by_cycles):
    """Render a view layer as its scene's settings ask for.

    Parameters
    ----------
    engine : bpy.types.RenderEngine
        Cycles'.
    depsgraph : bpy.types.Depsgraph
    render_by_cycles : callable
        `cycles.engine.render`, which renders where nothing is to be done.

    Raises
    ------
    Refused
        The scene cannot be rendered as was chosen by hand.
    """
    described = frame.Frame.of_depsgraph(depsgraph)
    scene, layer = depsgraph.scene_eval, depsgraph.view_layer_eval
    chosen = choice.of_layer(scene, layer, described.use, lambda: custom_camera.messages(depsgraph))
    if chosen.refusals:
        raise Refused(chosen.refusals[0])
    method = _METHODS.get(chosen.method)
    if method is None:
        if not described.sampling.is_whole and passes.can_be_mixed(layer):
            passes.add_divisors(engine, layer)
        # Blender may free the evaluated layer.
        facts = layers.facts(described, layer.name)
        render_by_cycles(engine, depsgraph)
    else:
        with cycles_session.Session(engine, depsgraph) as session:
            picture, facts = method(session, described)
            steps.finish(session, described, picture)
    layers.stamp(engine, facts)
