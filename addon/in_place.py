# SPDX-License-Identifier: GPL-3.0-or-later
"""The IN_PLACE driver: Cycles' own render, pixels where they are, and known noise taken out afterwards.

Nothing is planned and nobody aims the camera, so it costs little beside Cycles' render and takes any camera and device
that Cycles has.  Samples that are arranged (`addon.gather`) complement each other better: most where the lens makes the
noise, and from several samples a pixel on.
"""

from collections.abc import Callable
from dataclasses import dataclass

import bpy

from . import (
    automatic,
    control_variates,
    denoising,
    driver,
    film,
    in_order,
    layer_noise,
    layers,
    main_thread,
    persistence,
)
from .analysis import scene_use
from .failure import Refused
from .plan import Plan
from .region import Region


@dataclass(frozen=True)
class Job:
    """A prepared render.

    Attributes
    ----------
    region : Region
    scene : bpy.types.Scene
    layer : bpy.types.ViewLayer
        The original ones.
    samples : int
        Of a pixel.
    without_noise : callable or None
        Of `control_variates.of_picture`; None leaves the noise in.
    denoise : bool
        Whether the result is to be denoised.
    before : dict
        Evaluated settings of Cycles as they were.
    facts : dict of str to str
        What the picture should say of the render (`addon.layers`).
    """

    region: Region
    scene: bpy.types.Scene
    layer: bpy.types.ViewLayer
    samples: int
    without_noise: Callable | None
    denoise: bool
    before: dict
    facts: dict


def suits(settings):
    """Whether Cycles' own samples are what the settings ask for: no tile's, not filtered, as many everywhere."""
    return settings.tile == "AUTO" and settings.filter == "AS_CYCLES" and settings.adaptive == "OFF"


def _check_settings(scene, layer):
    if not suits(scene.spectral_tiles):
        raise Refused(
            "The driver In Place takes Cycles' own samples; "
            "set Tile to Automatic, Filter to As Cycles and Adaptive to Off, or choose another driver"
        )


def _check_camera(scene, layer):
    if scene.camera is None:
        raise Refused("Cannot render, no camera in the scene")


# Each raises `Refused` if a scene's view layer cannot be rendered this way.  The panel asks them all beforehand.
CHECKS = (_check_settings, _check_camera, denoising.check)


def prepare(engine, data, depsgraph):
    """Make the evaluated scene take samples whose numbers are known.

    Parameters
    ----------
    engine : bpy.types.RenderEngine
    data : bpy.types.BlendData
    depsgraph : bpy.types.Depsgraph

    Returns
    -------
    Job

    Raises
    ------
    Refused
        The scene cannot be rendered this way.
    """
    scene, layer = depsgraph.scene_eval, depsgraph.view_layer_eval
    settings = scene.spectral_tiles
    region = Region.of_render(scene.render)
    use = scene_use(depsgraph)
    seed, frame = driver.seed_and_frame(scene)
    plan = Plan.in_place(seed, region)
    is_whole = layers.is_whole(scene)
    added = [] if is_whole else film.add_divisors(engine, layer)
    without_noise, noise = None, ""
    if driver.takes_out_noise(settings):
        if is_whole:
            drawn = automatic.drawn(plan, region, settings.samples)
            without_noise = control_variates.of_picture(use, drawn)
        else:
            noise = layer_noise.described(use, region, settings, frame, "IN_PLACE", added)
    job = Job(
        region=region,
        scene=depsgraph.scene,
        layer=depsgraph.view_layer,
        samples=settings.samples,
        without_noise=without_noise,
        denoise=denoising.prepare(engine, scene, layer),
        before=persistence.values(scene.cycles),
        facts=layers.facts(scene, layer.name, None, plan, seed, settings.samples, noise),
    )
    main_thread.run(lambda: in_order.set_sampling(scene.cycles, settings.samples, plan.seed), engine)
    return job


def render(engine, depsgraph, job):
    """Run Cycles on a prepared render, and take out known noise."""
    cycles_settings = depsgraph.scene_eval.cycles
    try:
        passes = in_order.as_rendered(engine, depsgraph, job)
        in_order.finish(engine, job, in_order.without_noise(engine, job, passes, 0, job.samples))
    finally:
        if persistence.is_kept(engine):
            main_thread.run(lambda: persistence.put_back(cycles_settings, job.before), engine)
