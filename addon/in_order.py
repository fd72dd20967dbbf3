# SPDX-License-Identifier: GPL-3.0-or-later
"""One Cycles render: its passes put in order, freed of known noise, and made the result."""

from cycles import engine as cycles

from . import control_variates, denoising, driver, failure, film, layers
from .region import bands

# Cycles' Depth where nothing was hit (kernel/film, pass accessor).
_NO_DEPTH = 1e10

# Cycles renders larger pictures in tiles whatever its settings say (`TileManager::MAX_TILE_SIZE`).
LARGEST = 8192


def set_sampling(settings, samples, seed):
    """Make Cycles draw the numbers that a plan counts on, in one go."""
    driver.set_samples(settings, samples)
    settings.sampling_pattern = "BLUE_NOISE"
    settings.seed = seed
    settings.use_animated_seed = False
    # Cycles' own tiles reach the result only when all layers are done, so there shall be one.
    settings.tile_size = LARGEST
    # `addon.denoising` calls Cycles' denoiser once pixels are in order and known noise is gone.
    settings.use_denoising = False


def rendered(engine, depsgraph, job):
    """One Cycles render by the plan: its passes with the pixels in order."""
    passes = as_rendered(engine, depsgraph, job)
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


def as_rendered(engine, depsgraph, job):
    """One Cycles render: its passes as they are."""
    cycles.render(engine, depsgraph)
    if max(job.region.size) > LARGEST:
        cycles.render_frame_finish(engine)  # puts the tiles together
    return film.read_passes(engine, job.layer.name)


def without_noise(engine, job, passes, first, count):
    """Passes of a picture without the noise that Cycles' known numbers explain."""
    # A cancelled picture has not all of the samples whose numbers are known.
    if engine.test_break() or job.without_noise is None or count > control_variates.MOST_SAMPLES:
        return passes
    return cleaned(job, passes, lambda planes: job.without_noise(planes, first, count))


def cleaned(job, passes, clean):
    """Passes with the planes of their colours as a function makes them."""
    width, height = job.region.size
    # The first view's; Cycles' numbers in the others are not those of the plan.
    _, view = next(iter(passes))
    lit = {key: pixels for key, pixels in passes.items() if key[1] == view}
    return passes | film.with_colours(lit, clean(film.colours(lit, height, width)))


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
