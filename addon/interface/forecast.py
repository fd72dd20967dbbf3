# SPDX-License-Identifier: GPL-3.0-or-later
"""What a render of the scene will do, told before it is rendered."""

import bpy

from ..cycles import scene_analysis
from ..cycles.sampling import Sampling
from ..drivers import choice, gather

# Of each view layer, by its depsgraph: its emitters, and what is wrong with its shading.  Finding them takes
# milliseconds in a scene of thousands of objects, and a panel is drawn at every move of the mouse over it.
_emitters = {}
_shading = {}


def _remembered(found, depsgraph, find):
    key = depsgraph.as_pointer()
    if key not in found:
        found[key] = find(depsgraph)
    return found[key]


def scene_use(layer):
    """What a view layer uses, without evaluating it.

    Parameters
    ----------
    layer : bpy.types.ViewLayer
        As the viewport shows it.

    Returns
    -------
    SceneUse or None
        None as long as the view layer was never evaluated.
    """
    depsgraph = layer.depsgraph
    if depsgraph is None:
        return None
    return scene_analysis.scene_use(depsgraph, _remembered(_emitters, depsgraph, scene_analysis.emitters))


def chosen(scene, layer):
    """How a view layer will be rendered, as of `drivers.choice.of_layer`; None as long as it was never evaluated."""
    use = scene_use(layer)
    if use is None:
        return None

    def shading_messages():
        return _remembered(_shading, layer.depsgraph, lambda found: gather.scene_messages(found, scene.camera))

    return choice.of_layer(scene, layer, Sampling.of_layer(scene, layer), use, shading_messages)


def sentence(scene, layer):
    """What will be done for this frame, in one sentence; None as long as it was never evaluated."""
    use, how = scene_use(layer), chosen(scene, layer)
    if use is None or how.refusals:
        return None
    return {
        "CYCLES": "Rendered by Cycles as it is: nothing to gain for this frame",
        "ROUNDS": "Samples go where the picture needs them",
        "IN_PLACE": f"Noise reduced that comes from {noise_sources(use)}",
        "GATHER": f"Samples arranged for {noise_sources(use)}",
        "SUB_FRAMES": f"{scene.spectral_tiles.sub_frames} moments of the shutter are rendered one by one",
    }[how.method]


def noise_sources(use):
    """What the noise of a frame comes from, in words, such as "motion blur, depth of field and 3 lights"."""
    lights = f"{use.lights} light{'s' if use.lights > 1 else ''}"
    present = (
        (use.motion_blur, "motion blur"),
        (use.lens, "depth of field"),
        (use.lights, lights),
        (use.bounces, "indirect light"),
    )
    words = [word for is_there, word in present if is_there]
    return " and ".join(filter(None, (", ".join(words[:-1]), *words[-1:]))) or "nothing that makes noise"


@bpy.app.handlers.persistent
def _forget(*_):
    _emitters.clear()
    _shading.clear()


# Whatever may change what is remembered.
_HANDLERS = (bpy.app.handlers.depsgraph_update_post, bpy.app.handlers.frame_change_post, bpy.app.handlers.load_post)


def register():
    for handlers in _HANDLERS:
        handlers.append(_forget)


def unregister():
    for handlers in _HANDLERS:
        handlers.remove(_forget)
    _forget()
