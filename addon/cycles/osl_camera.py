# SPDX-License-Identifier: GPL-3.0-or-later
"""The camera that makes Cycles follow a plan: an OSL camera put in place of the scene's on the evaluated copy.

The formulas are those of Blender's `intern/cycles/blender/camera.cpp` (viewplane, aperture) and Cycles'
`kernel/camera/camera.h`; the shader itself is `camera.osl` beside this file.
"""

import functools
import hashlib
import os
import tempfile
from typing import NamedTuple

import _cycles
import bpy
import numpy as np

from ..blender.evaluated import values
from ..blender.refusal import Refused
from . import camera_film

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


def check_is_camera(camera):
    """Raise `Refused` if the scene's camera is no camera object, or None."""
    if camera is None:
        raise Refused("Cannot render, no camera in the scene")
    if camera.type != "CAMERA":
        raise Refused(f'"{camera.name}" is not a camera; make a camera object the scene\'s camera')


def check(scene, camera):
    """Raise `Refused` if a plan cannot drive this camera object (or None) in this scene."""
    check_is_camera(camera)
    if camera.data.type == "CUSTOM":
        raise Refused(
            f'Camera "{camera.name}" has a custom lens (OSL), whose place the camera of Spectral Tiles has to take; '
            "use another lens type, or set Method to In Place"
        )
    lens = camera.data.dof
    is_flat = camera.data.type == "ORTHO" and camera.data.ortho_scale == 0.0
    if is_flat or (lens.use_dof and lens.aperture_fstop == 0.0):
        raise Refused(
            f'Camera "{camera.name}" has an Orthographic Scale or an F-Stop of zero, which Gather does not render '
            "exactly; raise it, or set Method to In Place"
        )
    if camera.data.type == "PERSP" and _is_stereo(scene.render) and camera.data.stereo.use_spherical_stereo:
        raise Refused(
            f'Camera "{camera.name}" is a perspective one with Spherical Stereo, which Spectral Tiles cannot render; '
            "switch Spherical Stereo off, use a panoramic camera, or set Method to In Place"
        )
    if scene.cycles.rolling_shutter_type != "NONE" and scene.render.use_motion_blur:
        raise Refused(
            "Rolling Shutter cannot be rendered with Spectral Tiles, which renders the rows of a picture out of order; "
            "set it to None, or set Method to In Place"
        )


def _is_stereo(render):
    return render.use_multiview and render.views_format == "STEREO_3D"


class View(NamedTuple):
    """A camera that will be rendered through.

    Attributes
    ----------
    camera : bpy.types.Object
        Evaluated camera object.
    world_to_camera : float array, shape (4, 4)
    is_panoramic : bool
        As the user made it.
    """

    camera: bpy.types.Object
    world_to_camera: np.ndarray
    is_panoramic: bool

    def depth(self, positions):
        """Cycles' Depth of world positions, shape (n, 3): along the axis, or the distance if panoramic."""
        rows = self.world_to_camera[:3]
        local = positions @ rows[:, :3].T + rows[:, 3]
        return np.linalg.norm(local, axis=1) if self.is_panoramic else -local[:, 2]


def cameras(engine, scene):
    """Yield the name of each view of an evaluated scene, empty without multi-view, and the camera object it is seen by.

    That view is the engine's active one meanwhile.
    """
    for name in [view.name for view in scene.render.views if view.use and scene.render.use_multiview] or [""]:
        engine.active_view_set(name)
        yield name, engine.camera_override


def views(engine, scene):
    """What will be rendered through, with the evaluated scene's cameras still as they are.

    Parameters
    ----------
    engine : bpy.types.RenderEngine
    scene : bpy.types.Scene
        The evaluated scene.

    Returns
    -------
    dict of str to View
        By the name of the view, which is empty without multi-view.

    Raises
    ------
    Refused
        A plan cannot drive one of the cameras.
    """
    found = {}
    for name, camera in cameras(engine, scene):
        check(scene, camera)
        is_panoramic = camera.data.type == "PANO"
        spherical = is_panoramic and camera.data.stereo.use_spherical_stereo
        matrix = engine.camera_model_matrix(camera, use_spherical_stereo=spherical)
        found[name] = View(camera, np.array(matrix.inverted_safe()), is_panoramic)
    return found


def _set_filter(written, cycles):
    """Narrow Cycles' pixel filter to less than a pixel; return the factor back to its real width, and if it is a box.

    A box cannot be made narrower than a pixel, so Cycles gets a Gaussian instead and the shader turns its offset back
    into a uniform number.
    """
    box = cycles.pixel_filter_type == "BOX"
    if box:
        written.set(cycles, pixel_filter_type="GAUSSIAN")
        scale = 1.0 / (_NARROW_FILTER_WIDTH / 4.0 * 2.0**0.5)
    else:
        scale = cycles.filter_width / _NARROW_FILTER_WIDTH
    written.set(cycles, filter_width=_NARROW_FILTER_WIDTH)
    return scale, box


def replace(written, scene, views, region, plan_path):
    """Put the plan's camera in place of the scene's, and narrow the pixel filter.

    Parameters
    ----------
    written : Overwritten
    scene : bpy.types.Scene
        The *evaluated* scene; it and its cameras' data are written to.
    views : dict of str to View
        As of `views`.
    region : Region
        The pixels that are rendered.
    plan_path : str
        Image with the plan (`plan_image.write`).

    Raises
    ------
    Refused
        The camera's shader cannot be compiled.
    """
    filter_scale, box = _set_filter(written, scene.cycles)
    parameters = {
        "plan": plan_path,
        "region": (*map(float, region.corner), 0.0),
        "region_size": (*map(float, region.size), 1.0),
        "filter_scale": filter_scale,
        "box_filter": int(box),
    }
    for data in {view.camera.data for view in views.values()}:
        film = camera_film.of_camera(data, scene.render, region)
        _make_custom(written, data, scene.render, region, film, parameters)


def set_first_position(views, where):
    """Make the cameras of `replace` take samples at positions that begin with a `reconstruction.first_position`."""
    for view in views.values():
        view.camera.data.cycles_custom["first_position"] = (*map(float, where), 0.0)


def enlarge(written, data, render, region, side):
    """Make the film of a panoramic camera larger about its middle, without a plan.

    Parameters
    ----------
    written : Overwritten
    data : bpy.types.Camera
        Evaluated.  Its shift must be set afterwards.
    render : bpy.types.RenderSettings
    region : Region
        The pixels that are rendered.
    side : int
        How many times as large.
    """
    written.set(data, shift_x=0.0, shift_y=0.0)
    film = camera_film.of_camera(data, render, region)
    corner = tuple(at - 0.5 * (side - 1) * size for at, size in zip(film.corner, film.size, strict=True))
    film = film._replace(corner=corner, size=tuple(side * size for size in film.size))
    _make_custom(written, data, render, region, film, {})


def _lens(data, film):
    """What `camera.osl` has to know about a camera's lens."""
    return {
        "projection": film.projection,
        "plane_corner": (*film.corner, 0.0),
        "plane_size": (*film.size, 0.0),
        "eye_shift": (film.eye_shift, 0.0, 0.0),
        "field": data.fisheye_fov,
        "focal_length": data.fisheye_lens,
        "bend_0": data.fisheye_polynomial_k0,
        "bend": (data.fisheye_polynomial_k1, data.fisheye_polynomial_k2, data.fisheye_polynomial_k3),
        "bend_4": data.fisheye_polynomial_k4,
        # Cycles clips a panorama along the ray, as it does a custom camera.
        "near_clip": 0.0 if data.type == "PANO" else data.clip_start,
        "aperture": camera_film.lens_radius(data) if data.dof.use_dof else 0.0,
        "aperture_stretch": 1.0 / data.dof.aperture_ratio,
        "blades": float(data.dof.aperture_blades) if data.dof.aperture_blades >= 3 else 0.0,
        "blade_rotation": data.dof.aperture_rotation,
    }


def _split_eyes(data):
    """Make Cycles tell the shader which eye of a stereo pair it is.

    The shader is the same for both eyes, but Cycles shifts the raster of an off-axis pair: by a whole frame to each
    side, with the numbers that are set here.

    Returns
    -------
    dict
        Parameters of `camera.osl` for spherical stereo.
    """
    stereo = data.stereo
    spherical = data.type == "PANO" and stereo.use_spherical_stereo
    off_axis = data.type != "PANO" and stereo.convergence_mode == "OFFAXIS"
    parameters = {}
    if spherical:
        parameters["interocular"] = stereo.interocular_distance
        if stereo.convergence_mode != "PARALLEL":
            parameters["convergence"] = stereo.convergence_distance
        if stereo.use_pole_merge:
            parameters["pole_merge"] = (stereo.pole_merge_angle_from, stereo.pole_merge_angle_to, 0.0)
        stereo.use_spherical_stereo = False
        stereo.pivot = "CENTER"
    if spherical or off_axis:
        stereo.convergence_mode = "OFFAXIS"
        stereo.convergence_distance = stereo.interocular_distance * (0.5 if stereo.pivot == "CENTER" else 1.0)
        data.sensor_width = data.lens
    elif stereo.convergence_mode == "OFFAXIS":
        stereo.convergence_mode = "PARALLEL"
    return parameters


def _make_custom(written, data, render, region, film, parameters):
    """Give the camera our shader, which knows the rest by its parameters, these and those of film and lens."""
    for part in (data, data.stereo):
        written.keep(part, *values(part))
    parameters = _lens(data, film) | {"frame_size": (*map(float, region.frame), 1.0)} | parameters
    if _is_stereo(render):
        parameters |= _split_eyes(data)
    for name in list(data.cycles_custom.keys()):
        del data.cycles_custom[name]
    for name, value in parameters.items():
        data.cycles_custom[name] = value
    if data.type != "PANO":
        # Cycles measures the clip distances of a custom camera along the ray instead of the axis.  The shader starts
        # the ray at the near clip itself; the far one is kept just far enough that no corner of the film loses
        # anything.
        reach = 1.0
        if data.type == "PERSP":
            far = [max(abs(corner), abs(corner + size)) for corner, size in zip(film.corner, film.size, strict=True)]
            reach = (1.0 + far[0] ** 2 + far[1] ** 2) ** 0.5
        data.clip_end = reach * data.clip_end
        data.clip_start = 1e-6
    data.shift_x = data.shift_y = 0.0
    bytecode, digest = _shader()
    data.custom_mode = "INTERNAL"
    data.custom_bytecode = bytecode
    data.custom_bytecode_hash = digest
    data.type = "CUSTOM"
