# SPDX-License-Identifier: GPL-3.0-or-later
"""The time of a render's own copy of the scene, apart from that of the user's."""

import contextlib
import math

import bpy


def frame_of(scene):
    """Frame and sub-frame of a scene, as one number."""
    return scene.frame_current + scene.frame_subframe


def go_to(engine, scene, time, home):
    """Evaluate the scene that an engine renders at another time, and leave the user's timeline where it was.

    Handlers of *Frame Change* run as they do when Blender itself goes to the steps of motion blur: before and after the
    evaluation, with the scene's frame at that time.

    Parameters
    ----------
    engine : bpy.types.RenderEngine
    scene : bpy.types.Scene
        The original one.
    time, home : float
        Where to, and where the user's timeline belongs, in frames.
    """
    frame = math.floor(time)
    engine.frame_set(frame, subframe=time - frame)
    put_back(scene, home)


@contextlib.contextmanager
def kept(scene, time):
    """Put the user's timeline back at once where Cycles, having read motion, leaves it at another moment."""

    def keep(*_):
        put_back(scene, time)

    bpy.app.handlers.render_stats.insert(0, keep)
    try:
        yield
    finally:
        bpy.app.handlers.render_stats.remove(keep)
        keep()


def put_back(scene, time):
    """Set the frame of the original scene, without evaluating anything."""
    if frame_of(scene) == time:
        return
    # An assignment to a scene's own property would tag it, and Blender would evaluate it for every viewport.
    frames = [time if other == scene else other.frame_float for other in bpy.data.scenes]
    bpy.data.scenes.foreach_set("frame_float", frames)
