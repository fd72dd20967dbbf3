# SPDX-License-Identifier: GPL-3.0-or-later
"""The GATHER driver: one Cycles render whose pixels serve other film pixels, then every pass put back in order.

Cycles' random numbers are a function of the render pixel.  A plan (`addon.plan`) says which film pixel each render
pixel should serve, so that the numbers Cycles will draw there suit it; an OSL camera (`addon.camera`) sends the rays
there; Cycles does the rest in a single call.
"""

import itertools
import os
import tempfile
from collections.abc import Callable
from dataclasses import dataclass

import bpy
import numpy as np
from cycles import engine as cycles

from . import (
    adaptive,
    automatic,
    camera,
    control_variates,
    denoising,
    display,
    driver,
    failure,
    film,
    layers,
    library,
    persistence,
    shading,
    tile_plan,
)
from .analysis import scene_use
from .failure import Refused
from .plan import Plan
from .reconstruction import Filter, Reconstruction, positions
from .region import Region, bands

# Cycles' Depth where nothing was hit (kernel/film, pass accessor).
_NO_DEPTH = 1e10

# Cycles renders larger pictures in tiles whatever its settings say (`TileManager::MAX_TILE_SIZE`).
LARGEST = 8192

# Cycles' pass with the number of samples that each pixel got.
_SAMPLE_COUNT = "Debug Sample Count"

# Between the seeds of a picture's two plans, beyond any animation's.
_APART = 1 << 30

# File names of a plan's image; those that belong to the second plan begin with another word.
_PLAN, _EXTRA = "plan.tif", "extra_"


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
    extra_plan : Plan or None
        For the extra samples of the highest level.
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
    extra_plan: Plan | None
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
            "switch the pass off, or render it with Cycles"
        )
    if layer.use_pass_mist and getattr(scene.camera and scene.camera.data, "type", "") == "ORTHO":
        raise Refused(
            f'The Mist pass of view layer "{layer.name}" cannot be rendered with Spectral Tiles and an orthographic '
            "camera; switch the pass off, or render it with Cycles"
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
            "switch Camera Culling and Distance Culling off (Simplify), or render with Cycles"
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
    for check in CHECKS:
        check(scene, layer)
    shading.check(depsgraph, scene.camera)
    views = camera.views(engine, scene)
    region = Region.of_render(scene.render)
    use = scene_use(depsgraph)
    seed, frame = driver.seed_and_frame(scene)
    rates, choose_levels = _rates(settings)
    tile = library.tile(settings, scene.library, use.dims)
    if tile is None and use.is_direct and use.dims and settings.samples == 1:
        # Nothing but the tile's own dimensions is left to chance, and the rest need not be spared.
        tile = library.spectral(use.dims)

    def plan_of(samples, own_seed, cycles_seed):
        if tile is None:
            return automatic.make(use, region, samples, own_seed, frame, engine.test_break)
        dims = tuple(name for name in use.dims if name in tile.dims)
        return tile_plan.make(tile, dims, region, samples, cycles_seed, engine.test_break)

    engine.update_stats("", "Planning samples")
    sample_plan = plan_of(settings.samples, settings.seed, seed)
    if sample_plan.miss:
        engine.report({"INFO"}, f"Cycles' numbers miss the tile's by, on average: {sample_plan.miss}")
    extra_plan = plan_of(rates.extra, settings.seed ^ _APART, seed ^ _APART) if choose_levels else None

    if layer.use_pass_z:
        engine.add_pass("Position", 3, "XYZ", layer=layer.name)
    denoise = denoising.prepare(engine, scene, layer)
    folder = tempfile.TemporaryDirectory(prefix="spectral_tiles_", dir=bpy.app.tempdir)
    image = os.path.join(folder.name, _PLAN)
    sample_plan.write(image)
    if extra_plan:
        extra_plan.write(os.path.join(folder.name, _EXTRA + _PLAN))
    facts = layers.facts(scene, layer.name, tile, sample_plan, seed, settings.samples)
    before = [(owner, persistence.values(owner)) for owner in (scene.cycles, *camera.written(views))]
    _set_sampling(scene.cycles, settings.samples, sample_plan.seed)
    camera.replace(scene, views, region, image)
    without_noise = None
    if wants_less_noise(scene):
        without_noise = control_variates.of_picture(use, automatic.drawn(sample_plan, region, settings.samples))
    return Job(
        region=region,
        plan=sample_plan,
        scene=depsgraph.scene,
        layer=depsgraph.view_layer,
        views=views,
        seed=seed,
        rates=rates,
        choose_levels=choose_levels,
        extra_plan=extra_plan,
        filter=driver.chosen_filter(settings),
        without_noise=without_noise,
        denoise=denoise,
        folder=folder,
        before=before,
        facts=facts,
    )


def wants_less_noise(scene):
    """Whether noise that is known may be taken out of a picture of this scene."""
    settings = scene.spectral_tiles
    # Whoever chose a tile wants to see what it does, and layers of a picture are merged by their samples alone.
    return settings.control_variates and settings.tile == "AUTO" and not scene.cycles.use_sample_subset


def _rates(settings):
    """Samples of a pixel at each level, and what chooses between these (see `Job`)."""
    samples = settings.samples
    if settings.adaptive == "THRESHOLD":
        threshold = settings.adaptive_threshold
        rates = adaptive.rates_over_threshold(samples)
        return rates, lambda picture: adaptive.levels_over_threshold(picture, threshold)
    if settings.adaptive == "BUDGET" and samples > 1:
        rates = adaptive.rates_in_budget(samples)
        return rates, lambda picture: adaptive.levels_in_budget(picture, rates)
    return adaptive.Rates(samples, samples, 0), None


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
    # Cycles' own tiles reach the result only when all layers are done, so there shall be one.
    settings.tile_size = LARGEST
    # Cycles' denoiser would see pixels out of order: `addon.denoising` calls it once they are in order.
    settings.use_denoising = False


def render(engine, depsgraph, job):
    """Run Cycles on a prepared render, put the pixels in order and filter them."""
    try:
        cameras = {view.camera: view.settings for view in job.views.values()}
        with job.folder, camera.dicing(engine, depsgraph.scene_eval, cameras):
            if job.filter or job.choose_levels:
                passes = _in_parts(engine, depsgraph, job)
            else:
                engine.shown = display.InOrder(job.region, job.plan)
                passes = _rendered(engine, depsgraph, job, job.plan)
                # A cancelled picture has not all of the samples whose numbers are known.
                if not engine.test_break():
                    passes = without_noise(job, passes, 0, job.rates.base)
        finish(engine, job, passes)
    finally:
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


def _rendered(engine, depsgraph, job, plan):
    """One Cycles render: its passes with the pixels in order."""
    cycles.render(engine, depsgraph)
    if max(job.region.size) > LARGEST:
        cycles.render_frame_finish(engine)  # puts the tiles together
    passes = film.read_passes(engine, job.layer.name)
    width, height = job.region.size
    for (name, view), depth in passes.items():
        if name == "Depth":
            # A custom camera's Depth is a distance from the camera; only positions tell the depth along its axis.
            for band in bands(height):
                part = slice(band.start * width, band.stop * width)
                hit = depth[part, 0] < _NO_DEPTH
                depth[part][hit, 0] = job.views[view].depth(passes["Position", view][part][hit])
    for key in passes:
        passes[key] = film.scatter(passes[key], plan.film)
    return passes


def without_noise(job, passes, first, count):
    """Passes of a picture without the noise that Cycles' known numbers explain."""
    if job.without_noise is None or count > control_variates.MOST_SAMPLES:
        return passes
    width, height = job.region.size
    # The first view's; Cycles' numbers in the others are not those of the plan.
    _, view = next(iter(passes))
    lit = {key: pixels for key, pixels in passes.items() if key[1] == view}
    planes = job.without_noise(film.colours(lit, height, width), first, count)
    return passes | film.with_colours(lit, planes)


def _in_parts(engine, depsgraph, job):
    """Several Cycles renders: colours of each go through the filter, data are those of the first."""
    width, height = job.region.size
    rates = job.rates
    everywhere = np.ones((height, width), bool)
    levels = np.zeros((height, width), np.int8)
    shots = _shots(job, 0, rates.base)
    parts = (_part(engine, depsgraph, job, job.plan, *shot, everywhere) for shot in shots)
    if job.choose_levels:
        parts = list(parts)
        combined = [film.combined(passes | denoising.noisy(passes)) for passes, _, _ in parts]
        picture = np.mean(combined, axis=0)
        levels = job.choose_levels(picture.reshape(height, width, 4))
        engine.shown = display.Picture(job.region, picture)
    count = rates.counts[levels].astype(np.float32)
    base_weight = rates.base_weight[levels]
    total = count - rates.base * (1.0 - base_weight)
    parts = itertools.chain(
        ((passes, where, share * base_weight, shot) for (passes, where, share), shot in zip(parts, shots, strict=True)),
        ((*part, None) for part in _further_parts(engine, depsgraph, job, levels)),
    )

    first, sums = None, None
    for passes, where, share, shot in parts:
        if first is not None and engine.test_break():
            break
        colours = film.colours(passes, height, width)
        if shot and job.without_noise:
            # Samples that further ones complete cancel some of their noise by themselves.
            less = film.colours(without_noise(job, passes, *shot), height, width)
            colours = np.where(levels == 0, less, colours)
        if first is None:
            first = passes
            sums = Reconstruction(job.filter or Filter("BOX", 1.0), len(colours), height, width)
        sums.add(colours, where, share / total)
    passes = film.with_colours(first, sums.pixels())
    return passes | {key: count.reshape(-1, 1) for key in passes if key[0] == _SAMPLE_COUNT}


def _further_parts(engine, depsgraph, job, levels):
    """Parts beyond the base: pixels of level 1 complete their block, those of level 2 take a larger one."""
    base, whole, extra = job.rates.base, job.rates.whole, job.rates.extra
    blocks = [(1, job.plan, base, whole - base), (2, job.extra_plan, 0, extra)]
    for level, plan, first, count in blocks:
        taken = levels == level
        if count and taken.any():
            for shot in _shots(job, first, count):
                yield _part(engine, depsgraph, job, plan, *shot, taken)


def _shots(job, first, count):
    """Parts of the sequence, as (first sample, count), that are rendered at once: for a filter one by one."""
    return [(sample, 1) for sample in range(first, first + count)] if job.filter else [(first, count)]


def _part(engine, depsgraph, job, plan, first, count, taken):
    """One Cycles render of some samples at some pixels: passes, where in the pixel they lie, samples of each pixel."""
    is_extra = plan is job.extra_plan
    # The second plan's samples come after the base.
    where = positions(job.region, first + job.rates.base * is_extra, job.seed)
    prefix = _EXTRA * is_extra
    image = os.path.join(job.folder.name, f"{prefix}positions_{first}.tif")
    plan.write_positions(image, where if job.filter else None, taken)
    scene = depsgraph.scene_eval
    for view in job.views.values():
        view.camera.data.cycles_custom["plan"] = os.path.join(job.folder.name, prefix + _PLAN)
        view.camera.data.cycles_custom["positions"] = image
    set_samples(scene.cycles, job.rates.extra if is_extra else job.rates.whole)
    scene.cycles.seed = plan.seed
    scene.cycles.use_sample_subset = True
    scene.cycles.sample_offset = first
    scene.cycles.sample_subset_length = count
    if taken.all():  # else the picture that is shown is better
        engine.shown = display.InOrder(job.region, plan)
    return _rendered(engine, depsgraph, job, plan), where, count * taken.astype(np.float32)
