# SPDX-License-Identifier: GPL-3.0-or-later
"""The drivers, and which of them renders a scene."""

from . import driver, gather, in_place, shading, subrender
from .failure import Refused

_BY_NAME = {"GATHER": gather, "IN_PLACE": in_place, "SUBRENDER": subrender}


def chosen(scene, layer, shading_refusals):
    """The driver that the settings ask for, or else the one that serves a view layer best.

    Samples are moved where that can be done, and stay in place where it cannot.

    Parameters
    ----------
    scene : bpy.types.Scene
    layer : bpy.types.ViewLayer
    shading_refusals : callable
        As `refusals` takes it.

    Returns
    -------
    module : module
        With `CHECKS`, `prepare`, `render` and `Job`.
    messages : list of str
        Of `refusals`.
    """
    for module in _candidates(scene):
        messages = refusals(module, scene, layer, shading_refusals)
        if not messages:
            break
    return module, messages


def _candidates(scene):
    """The drivers that may render a scene, the best one first."""
    settings = scene.spectral_tiles
    if settings.driver != "AUTO":
        return [_BY_NAME[settings.driver]]
    moving = subrender if driver.why_not_gather(scene) else gather
    return [moving, in_place] if in_place.suits(settings) else [moving]


def refusals(module, scene, layer, shading_refusals):
    """Why a driver will not render a view layer: one message a reason, none if it will.

    Parameters
    ----------
    module : module
        Of the driver.
    scene : bpy.types.Scene
    layer : bpy.types.ViewLayer
    shading_refusals : callable
        Messages, none or one, that say what is wrong with the shading (`shading.check`).

    Returns
    -------
    list of str
    """
    messages = [message for check in module.CHECKS for message in refused(check, scene, layer)]
    # Shading is looked at for a camera that is one, so only after the others.
    return messages or ([] if module is in_place else shading_refusals())


def refused(check, *arguments):
    """What a check says against something, in a list; an empty one if nothing."""
    try:
        check(*arguments)
    except Refused as reason:
        return [str(reason)]
    return []


def prepare(engine, data, depsgraph):
    """Have the chosen driver prepare a render; returns its job, raises `Refused` if the scene cannot be rendered."""
    scene, layer = depsgraph.scene_eval, depsgraph.view_layer_eval
    module, messages = chosen(scene, layer, lambda: refused(shading.check, depsgraph, scene.camera))
    if messages:
        raise Refused(messages[0])
    return module.prepare(engine, data, depsgraph)


def render(engine, depsgraph, job):
    """Have the driver that prepared it render a job."""
    module = next(module for module in _BY_NAME.values() if isinstance(job, module.Job))
    module.render(engine, depsgraph, job)
