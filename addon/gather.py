# SPDX-License-Identifier: GPL-3.0-or-later
"""The GATHER driver: one Cycles render whose pixels serve other film pixels, then every pass put back in order.

Cycles' random numbers are a function of the render pixel.  A plan (`addon.plan`) says which film pixel each render
pixel should serve, so that the numbers Cycles will draw there suit it; an OSL camera (`addon.camera`) sends the rays
there; Cycles does the rest in a single call.
"""

import os
import tempfile
from dataclasses import dataclass

import bpy
from cycles import engine as cycles

from . import automatic, camera, denoising, driver, failure, film, layers, library, persistence, shading, tile_plan
from .analysis import scene_use
from .failure import Refused
from .plan import Plan
from .reconstruction import Filter, Reconstruction, positions
from .region import Region

# Cycles' Depth where nothing was hit (kernel/film, pass accessor).
_NO_DEPTH = 1e10


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
    samples, seed : int
        As the user set them; the seed may follow the frame.
    filter : Filter or None
        What samples are spread by; None leaves that to Cycles.
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
    samples: int
    seed: int
    filter: Filter | None
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
            "switch the pass off, or render it with Cycles"
        )
    if layer.use_pass_mist and scene.camera is not None and scene.camera.data.type == "ORTHO":
        raise Refused(
            f'The Mist pass of view layer "{layer.name}" cannot be rendered with Spectral Tiles and an orthographic '
            "camera; switch the pass off, or render it with Cycles"
        )


def _check_subset(scene, layer):
    if scene.cycles.use_sample_subset and scene.spectral_tiles.filter != "AS_CYCLES":
        raise Refused("Samples of a subset cannot be filtered; set Filter to As Cycles, or switch the subset off")


# Each raises `Refused` if a scene's view layer cannot be rendered this way.  The panel asks them all beforehand.
CHECKS = (_check_build, _check_device, _check_camera, _check_passes, _check_subset, library.check, denoising.check)


def prepare(engine, depsgraph):
    """Make the evaluated scene follow a plan; the user's scene is not touched.

    Parameters
    ----------
    engine : bpy.types.RenderEngine
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
    for check in CHECKS:
        check(scene, layer)
    shading.check(depsgraph, scene.camera)
    views = camera.views(engine, scene)
    region = Region.of_render(scene.render)
    use = scene_use(depsgraph)
    seed = settings.seed + (scene.frame_current if scene.cycles.use_animated_seed else 0)
    tile = library.tile(settings, scene.library)
    if tile is None:
        frame = scene.frame_current if scene.cycles.use_animated_seed else None
        sample_plan = automatic.make(use, region, settings.samples, settings.seed, frame)
    else:
        dims = tuple(name for name in use.dims if name in tile.dims)
        sample_plan = tile_plan.make(tile, dims, region, settings.samples, seed)

    if layer.use_pass_z:
        engine.add_pass("Position", 3, "XYZ", layer=layer.name)
    denoise = denoising.wanted(scene, layer)
    if denoise:
        denoising.add_passes(engine, layer)
    folder = tempfile.TemporaryDirectory(prefix="spectral_tiles_", dir=bpy.app.tempdir)
    image = os.path.join(folder.name, "plan.tif")
    sample_plan.write(image)
    facts = layers.facts(scene, layer.name, tile, sample_plan, seed, settings.samples)
    before = [(owner, persistence.values(owner)) for owner in (scene.cycles, *camera.written(views))]
    _set_sampling(scene.cycles, settings.samples, sample_plan.seed)
    camera.replace(scene, views, region, image)
    chosen = None
    if settings.filter != "AS_CYCLES":
        chosen = Filter(settings.filter, settings.filter_width, settings.filter_b, settings.filter_c)
        # One at a time, but of the same sequence.
        scene.cycles.use_sample_subset = True
        scene.cycles.sample_subset_length = 1
    return Job(
        region=region,
        plan=sample_plan,
        scene=depsgraph.scene,
        layer=depsgraph.view_layer,
        views=views,
        samples=settings.samples,
        seed=seed,
        filter=chosen,
        denoise=denoise,
        folder=folder,
        before=before,
        facts=facts,
    )


def ignored(scene):
    """Settings of Cycles that are in force in this scene but not under this engine (`set_samples`).

    Returns
    -------
    list of str
        A line for each, with the way out.
    """
    settings = scene.cycles
    lines = []
    if settings.use_adaptive_sampling:
        lines.append("Noise Threshold does not apply: every pixel gets the same Samples")
    if settings.time_limit > 0.0:
        lines.append("Time Limit does not apply: choose Samples to fit")
    if settings.use_layer_samples != "IGNORE" and any(layer.samples for layer in scene.view_layers):
        lines.append("Samples of view layers do not apply: all layers get the same Samples")
    return lines


def set_samples(settings, samples):
    """Make Cycles take exactly this many samples in every pixel of every layer."""
    settings.samples = samples
    settings.use_adaptive_sampling = False
    settings.use_layer_samples = "IGNORE"
    settings.time_limit = 0.0


def _set_sampling(settings, samples, seed):
    """Make Cycles draw the numbers that the plan counts on, in one go."""
    set_samples(settings, samples)
    settings.sampling_pattern = "BLUE_NOISE"
    settings.seed = seed
    settings.use_animated_seed = False
    # Cycles' own tiles reach the result only when all layers are done, and its denoiser would see pixels out of order
    # (`addon.denoising` calls it once they are in order).
    settings.use_auto_tile = False
    settings.use_denoising = False


def render(engine, depsgraph, job):
    """Run Cycles on a prepared render, put the pixels in order and filter them."""
    with job.folder:
        passes = _rendered(engine, depsgraph, job) if job.filter is None else _filtered(engine, depsgraph, job)
    finish(engine, job, passes)
    if persistence.is_kept(engine):
        for owner, values in job.before:
            persistence.put_back(owner, values)


def finish(engine, job, passes):
    """Denoise the passes of a picture, if its scene says so, and make them the result."""
    if job.denoise:
        passes |= denoising.noisy(passes)
    film.write_passes(engine, job.region, job.layer.name, passes)
    if job.denoise and not engine.test_break():
        engine.update_stats("", "Denoising")
        try:
            passes |= denoising.denoise(job.scene, job.layer, job.region, passes)
        except failure.Refused as refused:
            failure.report(engine, str(refused))
        film.write_passes(engine, job.region, job.layer.name, passes)
    layers.stamp(engine, job.facts)


def _rendered(engine, depsgraph, job):
    """One Cycles render: its passes with the pixels in order."""
    cycles.render(engine, depsgraph)
    passes = film.read_passes(engine, job.layer.name)
    for (name, view), depth in passes.items():
        if name == "Depth":
            # A custom camera's Depth is a distance from the camera; only positions tell the depth along its axis.
            hit = depth[:, 0] < _NO_DEPTH
            depth[hit, 0] = job.views[view].depth(passes["Position", view][hit])
    return {key: film.scatter(pixels, job.plan.film) for key, pixels in passes.items()}


def _filtered(engine, depsgraph, job):
    """Spread each sample over the pixels around it: colours by one render a sample, data of the first alone."""
    scene = depsgraph.scene_eval
    width, height = job.region.size
    for sample in range(job.samples):
        if sample and engine.test_break():
            break
        where = positions(job.region, sample, job.seed)
        image = os.path.join(job.folder.name, f"positions_{sample}.tif")
        job.plan.write_positions(image, where)
        for view in job.views.values():
            view.camera.data.cycles_custom["positions"] = image
        scene.cycles.sample_offset = sample
        passes = _rendered(engine, depsgraph, job)
        colours = film.colours(passes, height, width)
        if sample == 0:
            first = passes
            sums = Reconstruction(job.filter, len(colours), height, width)
        sums.add(colours, where, 1.0 / job.samples)
    return film.with_colours(first, sums.pixels())
