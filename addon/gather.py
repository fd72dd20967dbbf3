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
    spots,
    tile_plan,
)
from .analysis import scene_use
from .failure import Refused
from .plan import Plan
from .reconstruction import Filter, Reconstruction, by_importance, positions
from .region import Region, bands

# Cycles' Depth where nothing was hit (kernel/film, pass accessor).
_NO_DEPTH = 1e10

# Cycles renders larger pictures in tiles whatever its settings say (`TileManager::MAX_TILE_SIZE`).
LARGEST = 8192

# Cycles' pass with the number of samples that each pixel got.
_SAMPLE_COUNT = "Debug Sample Count"

# Between the seeds of the plan and of the spots that get extra samples, beyond any animation's.
_APART = 1 << 30

# File name of the plan's image for the camera.
_PLAN = "plan.tif"


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
        Of `control_variates.of_picture`, or `adaptive.Cleaner` if there are levels; None leaves the noise in.
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
    without_noise: Callable | adaptive.Cleaner | None
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
    denoise = denoising.prepare(engine, scene, layer)
    folder = tempfile.TemporaryDirectory(prefix="spectral_tiles_", dir=bpy.app.tempdir)
    image = os.path.join(folder.name, _PLAN)
    sample_plan.write(image)
    facts = layers.facts(scene, layer.name, tile, sample_plan, seed, settings.samples)
    before = [(owner, persistence.values(owner)) for owner in (scene.cycles, *camera.written(views))]
    _set_sampling(scene.cycles, settings.samples, sample_plan.seed)
    camera.replace(scene, views, region, image)
    without_noise = None
    if wants_less_noise(scene):
        drawn = automatic.drawn(sample_plan, region, settings.samples)
        if choose_levels is None:
            without_noise = control_variates.of_picture(use, drawn)
        else:
            without_noise = adaptive.Cleaner.of_picture(use, drawn, rates)
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
            if job.choose_levels:
                passes = _adapted(engine, depsgraph, job)
            elif job.filter:
                passes = _filtered(engine, depsgraph, job)
            else:
                engine.shown = display.InOrder(job.region, job.plan)
                passes = _rendered(engine, depsgraph, job)
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


def _rendered(engine, depsgraph, job):
    """One Cycles render by the plan: its passes with the pixels in order."""
    passes = _passes(engine, depsgraph, job)
    width, height = job.region.size
    for (name, view), depth in passes.items():
        if name == "Depth":
            # A custom camera's Depth is a distance from the camera; only positions tell the depth along its axis.
            for band in bands(height):
                part = slice(band.start * width, band.stop * width)
                hit = depth[part, 0] < _NO_DEPTH
                depth[part][hit, 0] = job.views[view].depth(passes["Position", view][part][hit])
    for key in passes:
        passes[key] = film.scatter(passes[key], job.plan.film)
    return passes


def _passes(engine, depsgraph, job):
    """One Cycles render: its passes as they are."""
    cycles.render(engine, depsgraph)
    if max(job.region.size) > LARGEST:
        cycles.render_frame_finish(engine)  # puts the tiles together
    return film.read_passes(engine, job.layer.name)


def without_noise(job, passes, first, count):
    """Passes of a picture without the noise that Cycles' known numbers explain."""
    if job.without_noise is None or count > control_variates.MOST_SAMPLES:
        return passes
    return _cleaned(job, passes, lambda planes: job.without_noise(planes, first, count))


def _cleaned(job, passes, clean):
    """Passes with the planes of their colours as a function makes them."""
    width, height = job.region.size
    # The first view's; Cycles' numbers in the others are not those of the plan.
    _, view = next(iter(passes))
    lit = {key: pixels for key, pixels in passes.items() if key[1] == view}
    return passes | film.with_colours(lit, clean(film.colours(lit, height, width)))


def _filtered(engine, depsgraph, job):
    """A Cycles render for each sample: colours of each go through the filter, data are those of the first."""
    first, sums = None, None
    for sample in range(job.rates.base):
        if first and engine.test_break():
            break
        ((passes, where, share),) = _of_plan(engine, depsgraph, job, sample, 1, _everywhere(job))
        planes = _planes(job, without_noise(job, passes, sample, 1))
        if first is None:
            first, sums = passes, Reconstruction(job.filter, *planes.shape)
        sums.add(planes, where, share / job.rates.base)
    return film.with_colours(first, sums.pixels())


def _adapted(engine, depsgraph, job):
    """Cycles renders at the base rate, then of further samples for the pixels that need them; data are of the first."""
    rates = job.rates
    engine.shown = display.InOrder(job.region, job.plan)
    base = list(_of_plan(engine, depsgraph, job, 0, rates.base, _everywhere(job)))
    first = base[0][0]
    picture = _base_picture(job, [passes for passes, _, _ in base])
    # Further renders show nothing that is better.
    engine.shown = display.Picture(job.region, picture.reshape(-1, 4))
    levels = _levels(job, picture)
    count = rates.counts[levels].astype(np.float32)
    base_weight = rates.base_weight[levels]
    total = count - rates.base * (1.0 - base_weight)
    noisiest = spots.make(levels == 2, job.region, rates.extra // rates.whole, job.seed ^ _APART)
    parts = itertools.chain(
        ((_planes(job, passes), where, share * base_weight) for passes, where, share in base),
        _further(engine, depsgraph, job, levels == 1, noisiest),
    )
    used, mean, sums = [], 0.0, None
    for planes, where, share in parts:
        weight = share / total
        mean += weight * planes
        sums = sums or Reconstruction(job.filter or Filter("BOX", 1.0), *planes.shape)
        sums.add(planes, where, weight)
        used.append((where, weight))
        if engine.test_break():
            break
    result = sums.pixels()
    if job.without_noise and not engine.test_break():
        clean = _cleaned(
            job, film.with_colours(first, mean), lambda planes: job.without_noise(planes, levels, noisiest)
        )
        noise = mean - _planes(job, clean)
        if job.filter:
            sums = Reconstruction(job.filter, *noise.shape)
            for where, weight in used:
                sums.add(noise, where, weight)
            noise = sums.pixels()
        result -= noise
    passes = film.with_colours(first, result)
    return passes | {key: count.reshape(-1, 1) for key in passes if key[0] == _SAMPLE_COUNT}


def _base_picture(job, shots):
    """What is left of the base when the known noise is taken out: (height, width, 4)."""
    width, height = job.region.size
    picture = np.mean([film.combined(passes | denoising.noisy(passes)) for passes in shots], axis=0)
    if job.without_noise:
        planes = picture.T.reshape(-1, height, width)
        picture = np.moveaxis(job.without_noise(planes, np.zeros((height, width), np.int8)), 0, 2)
    return picture.reshape(height, width, 4)


def _levels(job, picture):
    levels = job.choose_levels(picture)
    return levels if spots.fit(job.region) else np.minimum(levels, 1)


def _further(engine, depsgraph, job, completed, noisiest):
    """Samples beyond the base: some pixels complete their block, the noisiest take a larger one."""
    base, whole = job.rates.base, job.rates.whole
    if whole > base and completed.any():
        for passes, where, share in _of_plan(engine, depsgraph, job, base, whole - base, completed):
            yield _planes(job, passes), where, share
    for some in noisiest:
        yield from _of_spots(engine, depsgraph, job, some)


def _of_plan(engine, depsgraph, job, first, count, taken):
    """Renders of some of the plan's samples at some pixels: passes, where in the pixel these lie, samples of each."""
    for sample, samples in _shots(job, first, count):
        where = positions(job.region, sample, job.seed)
        at_render = where.reshape(2, -1)[:, job.plan.film] if job.filter else None
        wanted = taken.ravel()[job.plan.film]
        _restrict(depsgraph, job, job.plan, _PLAN, sample, samples, at_render, wanted)
        yield _rendered(engine, depsgraph, job), where, samples * taken.astype(np.float32)


def _of_spots(engine, depsgraph, job, chosen):
    """As `_of_plan`, planes instead of passes, for the pixels that several render pixels serve."""
    width, height = job.region.size
    name = f"spots_{chosen.plan.seed}.tif"
    chosen.plan.write(os.path.join(job.folder.name, name))
    # Cycles puts the first sample of each servant into the middle of the pixel; together they would be too many there.
    kind = job.scene.cycles.pixel_filter_type
    if not job.filter and kind != "BOX":
        for view in job.views.values():
            view.camera.data.cycles_custom["reach"] = job.scene.cycles.filter_width
    for sample, samples in _shots(job, 0, job.rates.whole):
        after = job.rates.base + sample * len(chosen.servants)
        where = [positions(job.region, after + number, job.seed) for number in range(len(chosen.servants))]
        at_render = np.zeros((2, job.region.pixels), np.uint16)
        for servants, place in zip(chosen.servants, where, strict=True):
            here = place.reshape(2, -1)[:, chosen.film]
            at_render[:, servants] = here if job.filter else by_importance(here, kind)
        _restrict(depsgraph, job, chosen.plan, name, sample, samples, at_render, chosen.plan.film >= 0)
        # Only then does Cycles take notice of another seed.
        cycles.reset(engine, bpy.data, depsgraph)
        planes = _planes(job, _passes(engine, depsgraph, job)).reshape(-1, job.region.pixels)
        for servants, place in zip(chosen.servants, where, strict=True):
            moved = np.zeros((len(planes), job.region.pixels), np.float32)
            moved[:, chosen.film] = planes[:, servants]
            share = np.zeros(job.region.pixels, np.float32)
            share[chosen.film] = samples
            yield moved.reshape(-1, height, width), place, share.reshape(height, width)


def _shots(job, first, count):
    """Parts of the sequence, as (first sample, count), that are rendered at once: for a filter one by one."""
    return [(sample, 1) for sample in range(first, first + count)] if job.filter else [(first, count)]


def _planes(job, passes):
    width, height = job.region.size
    return film.colours(passes, height, width)


def _everywhere(job):
    width, height = job.region.size
    return np.ones((height, width), bool)


def _restrict(depsgraph, job, plan, name, first, count, where, taken):
    """Make the next render one of some of its samples, at some render pixels, aimed by the plan's image `name`.

    Where in their film pixels the samples lie (None: where Cycles puts them), and whether they are taken, is told for
    each render pixel.
    """
    image = os.path.join(job.folder.name, f"{first}_in_{name}")
    plan.write_positions(image, where, taken, bool(job.filter))
    scene = depsgraph.scene_eval
    for view in job.views.values():
        view.camera.data.cycles_custom["plan"] = os.path.join(job.folder.name, name)
        view.camera.data.cycles_custom["positions"] = image
    set_samples(scene.cycles, job.rates.whole)
    scene.cycles.seed = plan.seed
    scene.cycles.use_sample_subset = True
    scene.cycles.sample_offset = first
    scene.cycles.sample_subset_length = count
