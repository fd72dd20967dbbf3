# SPDX-License-Identifier: GPL-3.0-or-later
"""The GATHER driver: one Cycles render whose pixels serve other film pixels, then every pass put back in order.

Cycles' random numbers are a function of the render pixel.  A plan (`addon.plan`) says which film pixel each render
pixel should serve, so that the numbers Cycles will draw there suit it; an OSL camera (`addon.camera`) sends the rays
there; Cycles does the rest in a single call.
"""

import os
import tempfile
from collections.abc import Callable
from dataclasses import dataclass

import bpy

from . import (
    adaptive,
    aperture,
    automatic,
    camera,
    control_variates,
    denoising,
    display,
    driver,
    film,
    in_order,
    layer_noise,
    layers,
    library,
    main_thread,
    persistence,
    several_renders,
    tile_plan,
)
from .analysis import scene_use
from .failure import Refused
from .plan import Plan
from .reconstruction import Filter
from .region import Region


@dataclass(frozen=True)
class Job:
    """A prepared render.

    Attributes
    ----------
    region : Region
    plan : Plan
    scene : bpy.types.Scene
    layer : bpy.types.ViewLayer
        The original ones.  Their evaluated copies may be gone once Cycles has synchronised.
    views : dict of str to camera.View
    seed : int
        As the user set it, or as it follows the frame.
    rates : adaptive.Rates
        Samples of a pixel at each level; the base is all there is without levels.
    choose_levels : callable or None
        Picture at the base rate -> level of each pixel (`addon.adaptive`); None if all get the same.
    filter : Filter or None
        What samples are spread by; None leaves that to Cycles.
    without_noise : callable or None
        Of `control_variates.of_picture`; None leaves the noise in.
    denoise : bool
        Whether the result is to be denoised.
    folder : tempfile.TemporaryDirectory
        Holds the plan's image during the render.
    before : list of (bpy.types.bpy_struct, dict)
        Evaluated data that was written to, as it was.
    facts : dict of str to str
        What the picture should say of the render (`addon.layers`).
    """

    region: Region
    plan: Plan
    scene: bpy.types.Scene
    layer: bpy.types.ViewLayer
    views: dict[str, camera.View]
    seed: int
    rates: adaptive.Rates
    choose_levels: Callable | None
    filter: Filter | None
    without_noise: Callable | None
    denoise: bool
    folder: tempfile.TemporaryDirectory
    before: list
    facts: dict


def _check_build(scene, layer):
    driver.check_build()


def _check_device(scene, layer):
    driver.check_device(scene)


def _check_camera(scene, layer):
    camera.check(scene, scene.camera)


def _check_passes(scene, layer):
    if layer.use_pass_vector and not scene.render.use_motion_blur:
        raise Refused(
            f'The Vector pass of view layer "{layer.name}" cannot be rendered with Spectral Tiles; '
            "switch the pass off, or set Driver to In Place"
        )
    if layer.use_pass_mist and getattr(scene.camera and scene.camera.data, "type", "") == "ORTHO":
        raise Refused(
            f'The Mist pass of view layer "{layer.name}" cannot be rendered with Spectral Tiles and an orthographic '
            "camera; switch the pass off, or set Driver to In Place"
        )


def _check_subset(scene, layer):
    settings = scene.spectral_tiles
    if scene.cycles.use_sample_subset and (settings.filter != "AS_CYCLES" or settings.adaptive != "OFF"):
        raise Refused(
            "A sample subset cannot be filtered or adapted; "
            "set Adaptive to Off and Filter to As Cycles, or switch the subset off"
        )


def _check_culling(scene, layer):
    if scene.render.use_simplify and (scene.cycles.use_camera_cull or scene.cycles.use_distance_cull):
        raise Refused(
            "Culling cannot be done with Spectral Tiles; "
            "switch Camera Culling and Distance Culling off (Simplify), or set Driver to In Place"
        )


# Each raises `Refused` if a scene's view layer cannot be rendered this way.  The panel asks them all beforehand.
CHECKS = (
    _check_build,
    _check_device,
    _check_camera,
    _check_passes,
    _check_subset,
    _check_culling,
    library.check,
    denoising.check,
)


def prepare(engine, data, depsgraph):
    """Make the evaluated scene follow a plan; the user's scene is not touched.

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
    views = camera.views(engine, scene)
    region = Region.of_render(scene.render)
    use = scene_use(depsgraph)
    seed, frame = driver.seed_and_frame(scene)
    rates = adaptive.rates_of(settings)
    choose_levels = adaptive.chooser(settings, adaptive.levels_in_budget, adaptive.levels_over_threshold)
    tile = library.tile(settings, scene.library, use.dims)
    if tile is None and use.is_direct and use.dims and settings.samples == 1:
        # Nothing but the tile's own dimensions is left to chance, and the rest need not be spared.
        tile = library.spectral(use.dims)
    if tile is not None:
        tile = aperture.fitted(tile, use.blades)

    engine.update_stats("", "Planning samples")
    if tile is None:
        sample_plan = automatic.make(use, region, settings.samples, settings.seed, frame, engine.test_break)
    else:
        dims = tuple(name for name in use.dims if name in tile.dims)
        sample_plan = tile_plan.make(tile, dims, region, settings.samples, seed, engine.test_break)
    if sample_plan.miss:
        engine.report({"INFO"}, f"Cycles' numbers miss the tile's by, on average: {sample_plan.miss}")

    if layer.use_pass_z:
        engine.add_pass("Position", 3, "XYZ", layer=layer.name)
    is_whole = layers.is_whole(scene)
    is_mixed = not is_whole or persistence.needed(scene)
    added = film.add_divisors(engine, layer) if is_mixed else []
    denoise = denoising.prepare(engine, scene, layer)
    folder = tempfile.TemporaryDirectory(prefix="spectral_tiles_", dir=bpy.app.tempdir)
    image = os.path.join(folder.name, several_renders.PLAN)
    sample_plan.write(image)
    without_noise, noise = None, ""
    if driver.takes_out_noise(settings):
        if is_whole:
            drawn = automatic.drawn(sample_plan, region, settings.samples)
            without_noise = control_variates.of_picture(use, drawn)
        else:
            noise = layer_noise.described(use, region, settings, frame, "GATHER", added)
    facts = layers.facts(scene, layer.name, tile, sample_plan, seed, settings.samples, noise)
    before = [(owner, persistence.values(owner)) for owner in (scene.cycles, *camera.written(views))]

    def write():
        in_order.set_sampling(scene.cycles, settings.samples, sample_plan.seed)
        camera.replace(scene, views, region, image)

    main_thread.run(write, engine)
    return Job(
        region=region,
        plan=sample_plan,
        scene=depsgraph.scene,
        layer=depsgraph.view_layer,
        views=views,
        seed=seed,
        rates=rates,
        choose_levels=choose_levels,
        filter=driver.chosen_filter(settings),
        without_noise=without_noise,
        denoise=denoise,
        folder=folder,
        before=before,
        facts=facts,
    )


def render(engine, depsgraph, job):
    """Run Cycles on a prepared render, put the pixels in order and filter them."""
    try:
        cameras = {view.camera: view.settings for view in job.views.values()}
        with job.folder, camera.dicing(engine, depsgraph.scene_eval, cameras):
            if job.choose_levels:
                passes = several_renders.adapted(engine, depsgraph, job)
            elif job.filter:
                passes = several_renders.filtered(engine, depsgraph, job)
            else:
                engine.shown = display.InOrder(job.region, job.plan)
                passes = in_order.rendered(engine, depsgraph, job)
                passes = in_order.without_noise(engine, job, passes, 0, job.rates.base)
        in_order.finish(engine, job, passes)
    finally:

        def put_back():
            for owner, values in job.before:
                persistence.put_back(owner, values)

        if persistence.is_kept(engine):
            main_thread.run(put_back, engine)
