# SPDX-License-Identifier: GPL-3.0-or-later
"""The method Gather: one call of Cycles whose pixels serve other film pixels, then every pass put back in order.

Cycles' random numbers are a function of the render pixel.  A plan (`addon.plan`) says which film pixel each render
pixel should serve, so that the numbers Cycles will draw there suit it; an OSL camera (`cycles.osl_camera`) sends the
rays there; Cycles does the rest in a single call.  With a filter of ours there is a call for each sample.
"""

import os
import tempfile
import time

import bpy
from cycles import engine as cycles

from ..blender import openimageio
from ..blender.display import InOrder
from ..blender.refusal import Refused
from ..blender.region import bands
from ..cycles import aperture, dicing, osl_camera, passes, plan_image, sampling
from ..farm import layers
from ..picture.picture import mean_data
from ..picture.reconstruction import Reconstruction, first_position, positions
from ..plan import arranged_plan, pattern_plan
from . import steps
from .frame import pattern_tile

# Cycles' Depth where nothing was hit (kernel/film, pass accessor).
_NO_DEPTH = 1e10


def _check_build(scene, layer):
    if not cycles.with_osl():
        raise Refused("This build of Blender has no Open Shading Language, which the method Gather needs")
    openimageio.load()


def _check_device(scene, layer):
    preferences = bpy.context.preferences.addons["cycles"].preferences
    kind = preferences.get_compute_device_type()
    if scene.cycles.device == "GPU" and kind not in {"NONE", "OPTIX"} and preferences.has_active_device():
        raise Refused(
            f"Cycles has no Open Shading Language on {kind} devices, which the method Gather needs; "
            "set Device to CPU or use OptiX, or set Method to In Place"
        )


def _check_passes(scene, layer):
    if layer.use_pass_vector and not scene.render.use_motion_blur:
        raise Refused(
            f'The Vector pass of view layer "{layer.name}" cannot be rendered by Gather; '
            "switch the pass off, or set Method to In Place"
        )
    if layer.use_pass_mist and getattr(scene.camera and scene.camera.data, "type", "") == "ORTHO":
        raise Refused(
            f'The Mist pass of view layer "{layer.name}" cannot be rendered by Gather with an orthographic '
            "camera; switch the pass off, or set Method to In Place"
        )
    aovs = passes.aov_types(layer)
    if aovs.get("Depth") == "VALUE" or (layer.use_pass_z and "Position" in aovs):
        raise Refused(
            f'The AOV "Depth" or "Position" of view layer "{layer.name}" stands for a pass that Gather needs; '
            "rename it, or set Method to In Place"
        )
    if scene.spectral_tiles.filter != "AS_CYCLES" and not passes.can_be_mixed(layer):
        raise Refused(
            f'An AOV of view layer "{layer.name}" has the name of a color pass that a filter needs; rename it'
        )


def _check_subset(scene, layer):
    if scene.cycles.use_sample_subset and scene.spectral_tiles.filter != "AS_CYCLES":
        raise Refused("A sample subset cannot be filtered; set Filter to As Cycles, or switch the subset off")


def _check_culling(scene, layer):
    if scene.render.use_simplify and (scene.cycles.use_camera_cull or scene.cycles.use_distance_cull):
        raise Refused(
            "Culling cannot be done by Gather; "
            "switch Camera Culling and Distance Culling off (Simplify), or set Method to In Place"
        )


# Each raises `Refused` if a scene's view layer cannot be rendered this way.  The panel asks them all beforehand.
CHECKS = (
    _check_build,
    _check_device,
    lambda scene, layer: osl_camera.check(scene, scene.camera),
    _check_passes,
    _check_subset,
    _check_culling,
    lambda scene, layer: pattern_tile(scene),
)


def render(session, frame):
    """Render a frame."""
    engine = session.engine
    views = osl_camera.views(engine, session.scene)
    engine.update_stats("", "Planning samples")
    plan = _planned(engine, frame)
    if plan.miss:
        engine.report({"INFO"}, f"Cycles' numbers miss the pattern's by, on average: {plan.miss}")
    steps.add_guides(session, frame)
    if session.layer.use_pass_z and not session.layer.use_pass_position:
        engine.add_pass("Position", 3, "XYZ", layer=session.layer_name)
    if frame.filter or not frame.sampling.is_whole:
        passes.add_divisors(engine, session.layer)
    with (
        tempfile.TemporaryDirectory(prefix="spectral_tiles_", dir=bpy.app.tempdir) as folder,
        dicing.user_camera(session, [view.camera for view in views.values()]),
    ):
        image = os.path.join(folder, "plan.tif")
        plan_image.write(plan, image)
        session.set_sampling(**_sampling(frame, plan.seed))
        session.write(lambda written: osl_camera.replace(written, session.scene, views, frame.region, image))
        if frame.filter:
            picture = _filtered(session, frame, plan, views)
        else:
            engine.shown = InOrder(frame.region, plan)
            picture = _in_order(session, plan, views)
    return picture, layers.facts(frame, session.layer_name, plan)


def _planned(engine, frame):
    """The plan of a frame."""
    use, region, samples = frame.use, frame.region, frame.sampling.samples
    seed = frame.sampling.frame_seed % 2**31
    if frame.tile is None:
        return arranged_plan.make(use, region, samples, seed, engine.test_break)
    tile = aperture.fitted(frame.tile, use.blades)
    dims = tuple(name for name in use.dims if name in tile.dims)
    return pattern_plan.make(tile, dims, region, samples, seed, engine.test_break)


def _sampling(frame, seed):
    """Settings of Cycles, whose threshold and time limit apply but to a filter of ours."""
    wanted = sampling.exactly(frame.sampling.samples, seed)
    if not frame.filter and frame.sampling.is_whole:
        del wanted["use_adaptive_sampling"], wanted["time_limit"]
    return wanted


def _in_order(session, plan, views):
    """One call by the plan, its pixels in order."""
    picture = steps.pictured(session, session.call())
    width, height = picture.size
    for (name, view), depth in picture.passes.items():
        if name == "Depth" and picture.kinds[name] is passes.Kind.FIRST_SAMPLE:
            # A custom camera's Depth is a distance from the camera; only positions tell the depth along its axis.
            for band in bands(height):
                part = slice(band.start * width, band.stop * width)
                hit = depth[part, 0] < _NO_DEPTH
                depth[part][hit, 0] = views[view].depth(picture.passes["Position", view][part][hit])
    return picture.moved(plan.film)


def _filtered(session, frame, plan, views):
    """A call for each sample: light of each goes through the filter, data are those of the first, or means."""
    limit, begun, seed = frame.sampling.time_limit, time.monotonic(), frame.sampling.frame_seed
    first, sums, taken = None, None, 0
    for sample in range(frame.sampling.samples):
        late = limit and time.monotonic() - begun > limit
        if first and (late or session.engine.test_break()):
            break
        where = first_position(sample, seed)
        session.write(lambda _, where=where: osl_camera.set_first_position(views, where))
        session.set_sampling(use_sample_subset=True, sample_offset=sample, sample_subset_length=1)
        picture = _in_order(session, plan, views)
        light = picture.light
        sums = sums or Reconstruction(frame.filter, *light.shape)
        taken = sample + 1
        first = mean_data(first, picture, taken) if first else picture
        sums.add(light, positions(frame.region, sample, seed))
    return first.of_samples(taken).with_light(sums.pixels())
