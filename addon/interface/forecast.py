# SPDX-License-Identifier: GPL-3.0-or-later
"""What a render of the scene will do, told before it is rendered."""

import os

import bpy

from ..cycles import custom_camera, scene_analysis
from ..drivers import choice, frame

# What was found in a view layer, by name and depsgraph.  Finding it takes milliseconds in a scene of thousands of
# objects, and a panel is drawn at every move of the mouse over it.
_found = {}


def _remembered(name, depsgraph, find):
    key = name, depsgraph.as_pointer()
    if key not in _found:
        _found[key] = find(depsgraph)
    return _found[key]


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
    return scene_analysis.scene_use(depsgraph, _remembered("contents", depsgraph, scene_analysis.contents))


def chosen(scene, layer):
    """How a view layer will be rendered, as of `drivers.choice.of_layer`; None as long as it was never evaluated."""
    use = scene_use(layer)
    if use is None:
        return None
    return choice.of_layer(scene, layer, use, lambda: _remembered("messages", layer.depsgraph, custom_camera.messages))


def sentence(scene, layer):
    """What will be done for this frame, in one sentence; None if it is refused, or was never evaluated."""
    use, how = scene_use(layer), chosen(scene, layer)
    if use is None or how.refusals:
        return None
    settings = scene.spectral_tiles
    if how.method == "GATHER" and settings.filter != "AS_CYCLES":
        return f"Spreads every sample by the filter {_name_of(settings, 'filter')}"
    if how.method == "GATHER" and settings.pattern != "AUTO":
        return f"Samples follow the pattern {_name_of(settings, 'pattern')}"
    return {
        "CYCLES": "Leaves this frame to Cycles",
        "ROUNDS": "Takes more samples where this frame is noisy, if that is worth it",
        "GATHER": f"Optimized for {noise_sources(use)}",
        "SUB_FRAMES": _sub_frames_sentence(scene, layer),
    }[how.method]


def _sub_frames_sentence(scene, layer):
    count = frame.moments(scene, layer)
    if count == 1:
        return "Renders the frame itself, for Motion Blur is off"
    if scene.spectral_tiles.pattern != "AUTO":
        return f"Renders moments and places of the pattern {_name_of(scene.spectral_tiles, 'pattern')} one by one"
    return f"Renders {count} moments of the shutter one by one"


def _name_of(settings, prop):
    """The chosen item of an enumeration, as the panel calls it."""
    if prop == "pattern" and settings.pattern == "FILE":
        return os.path.basename(settings.pattern_path)
    return settings.bl_rna.properties[prop].enum_items[getattr(settings, prop)].name


def noise_sources(use):
    """What the noise of a frame comes from, such as "motion blur, depth of field, direct light"."""
    light = " and ".join(word for word, is_there in (("direct", use.lights), ("indirect", use.bounces)) if is_there)
    present = (use.motion_blur and "motion blur", use.lens and "depth of field", light and f"{light} light")
    return ", ".join(filter(None, present)) or "what is left of noise"


@bpy.app.handlers.persistent
def _forget(*_):
    _found.clear()


# Whatever may change what is remembered.
_HANDLERS = (bpy.app.handlers.depsgraph_update_post, bpy.app.handlers.frame_change_post, bpy.app.handlers.load_post)


def register():
    for handlers in _HANDLERS:
        handlers.append(_forget)


def unregister():
    for handlers in _HANDLERS:
        handlers.remove(_forget)
    _forget()
