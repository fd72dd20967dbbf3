# SPDX-License-Identifier: GPL-3.0-or-later
"""What a render of the scene will do, told before it is rendered."""

import math

import bpy
from bpy_extras.anim_utils import animdata_get_channelbag_for_assigned_slot

from . import (
    adaptive,
    analysis,
    automatic,
    driver,
    drivers,
    gather,
    in_place,
    library,
    persistence,
    progress,
    shading,
    subrender,
)
from .plan import LARGE, memory
from .region import Region

# Bytes that a render takes beyond Cycles' own, without further passes: what work in parts takes at most, and of each
# pixel (`python -m bench times` at 640x360, 1920x1080, 3840x2160 and 8192x8192: 88, 286, 398 and 2350 MB).  And where
# several renders are mixed (adaptive with a filter, 2 spp, 1920x1080 and 3840x2160: 1024 and 2347 MB).
_PARTS, _BYTES = 200e6, 32
_PARTS_MIXED, _BYTES_MIXED = 500e6, 250

# Properties of a perspective camera that Cycles' own motion blur follows, but that of a custom camera does not.
_OF_VIEW = {"lens", "angle", "angle_x", "angle_y", "sensor_width", "sensor_height"}

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
    analysis.SceneUse or None
        None as long as the view layer was never evaluated.
    """
    depsgraph = layer.depsgraph
    if depsgraph is None:
        return None
    return analysis.scene_use(depsgraph, _remembered(_emitters, depsgraph, analysis.emitters))


def uses(scene, layer):
    """What the scene's noise comes from and what is done about it; None as `scene_use`.

    Returns
    -------
    str or None
        Such as "Motion blur, lens and 3 lights: using tile full-1".
    """
    use = scene_use(layer)
    if use is None or not use.dims:
        return use and sentence(use)
    name = library.name(scene.spectral_tiles, use.dims)
    arranged = "" if _driver(scene, layer) is in_place else ", arranged for these"
    how = f"using tile {name}" if name else f"using Cycles' own samples{arranged}"
    return f"{sentence(use)}: {how}"


def sentence(use):
    """An `analysis.SceneUse` in words."""
    lights = f"{use.lights} light{'s' if use.lights > 1 else ''}"
    present = (
        (use.motion_blur, "motion blur"),
        (use.lens, "lens"),
        (use.lights, lights),
        (use.bounces, "indirect light"),
    )
    words = [word for is_there, word in present if is_there]
    if not words:
        return "Nothing that makes noise"
    text = " and ".join(filter(None, (", ".join(words[:-1]), words[-1])))
    return text[0].upper() + text[1:]


def _driver(scene, layer):
    return drivers.chosen(scene, layer, lambda: _shading_refusals(scene, layer))[0]


def _shading_refusals(scene, layer):
    """As `drivers.refusals` takes them; nothing is wrong as long as the view layer was never evaluated."""
    if layer.depsgraph is None:
        return []
    return _remembered(_shading, layer.depsgraph, lambda found: drivers.refused(shading.check, found, scene.camera))


def render_calls(scene, layer):
    """Which driver renders a frame and why, and how it will call Cycles."""
    is_free = scene.spectral_tiles.driver == "AUTO"
    chosen = _driver(scene, layer)
    if chosen is in_place:
        calls = ["In Place: one Cycles render, known noise taken out afterwards"]
        if is_free:
            reasons = drivers.refusals(gather, scene, layer, lambda: _shading_refusals(scene, layer))
            calls += [reason.partition(";")[0] for reason in reasons]
        return ". ".join(calls)
    if chosen is gather:
        renders = "several Cycles renders" if persistence.needed(scene) else "one Cycles render"
        why = ", the faster driver" if is_free else ""
        return f"Gather{why}: {renders}, pixels put in order afterwards"
    calls = (
        f"Sub-renders: {subrender.sub_renders(scene):,} small Cycles renders, one for each cell of the tile and sample"
    )
    if adaptive.rates_of(scene.spectral_tiles).larger:
        calls += "; then several times as many, smaller ones where the picture needs more"
    return f"{calls}. {driver.why_not_gather(scene)}" if is_free else calls


def overhead(scene, layer):
    """What a frame costs beyond Cycles' own render of it, in one sentence."""
    chosen = _driver(scene, layer)
    if chosen is subrender:
        count, pace = subrender.sub_renders(scene), progress.Progress.pace
        if pace is None or adaptive.rates_of(scene.spectral_tiles).larger:
            return f"Takes {progress.duration(max(1.0, count * (pace or progress.LEAST)))} at least"
        return f"Takes about {progress.duration(count * pace)} if each takes as long as the last ones did"
    pixels = Region.of_render(scene.render).pixels
    parts, each = (_PARTS_MIXED, _BYTES_MIXED) if persistence.needed(scene) else (_PARTS, _BYTES)
    memory_used = f"up to {math.ceil((parts + pixels * each) / 1e7)}0 MB of memory"
    if chosen is in_place:
        return f"Adds little time, and {memory_used}"
    is_large = pixels > LARGE
    seconds = round(pixels * memory.pace)
    time = f"about {progress.duration(seconds)}" if seconds else "less than a second"
    once = "a frame"
    if is_large:
        in_groups = scene.spectral_tiles.animated_seed and scene.spectral_tiles.tile == "AUTO"
        once = f"for each of the first {automatic.GROUP} frames" if in_groups else "once for frames of this size"
    return f"Adds {time} {once}, and {memory_used}"


def refusals(scene, layer):
    """Why this view layer will not be rendered: one message a reason, none if it will be."""
    return drivers.chosen(scene, layer, lambda: _shading_refusals(scene, layer))[1]


def ignored(scene, layer):
    """Settings of Cycles that are in force in this scene but not under this engine.

    Returns
    -------
    list of str
        A line for each, with the way out.
    """
    settings = scene.cycles
    lines = []
    if settings.use_adaptive_sampling:
        lines.append("Noise Threshold does not apply: see Adaptive for sampling by need")
    if settings.time_limit > 0.0:
        lines.append("Time Limit does not apply: choose Samples to fit")
    if settings.use_layer_samples != "IGNORE" and any(layer.samples for layer in scene.view_layers):
        lines.append("Samples of view layers do not apply: all layers get the same Samples")
    if scene.render.use_motion_blur and scene.camera and _zooms(scene.camera) and _driver(scene, layer) is gather:
        lines.append("The animated zoom of the camera does not blur: set Driver to Sub-renders if it should")
    return lines


def _zooms(made):
    """Whether a camera object's field of view is animated."""
    animation = made.type == "CAMERA" and made.data.type == "PERSP" and made.data.animation_data
    if not animation:
        return False
    bag = animdata_get_channelbag_for_assigned_slot(animation)
    curves = [*animation.drivers, *(bag.fcurves if bag else ())]
    return any(curve.data_path in _OF_VIEW for curve in curves)


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
