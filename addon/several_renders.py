# SPDX-License-Identifier: GPL-3.0-or-later
"""Several Cycles renders of the GATHER driver that make one picture: of each sample, or of more where it is noisy."""

import contextlib
import itertools
import os

import bpy
import numpy as np
from cycles import engine as cycles

from . import control_variates, display, driver, film, main_thread, mixed_rates, persistence, spots
from .adaptive import apart
from .in_order import as_rendered, rendered, without_noise
from .mixed_rates import planes
from .reconstruction import Reconstruction, by_importance, positions

# File name of the plan's image.
PLAN = "plan.tif"


def filtered(engine, depsgraph, job):
    """A Cycles render for each sample: colours of each go through the filter, data are those of the first."""
    first, sums = None, None
    for sample in range(job.rates.base):
        if first and engine.test_break():
            break
        ((passes, where, share),) = _of_plan(engine, depsgraph, job, sample, 1, _everywhere(job))
        light = planes(job, without_noise(engine, job, passes, sample, 1))
        if first is None:
            first, sums = passes, Reconstruction(job.filter, *light.shape)
        sums.add(light, where, share / job.rates.base)
    return film.with_colours(first, sums.pixels())


def adapted(engine, depsgraph, job):
    """Cycles renders at the base rate, then of further samples for the pixels that need them; data are of the first."""
    rates = job.rates
    engine.shown = display.InOrder(job.region, job.plan)
    first, base = None, []
    for passes, where, share in _of_plan(engine, depsgraph, job, 0, rates.base, _everywhere(job)):
        base.append((planes(job, passes), where, share))
        first = first or film.with_colours(passes, base[0][0])
    picture, known = _without_noise_of_base(engine, job, first, [light for light, _, _ in base])
    # Further renders show nothing that is better.
    engine.shown = display.Picture(job.region, picture.reshape(-1, 4))
    levels = _levels(job, picture)
    noisiest = [
        spots.make(levels == level, job.region, samples // rates.whole, job.seed ^ apart(level))
        for level, samples in enumerate(rates.larger, start=2)
    ]
    # Noise of whole blocks is another than that of their samples.
    completed = (levels == 1) & (rates.whole > rates.base)
    known[:, completed] = 0.0
    for light, _, _ in base:
        light -= known
    del known

    def without_further_noise(light):
        if rates.whole <= control_variates.MOST_SAMPLES:
            light = job.without_noise(light, 0, rates.whole, completed)
        for level, (samples, found) in enumerate(zip(rates.larger, noisiest, strict=True), start=2):
            if samples <= control_variates.MOST_SAMPLES:
                light = job.without_noise(light, 0, samples, levels == level, spots.drawn(found, levels.shape))
        return light

    return mixed_rates.mixed(
        engine,
        job,
        first,
        base,
        _further(engine, depsgraph, job, completed, noisiest),
        levels,
        job.without_noise and without_further_noise,
    )


def _without_noise_of_base(engine, job, first, lights):
    """The picture that is the mean of some lights, without the noise that is known; and that noise."""
    mean = sum(lights) / np.float32(len(lights))
    clean = without_noise(engine, job, film.with_colours(first, mean), 0, job.rates.base)
    return mixed_rates.base_picture(job, clean), mean - planes(job, clean)


def _levels(job, picture):
    levels = job.choose_levels(picture)
    return levels if spots.fit(job.region) else np.minimum(levels, 1)


def _further(engine, depsgraph, job, completed, noisiest):
    """Samples beyond the base: some pixels complete their block, the noisiest take a larger one."""
    base, whole = job.rates.base, job.rates.whole
    if completed.any():
        for passes, where, share in _of_plan(engine, depsgraph, job, base, whole - base, completed):
            yield planes(job, passes), where, share
    for found in itertools.chain(*noisiest):
        yield from _of_spots(engine, depsgraph, job, found)


def _of_plan(engine, depsgraph, job, first, count, taken):
    """Renders of some of the plan's samples at some pixels: passes, where in the pixel these lie, samples of each."""
    for sample, samples in _shots(job, first, count):
        where = positions(job.region, sample, job.seed)
        at_render = where.reshape(2, -1)[:, job.plan.film] if job.filter else None
        wanted = taken.ravel()[job.plan.film]
        _restrict(engine, depsgraph, job, job.plan, PLAN, sample, samples, at_render, wanted)
        yield rendered(engine, depsgraph, job), where, samples * taken.astype(np.float32)


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
    with _border(engine, job.region.border((width, chosen.rows))):
        for sample, samples in _shots(job, 0, job.rates.whole):
            after = job.rates.base + sample * len(chosen.servants)
            where = [positions(job.region, after + number, job.seed) for number in range(len(chosen.servants))]
            at_render = np.zeros((2, job.region.pixels), np.uint16)
            for servants, place in zip(chosen.servants, where, strict=True):
                here = place.reshape(2, -1)[:, chosen.film]
                at_render[:, servants] = here if job.filter else by_importance(here, kind)
            _restrict(engine, depsgraph, job, chosen.plan, name, sample, samples, at_render, chosen.plan.film >= 0)
            # Only then does Cycles take notice of another seed.
            cycles.reset(engine, bpy.data, depsgraph)
            light = planes(job, as_rendered(engine, depsgraph, job)).reshape(-1, job.region.pixels)
            # Without a filter it does not matter where in the pixel they lie.
            together = 1 if job.filter else len(chosen.servants)
            for first in range(0, len(chosen.servants), together):
                servants = chosen.servants[first : first + together]
                moved = np.zeros((len(light), job.region.pixels), np.float32)
                moved[:, chosen.film] = light[:, servants].mean(axis=1)
                share = np.zeros(job.region.pixels, np.float32)
                share[chosen.film] = samples * together
                yield moved.reshape(-1, height, width), where[first], share.reshape(height, width)


@contextlib.contextmanager
def _border(engine, border):
    """Have Cycles render a rectangle only."""
    settings = persistence.render_settings(engine)
    written = persistence.Overwritten()
    main_thread.run(lambda: written.set(settings, **border), engine)
    try:
        yield
    finally:
        main_thread.run(written.put_back, engine)


def _shots(job, first, count):
    """Parts of the sequence, as (first sample, count), that are rendered at once: for a filter one by one."""
    return [(sample, 1) for sample in range(first, first + count)] if job.filter else [(first, count)]


def _everywhere(job):
    width, height = job.region.size
    return np.ones((height, width), bool)


def _restrict(engine, depsgraph, job, plan, name, first, count, where, taken):
    """Make the next render one of some of its samples, at some render pixels, aimed by the plan's image `name`.

    Where in their film pixels the samples lie (None: where Cycles puts them), and whether they are taken, is told for
    each render pixel.
    """
    image = ""
    if where is not None or not taken.all():
        image = os.path.join(job.folder.name, f"{first}_in_{name}")
        plan.write_positions(image, where, taken, bool(job.filter))

    def write():
        for view in job.views.values():
            view.camera.data.cycles_custom["plan"] = os.path.join(job.folder.name, name)
            view.camera.data.cycles_custom["positions"] = image
        settings = depsgraph.scene_eval.cycles
        driver.set_samples(settings, job.rates.whole)
        settings.seed = plan.seed
        settings.use_sample_subset = True
        settings.sample_offset = first
        settings.sample_subset_length = count

    main_thread.run(write, engine)
