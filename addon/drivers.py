# SPDX-License-Identifier: GPL-3.0-or-later
"""The drivers, and which of them renders a scene."""

from . import driver, gather, in_place, subrender
from .failure import Refused

_BY_NAME = {"GATHER": gather, "IN_PLACE": in_place, "SUBRENDER": subrender}


def chosen(scene, layer, check_shading):
    """The module of the driver that the settings ask for, or else of the one that serves a view layer best.

    Samples are moved where that can be done, and stay in place where it cannot.

    Parameters
    ----------
    scene : bpy.types.Scene
    layer : bpy.types.ViewLayer
    check_shading : callable
        As `refusals` takes it.

    Returns
    -------
    module
        With `CHECKS`, `prepare`, `render` and `Job`.
    """
    settings = scene.spectral_tiles
    if settings.driver != "AUTO":
        return _BY_NAME[settings.driver]
    moving = subrender if driver.why_not_gather(scene) else gather
    if in_place.suits(settings) and refusals(moving, scene, layer, check_shading):
        return in_place
    return moving


def refusals(module, scene, layer, check_shading):
    """Why a driver will not render a view layer: one message a reason, none if it will.

    Parameters
    ----------
    module : module
        Of the driver.
    scene : bpy.types.Scene
    layer : bpy.types.ViewLayer
    check_shading : callable
        Camera object -> None; raises `Refused` as `shading.check` of the scene does.

    Returns
    -------
    list of str
    """
    messages = []
    for check in module.CHECKS:
        messages += _message(check, scene, layer)
    # Shading is looked at for a camera that is one, so only after the others.
    if not messages and module is not in_place:
        messages += _message(check_shading, scene.camera)
    return messages


def of_job(job):
    """The module of the driver that has prepared a job."""
    return next(module for module in _BY_NAME.values() if isinstance(job, module.Job))


def _message(check, *arguments):
    """What a check says against something, in a list; an empty one if nothing."""
    try:
        check(*arguments)
    except Refused as refused:
        return [str(refused)]
    return []
