# SPDX-License-Identifier: GPL-3.0-or-later
"""The camera that makes Cycles follow a plan: an OSL camera put in place of the scene's on the evaluated copy.

The formulas are those of Blender's `intern/cycles/blender/camera.cpp` (viewplane, aperture) and Cycles'
`kernel/camera/camera.h`; the shader itself is `camera.osl` beside this file.
"""

import functools
import hashlib
import os
import tempfile

import _cycles

from .failure import Refused

# Cycles finds a render pixel by rounding, so its own filter must stay inside the pixel: with this width it reaches a
# quarter (Blackman-Harris) or three eighths (Gaussian) of a pixel to each side (scene/film.cpp, filter_table).
_NARROW_FILTER_WIDTH = 0.25


@functools.cache
def _shader():
    """Bytecode of `camera.osl` and its MD5.

    Raises
    ------
    Refused
        The shader compiler of this Blender fails.
    """
    source = os.path.join(os.path.dirname(__file__), "camera.osl")
    with tempfile.TemporaryDirectory(prefix="spectral_tiles_") as folder:
        compiled = os.path.join(folder, "camera.oso")
        if not _cycles.osl_compile(source, compiled):
            raise Refused("Blender's OSL compiler could not compile the camera of Spectral Tiles")
        with open(compiled, encoding="utf-8") as file:
            bytecode = file.read()
    return bytecode, hashlib.md5(bytecode.encode(), usedforsecurity=False).hexdigest()


def check(camera):
    """Raise `Refused` if a plan cannot drive this camera object (or None)."""
    if camera is None:
        raise Refused("Cannot render, no camera in the scene")
    if camera.type != "CAMERA":
        raise Refused(f'"{camera.name}" is not a camera; make a camera object the scene\'s camera')
    if camera.data.type not in {"PERSP", "ORTHO"}:
        kind = {"PANO": "panoramic", "CUSTOM": "custom (OSL)"}.get(camera.data.type, camera.data.type)
        raise Refused(
            f'Camera "{camera.name}" is {kind}, which Spectral Tiles does not support yet; '
            "use a perspective or orthographic camera, or render with Cycles"
        )


def _film_plane(engine, camera, width, height, pixel_aspect):
    """Lower left corner and size of the film: on the plane z = 1, or in scene units for an orthographic camera."""
    data = camera.data
    x_ratio, y_ratio = width * pixel_aspect[0], height * pixel_aspect[1]
    horizontal = x_ratio > y_ratio if data.sensor_fit == "AUTO" else data.sensor_fit == "HORIZONTAL"
    sensor = data.sensor_height if data.sensor_fit == "VERTICAL" else data.sensor_width
    aspect = x_ratio / y_ratio if horizontal else y_ratio / x_ratio
    half_x, half_y = (aspect, 1.0) if horizontal else (1.0, aspect)
    shift_x, shift_y = engine.camera_shift_x(camera), data.shift_y
    scale = data.ortho_scale / (2.0 * aspect) if data.type == "ORTHO" else 0.5 * sensor / data.lens / aspect
    middle_x, middle_y = 2.0 * aspect * shift_x, 2.0 * aspect * shift_y
    corner = (scale * (middle_x - half_x), scale * (middle_y - half_y), 0.0)
    return corner, (2.0 * scale * half_x, 2.0 * scale * half_y, 0.0)


def _set_filter(cycles):
    """Narrow Cycles' pixel filter to less than a pixel; return the factor back to its real width, and if it is a box.

    A box cannot be made narrower than a pixel, so Cycles gets a Gaussian instead and the shader turns its offset back
    into a uniform number.
    """
    box = cycles.pixel_filter_type == "BOX"
    if box:
        cycles.pixel_filter_type = "GAUSSIAN"
        scale = 1.0 / (_NARROW_FILTER_WIDTH / 4.0 * 2.0**0.5)
    else:
        scale = cycles.filter_width / _NARROW_FILTER_WIDTH
    cycles.filter_width = _NARROW_FILTER_WIDTH
    return scale, box


def replace(engine, scene, region, plan_path):
    """Put the plan's camera in place of the scene's, and narrow the pixel filter.

    Parameters
    ----------
    engine : bpy.types.RenderEngine
    scene : bpy.types.Scene
        The *evaluated* scene, with a camera that `check` lets pass; it, its camera and that camera's data are
        written to.
    region : addon.region.Region
        The pixels that are rendered.
    plan_path : str
        Image with the plan (`addon.plan.Plan.write`).

    Raises
    ------
    Refused
        The camera's shader cannot be compiled.
    """
    camera = scene.camera
    data = camera.data
    render = scene.render
    corner, size = _film_plane(engine, camera, *region.frame, (render.pixel_aspect_x, render.pixel_aspect_y))
    filter_scale, box = _set_filter(scene.cycles)
    orthographic = data.type == "ORTHO"
    depth_of_field = data.dof.use_dof
    lens_radius = 1.0 / (2.0 * max(data.dof.aperture_fstop, 1e-5)) if depth_of_field else 0.0
    if not orthographic:
        lens_radius *= 1e-3 * data.lens
    parameters = {
        "plan": plan_path,
        "region": (*map(float, region.corner), 0.0),
        "region_size": (*map(float, region.size), 1.0),
        "frame_size": (*map(float, region.frame), 1.0),
        "plane_corner": corner,
        "plane_size": size,
        "orthographic": int(orthographic),
        "near_clip": data.clip_start,
        "filter_scale": filter_scale,
        "box_filter": int(box),
        "aperture": lens_radius,
        "aperture_stretch": 1.0 / data.dof.aperture_ratio,
        "blades": float(data.dof.aperture_blades),
        "blade_rotation": data.dof.aperture_rotation,
    }
    bytecode, digest = _shader()
    for name in list(data.cycles_custom.keys()):
        del data.cycles_custom[name]
    for name, value in parameters.items():
        data.cycles_custom[name] = value
    # Cycles measures the clip distances of a custom camera along the ray instead of the axis.  The shader starts the
    # ray at the near clip itself; the far one is kept just far enough that no corner of the film loses anything.
    reach = 1.0
    if not orthographic:
        far_corner = [max(abs(corner[axis]), abs(corner[axis] + size[axis])) for axis in (0, 1)]
        reach = (1.0 + far_corner[0] ** 2 + far_corner[1] ** 2) ** 0.5
    data.clip_end = reach * data.clip_end
    data.clip_start = 1e-6
    data.shift_x = data.shift_y = 0.0
    data.custom_mode = "INTERNAL"
    data.custom_bytecode = bytecode
    data.custom_bytecode_hash = digest
    data.type = "CUSTOM"
