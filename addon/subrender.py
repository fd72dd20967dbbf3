# SPDX-License-Identifier: GPL-3.0-or-later
"""The SUBRENDER driver: one small Cycles render for each cell of a periodic pattern, for each sample.

All film pixels of a cell share their random numbers (Mitchell 1991, section 6), so a cell is a picture of the scene at
one moment, through one point of the lens, seen on every n-th pixel each way.  Such a picture needs no motion blur, no
depth of field and no special camera: the frame is set to the moment, a pinhole stands at the lens point
(`addon.cell_camera`), and Cycles' sample offset chooses the numbers of light and bounces.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import bpy
import numpy as np
from cycles import engine as cycles

from . import (
    aperture,
    camera,
    cell_camera,
    cell_plan,
    control_variates,
    denoising,
    display,
    driver,
    exposure,
    film,
    in_order,
    layer_noise,
    layers,
    library,
    main_thread,
    persistence,
    shading,
    shared_sequence,
)
from .analysis import scene_use
from .cell_plan import CellPlan
from .failure import Refused, report
from .progress import Progress
from .reconstruction import Filter, Reconstruction
from .region import Region

# Sub-renders of a picture, at most: more would take seconds to plan, and days to render.
_MOST = 2**20

# Width of Cycles' pixel filter, in pixels of a sub-render: the narrowest that it takes.
_PINNED = 0.01


@dataclass(frozen=True)
class Job:
    """A prepared render.

    Attributes
    ----------
    data : bpy.types.BlendData
    region : Region
    plan : CellPlan
    subset : range
        The samples of the plan that are rendered, not all if the scene has a sample subset.
    scene : bpy.types.Scene
    layer : bpy.types.ViewLayer
        The original ones.
    denoise : bool
        Whether the result is to be denoised.
    facts : dict of str to str
        What the picture should say of the render (`addon.layers`).
    frame : (int, float)
        The frame and sub-frame that are rendered.
    times : float array, shape (side, side, samples), or None
        When the samples are taken, in frames from `frame`; None without motion blur.
    filter : Filter or None
        What samples are spread by; None leaves that to the places where they are taken.
    offsets : float array, shape (side, side, samples, 2)
        Where in its pixel each sample is taken, from the centre, in pixels.
    drift : float array, shape (plan.count, 2)
        How far Cycles' own filter moves each point of the sequence, in pixels of a sub-render.  Further views draw from
        another sequence: their pixels are blurred by that, with a standard deviation below .05 pixels.
    without_noise : callable or None
        Of `control_variates.of_picture`; None leaves the noise in.
    """

    data: bpy.types.BlendData
    region: Region
    plan: CellPlan
    subset: range
    scene: bpy.types.Scene
    layer: bpy.types.ViewLayer
    denoise: bool
    facts: dict
    frame: tuple[int, float]
    times: np.ndarray | None
    filter: Filter | None
    offsets: np.ndarray
    drift: np.ndarray
    without_noise: Callable | None


class _Overwritten:
    """Values written to evaluated data, which can be put back.

    The next frame's evaluation starts from what it finds, so nothing of ours may be there.
    """

    def __init__(self):
        self._previous = []

    def set(self, owner, **values):
        for name, value in values.items():
            self.keep(owner, name)
            setattr(owner, name, value)

    def keep(self, owner, *names):
        for name in names:
            value = getattr(owner, name)
            self._previous.append((owner, name, value.copy() if hasattr(value, "copy") else value))

    def put_back(self):
        while self._previous:
            setattr(*self._previous.pop())


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


def _check_rates(scene, layer):
    if scene.spectral_tiles.adaptive != "OFF":
        raise Refused("Sub-renders take the same samples everywhere; set Adaptive to Off, or Driver to Gather")


def _check_culling(scene, layer):
    if scene.render.use_simplify and scene.cycles.use_camera_cull:
        raise Refused(
            "Camera Culling cannot be done by sub-renders, each of which sees more than the picture; "
            "switch it off (Simplify), or set Driver to In Place"
        )


def _check_count(scene, layer):
    count = sub_renders(scene)
    if count > _MOST:
        raise Refused(
            f"This picture would take {count:,} sub-renders, for more than {_MOST:,} of which there is no plan; "
            "lower Samples, set Tile to Automatic, or set Driver to Gather"
        )


# Each raises `Refused` if a scene's view layer cannot be rendered this way.  The panel asks them all beforehand.
CHECKS = (
    _check_camera, _check_passes, _check_rates, _check_culling, library.check, _check_count, denoising.check,
)  # fmt: skip


def sub_renders(scene):
    """How many sub-renders a whole picture of the scene takes; raises `Refused` if its tile cannot be used."""
    samples = scene.spectral_tiles.samples
    tile = library.tile(scene.spectral_tiles, scene.library)
    return samples * (cell_plan.side(samples) if tile is None else tile.size) ** 2


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
    for check in CHECKS:
        check(scene, layer)
    shading.check(depsgraph, scene.camera)
    cell_camera.cameras(engine, scene)
    if not persistence.is_kept(engine):
        raise Refused("Blender does not keep the scene between sub-renders; switch on Persistent Data")
    use = scene_use(depsgraph)
    seed, frame = driver.seed_and_frame(scene)
    tile = library.tile(settings, scene.library, use.dims)
    if tile is None:
        plan = cell_plan.arranged(use, settings.samples, settings.seed, frame)
    else:
        dims = tuple(name for name in use.dims if name in tile.dims)
        plan = cell_plan.following(aperture.fitted(tile, use.blades), dims, settings.samples, seed)
    if settings.samples > 1:
        film.add_divisors(engine, layer)
    denoise = denoising.prepare(engine, scene, layer)
    first, count = layers.subset(scene.cycles, settings.samples)
    chosen = driver.chosen_filter(settings)
    kind = "BOX" if chosen else scene.cycles.pixel_filter_type
    offsets = exposure.filter_offsets(plan.film, kind, scene.cycles.filter_width)
    drift = exposure.filter_offsets(
        shared_sequence.values(("film.x", "film.y"), plan.count, plan.seed), "GAUSSIAN", _PINNED
    )
    # As in Cycles, the first sample is in the middle.
    if not chosen:
        offsets[:, :, 0] = 0.0
    drift[0] = 0.0
    region, without_noise, noise = Region.of_render(scene.render), None, ""
    if driver.takes_out_noise(settings):
        if layers.is_whole(scene):
            without_noise = control_variates.of_picture(use, plan.drawn(region), plan.side)
        else:
            noise = layer_noise.described(use, region, settings, frame, "SUBRENDER", [])
    # A session that rendered before would keep settings that have changed since.
    cycles.free(engine)
    cycles.create(engine, data)
    return Job(
        data=data,
        region=region,
        plan=plan,
        subset=range(first, first + count),
        scene=depsgraph.scene,
        layer=depsgraph.view_layer,
        denoise=denoise,
        facts=layers.facts(scene, layer.name, tile, plan, seed, settings.samples, noise),
        frame=(scene.frame_current, scene.frame_subframe),
        times=exposure.shutter_times(plan.t, scene.render) if use.motion_blur else None,
        filter=chosen,
        offsets=offsets,
        drift=drift,
        without_noise=without_noise,
    )


def render(engine, depsgraph, job):
    """Run all sub-renders and put their pixels where they belong."""
    written = _Overwritten()
    progress = Progress(engine, job.plan.side**2 * len(job.subset))
    mean, sums = {}, None
    scene = depsgraph.scene_eval
    cameras = {made: persistence.values(made.data) for made in cell_camera.cameras(engine, scene)}
    try:
        with camera.dicing(engine, scene, cameras):
            for count, sample in enumerate(job.subset, start=1):
                passes = _render_sample(engine, depsgraph, job, sample, written, progress, mean)
                if count > 1 and engine.test_break():
                    break
                if job.filter and passes:
                    sums = _spread(job, sample, in_order.without_noise(engine, job, passes, sample, 1), sums)
                mean = film.mean(mean, passes, count, job.region)
                if sums:
                    mean = film.with_colours(mean, sums.pixels())
                film.write_passes(engine, job.region, job.layer.name, mean)
        if not job.filter:
            mean = in_order.without_noise(engine, job, mean, 0, len(job.subset))
    except Refused as refused:
        report(engine, str(refused))
    finally:

        def leave():
            written.put_back()
            engine.frame_set(job.frame[0], subframe=job.frame[1])

        main_thread.run(leave, engine)
    in_order.finish(engine, job, mean)


def _spread(job, sample, passes, sums):
    """Add one sample of every pixel to the filter's sums, which are None at first."""
    width, height = job.region.size
    colours = film.colours(passes, height, width)
    sums = sums or Reconstruction(job.filter, len(colours), height, width)
    x, y = (np.arange(length) + corner for length, corner in zip(job.region.size, job.region.corner, strict=True))
    numbers = job.plan.film[y[:, None] % job.plan.side, x % job.plan.side, sample]
    where = (65536.0 * numbers).astype(np.uint16).transpose(2, 0, 1)
    sums.add(colours, where, np.full((height, width), 1.0 / len(job.subset), np.float32))
    return sums


def _render_sample(engine, depsgraph, job, sample, written, progress, mean):
    """Passes with one sample in each pixel, black where the user cancelled before; shows the `mean` of those before."""
    side = job.plan.side
    width, height = job.region.size
    passes = {}
    cells = np.argwhere(np.ones((side, side), bool))
    if job.times is not None:
        # In the order of time, so that as little as possible changes from one to the next.
        cells = cells[np.argsort(job.times[..., sample], axis=None)]
    for row, column in cells:
        # The cell's first pixel in the region.
        first = (column - job.region.corner[0]) % side, (row - job.region.corner[1]) % side
        if engine.test_break():
            break
        if first[0] < width and first[1] < height:
            for key, pixels in _render_cell(engine, depsgraph, job, (row, column, sample), first, written).items():
                whole = passes.setdefault(key, np.zeros((height, width, pixels.shape[1]), np.float32))
                part = whole[first[1] :: side, first[0] :: side]
                part[...] = pixels.reshape(height, width, -1)[: part.shape[0], : part.shape[1]]
        if (line := progress.step()) and passes:
            engine.shown = display.Picture(job.region, film.combined(mean or passes), line)
    return {key: pixels.reshape(width * height, -1) for key, pixels in passes.items()}


def _render_cell(engine, depsgraph, job, index, first_pixel, written):
    """Passes of one cell for one sample, in the lower left corner of otherwise meaningless ones."""
    moment = None if job.times is None else job.frame[0] + job.frame[1] + job.times[index]

    def passes(point, moment):
        main_thread.run(lambda: _aim(engine, depsgraph, job, index, first_pixel, point, moment, written), engine)
        cycles.reset(engine, job.data, depsgraph)
        cycles.render(engine, depsgraph)
        return film.read_passes(engine, job.layer.name)

    point = int(job.plan.offset[index])
    seen = passes(point, moment)
    missing = [key for key in seen if key[0] in film.FIRST_SAMPLE_PASSES]
    if missing and point > 0 and index[2] == 0:
        first = passes(0, None)
        seen |= {key: first[key] for key in missing}
    return seen


def _aim(engine, depsgraph, job, index, first_pixel, point, moment, written):
    """Make the next Cycles render that of a cell with a point of the sequence; at another moment, if one is given."""
    written.put_back()
    if moment is not None:
        engine.frame_set(math.floor(moment), subframe=moment % 1.0)
    scene, side = depsgraph.scene_eval, job.plan.side
    first = np.add(job.region.corner, 0.5) + first_pixel + job.offsets[index] - side * job.drift[point]
    for made in cell_camera.cameras(engine, scene):
        cell_camera.aim(written, made, scene.render, job.region, side, first, job.plan.lens[index])
    _set_sampling(written, scene, depsgraph.view_layer_eval, job.plan, point)
    _set_border(written, engine.render, job.region, side)


def _set_sampling(written, scene, layer, plan, point):
    """Make Cycles take the one sample, for all pixels alike, at the pixels' centres."""
    written.set(
        scene.cycles,
        samples=plan.count,
        sampling_pattern="TABULATED_SOBOL",
        scrambling_distance=0.0,
        auto_scrambling_distance=False,
        seed=plan.seed,
        use_animated_seed=False,
        use_sample_subset=True,
        sample_offset=point,
        sample_subset_length=1,
        use_adaptive_sampling=False,
        use_layer_samples="IGNORE",
        time_limit=0.0,
        pixel_filter_type="GAUSSIAN",
        filter_width=_PINNED,
        tile_size=in_order.LARGEST,
        use_denoising=False,
    )
    written.set(scene.render, use_motion_blur=False)
    written.set(layer, use_motion_blur=False)


def _set_border(written, render, region, side):
    """Render a rectangle of the size of one sub-render, from the region's corner on."""
    size = -(-np.array(region.size) // side)
    # In the middle of pixels, as Blender rounds down.
    lower = np.add(region.corner, 0.5) / region.frame
    upper = (np.add(region.corner, size) + 0.5) / region.frame
    written.set(
        render,
        use_border=True,
        border_min_x=lower[0],
        border_min_y=lower[1],
        border_max_x=min(upper[0], 1.0),
        border_max_y=min(upper[1], 1.0),
    )
