# SPDX-License-Identifier: GPL-3.0-or-later
"""The SUBRENDER driver: one small Cycles render for each cell of a periodic pattern, for each sample.

All film pixels of a cell share their random numbers (Mitchell 1991, section 6), so each cell is rendered by itself
(`addon.cell_renders`).  This module prepares these renders, and makes a picture of the samples that they bring.
"""

from collections.abc import Callable
from dataclasses import dataclass

import bpy
import numpy as np
from cycles import engine as cycles

from . import (
    adaptive,
    aperture,
    camera,
    cell_camera,
    cell_levels,
    cell_plan,
    control_variates,
    denoising,
    driver,
    film,
    in_order,
    layer_noise,
    layers,
    library,
    main_thread,
    mixed_rates,
    persistence,
)
from .analysis import scene_use
from .cell_renders import Cells, Renders
from .failure import Refused, report
from .progress import Progress
from .reconstruction import Filter, Reconstruction
from .region import Region

# Sub-renders of a picture, at most: more would take seconds to plan, and days to render.
_MOST = 2**20


@dataclass(frozen=True)
class Job:
    """A prepared render.

    Attributes
    ----------
    data : bpy.types.BlendData
    region : Region
    cells : Cells
        Of the plan for the same samples everywhere.
    subset : range
        The samples of the plan that are rendered, not all if the scene has a sample subset.
    rates : adaptive.Rates
        Samples of a pixel at each level; the base is all there is without levels.
    choose_levels : callable or None
        Picture at the base rate -> level of each pixel (`addon.cell_levels`); None if all get the same.
    larger : list of Cells
        What pixels of levels 2, 3, ... take beside the base.
    scene : bpy.types.Scene
    layer : bpy.types.ViewLayer
        The original ones.
    denoise : bool
        Whether the result is to be denoised.
    facts : dict of str to str
        What the picture should say of the render (`addon.layers`).
    frame : (int, float)
        The frame and sub-frame that are rendered.
    filter : Filter or None
        What samples are spread by; None leaves that to the places where they are taken.
    without_noise : callable or None
        Of `control_variates.of_picture`, for samples that all pixels take; None leaves the noise in.
    """

    data: bpy.types.BlendData
    region: Region
    cells: Cells
    subset: range
    rates: adaptive.Rates
    choose_levels: Callable | None
    larger: list[Cells]
    scene: bpy.types.Scene
    layer: bpy.types.ViewLayer
    denoise: bool
    facts: dict
    frame: tuple[int, float]
    filter: Filter | None
    without_noise: Callable | None


def _check_camera(scene, layer):
    cell_camera.check(scene, scene.camera)


def _check_passes(scene, layer):
    if layer.use_pass_vector:
        raise Refused(f'The Vector pass of view layer "{layer.name}" cannot be rendered by sub-renders; switch it off')
    kinds = ("object", "material", "asset")
    if scene.spectral_tiles.samples > 1 and any(getattr(layer, f"use_pass_cryptomatte_{kind}") for kind in kinds):
        raise Refused(
            f'The Cryptomatte passes of view layer "{layer.name}" take one sample a pixel by sub-renders; '
            "switch them off, or set Driver to Gather"
        )


def _check_subset(scene, layer):
    if scene.cycles.use_sample_subset and scene.spectral_tiles.adaptive != "OFF":
        raise Refused("A sample subset cannot be adapted; set Adaptive to Off, or switch the subset off")


def _check_culling(scene, layer):
    if scene.render.use_simplify and scene.cycles.use_camera_cull:
        raise Refused(
            "Camera Culling cannot be done by sub-renders, each of which sees more than the picture; "
            "switch it off (Simplify), or set Driver to In Place"
        )


def _check_count(scene, layer):
    rates = adaptive.rates_of(scene.spectral_tiles)
    count = max(_side(scene, samples) ** 2 * samples for samples in (rates.whole, *rates.larger))
    if count > _MOST:
        raise Refused(
            f"This picture would take {count:,} sub-renders, for more than {_MOST:,} of which there is no plan; "
            "lower Samples, set Tile to Automatic, or set Driver to Gather"
        )


# Each raises `Refused` if a scene's view layer cannot be rendered this way.  The panel asks them all beforehand.
CHECKS = (
    _check_camera, _check_passes, _check_subset, _check_culling, library.check, _check_count, denoising.check,
)  # fmt: skip


def sub_renders(scene):
    """How many sub-renders a whole picture of the scene takes; with rates, how many until these are chosen.

    Raises
    ------
    Refused
        The scene's tile cannot be used.
    """
    settings = scene.spectral_tiles
    return _side(scene, settings.samples) ** 2 * adaptive.rates_of(settings).base


def _side(scene, samples):
    """Period of the scene's pattern with that many samples a pixel, in pixels."""
    tile = library.tile(scene.spectral_tiles, scene.library)
    return cell_plan.side(samples) if tile is None else tile.size


def prepare(engine, data, depsgraph):
    """Plan the sub-renders, and give the engine a fresh Cycles session for them.

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
    cell_camera.cameras(engine, scene)
    if not persistence.is_kept(engine):
        raise Refused("Blender does not keep the scene between sub-renders; switch on Persistent Data")
    use = scene_use(depsgraph)
    seed, frame = driver.seed_and_frame(scene)
    rates = adaptive.rates_of(settings)
    tile = library.tile(settings, scene.library, use.dims)
    if tile is not None:
        tile = aperture.fitted(tile, use.blades)

    def plan(samples, apart=0):
        if tile is None:
            return cell_plan.arranged(use, samples, settings.seed ^ apart, frame)
        return cell_plan.following(tile, tuple(name for name in use.dims if name in tile.dims), samples, seed ^ apart)

    if rates.counts.max() > 1:
        film.add_divisors(engine, layer)
    denoise = denoising.prepare(engine, scene, layer)
    first, count = layers.subset(scene.cycles, settings.samples)
    chosen = driver.chosen_filter(settings)
    kind = "BOX" if chosen else scene.cycles.pixel_filter_type
    region = Region.of_render(scene.render)
    cells = Cells.of_plan(plan(settings.samples), scene, use.motion_blur, kind)
    # As in Cycles, the first sample is in the middle.
    if not chosen:
        cells.offsets[:, :, 0] = 0.0
    choose_levels = None
    larger = [
        Cells.of_plan(plan(samples, adaptive.apart(level)), scene, use.motion_blur, kind)
        for level, samples in enumerate(rates.larger, start=2)
    ]
    if larger:
        parts = cell_levels.Parts(region, larger[-1].plan.side)
        choose_levels = adaptive.chooser(settings, parts.levels_in_budget, parts.levels_over_threshold)
    without_noise, noise = None, ""
    if driver.takes_out_noise(settings):
        if layers.is_whole(scene):
            without_noise = control_variates.of_picture(use, cells.plan.drawn(region), cells.plan.side)
        else:
            noise = layer_noise.described(use, region, settings, frame, "SUBRENDER", [])
    # A session that rendered before would keep settings that have changed since.
    cycles.free(engine)
    cycles.create(engine, data)
    return Job(
        data=data,
        region=region,
        cells=cells,
        subset=range(first, first + count),
        rates=rates,
        choose_levels=choose_levels,
        larger=larger,
        scene=depsgraph.scene,
        layer=depsgraph.view_layer,
        denoise=denoise,
        facts=layers.facts(scene, layer.name, tile, cells.plan, seed, settings.samples, noise),
        frame=(scene.frame_current, scene.frame_subframe),
        filter=chosen,
        without_noise=without_noise,
    )


def render(engine, depsgraph, job):
    """Run all sub-renders and put their pixels where they belong."""
    shots = job.cells.shots(job.region)
    progress = Progress(engine, len(shots) * len(job.subset))
    renders = Renders(engine, depsgraph, job, progress)
    pictures = (_adapted if job.choose_levels else _even)(engine, job, renders, shots, progress)
    passes = {}
    scene = depsgraph.scene_eval
    cameras = {made: persistence.values(made.data) for made in cell_camera.cameras(engine, scene)}
    try:
        with camera.dicing(engine, scene, cameras):
            for passes in pictures:
                film.write_passes(engine, job.region, job.layer.name, passes)
    except Refused as refused:
        report(engine, str(refused))
    finally:
        main_thread.run(renders.put_back, engine)
    in_order.finish(engine, job, passes)


def _even(engine, job, renders, shots, progress):
    """The picture after each sample, the same ones everywhere."""
    mean, sums = {}, None
    for sample, passes, mean in _samples(engine, job, renders, shots, job.subset):
        if job.filter and passes:
            width, height = job.region.size
            light = mixed_rates.planes(job, in_order.without_noise(engine, job, passes, sample, 1))
            sums = sums or Reconstruction(job.filter, *light.shape)
            share = np.full((height, width), 1.0 / len(job.subset), np.float32)
            sums.add(light, _positions(job, job.cells, sample), share)
            mean = film.with_colours(mean, sums.pixels())
        yield mean
    if not job.filter:
        yield in_order.without_noise(engine, job, mean, 0, len(job.subset))


def _adapted(engine, job, renders, shots, progress):
    """The picture after each sample of the base, then that of all samples.

    Noise that is known is taken out of the base, the only samples that all pixels have.  (Larger blocks have periods so
    short that nobody around has other numbers.)
    """
    width, height = job.region.size
    everywhere = np.ones((height, width), np.float32)
    base = []
    for sample, passes, mean in _samples(engine, job, renders, shots, range(job.rates.base)):
        yield mean
        if job.filter and passes:
            light = mixed_rates.planes(job, in_order.without_noise(engine, job, passes, sample, 1))
            base.append((light, _positions(job, job.cells, sample), everywhere))
    if engine.test_break():
        return
    if job.filter:
        clean = film.with_colours(mean, sum(light for light, _, _ in base) / np.float32(len(base)))
    else:
        clean = in_order.without_noise(engine, job, mean, 0, job.rates.base)
        # Samples stay in their pixels, wherever they lie.
        base = [(mixed_rates.planes(job, clean), _positions(job, job.cells, 0), job.rates.base * everywhere)]
    levels = job.choose_levels(mixed_rates.base_picture(job, clean))
    further = _further(engine, job, renders, progress, levels, mean)
    yield mixed_rates.mixed(engine, job, mean, base, further, levels)


def _samples(engine, job, renders, shots, samples):
    """Passes of some samples of every pixel, one after the other, and the mean so far, until the user cancels."""
    mean = {}
    for count, sample in enumerate(samples, start=1):
        passes = renders.sample(job.cells, sample, shots, mean)
        if count > 1 and engine.test_break():
            break
        mean = film.mean(mean, passes, count, job.region)
        yield sample, passes, mean


def _further(engine, job, renders, progress, levels, base):
    """Samples beyond the base, as `mixed_rates.mixed` takes them: pixels complete their block, or take a larger one."""
    rates = job.rates
    parts = []
    blocks = [(job.cells, range(rates.base, rates.whole)), *zip(job.larger, map(range, rates.larger), strict=True)]
    for level, (cells, samples) in enumerate(blocks, start=1):
        taken = levels == level
        parts.append((cells, samples, taken, cells.shots(job.region, taken)))
    progress.expect(sum(len(samples) * len(shots) for _, samples, _, shots in parts))
    for cells, samples, taken, shots in parts:
        for sample in samples if shots else ():
            passes = renders.sample(cells, sample, shots, base)
            if engine.test_break():
                return
            yield mixed_rates.planes(job, passes), _positions(job, cells, sample), taken.astype(np.float32)


def _positions(job, cells, sample):
    """Where in its pixel a sample of every pixel lies, as `reconstruction.positions`."""
    x, y = (np.arange(length) + corner for length, corner in zip(job.region.size, job.region.corner, strict=True))
    numbers = cells.plan.film[y[:, None] % cells.plan.side, x % cells.plan.side, sample]
    return (65536.0 * numbers).astype(np.uint16).transpose(2, 0, 1)
