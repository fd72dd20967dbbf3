# SPDX-License-Identifier: GPL-3.0-or-later
"""The camera of one cell: its raster shows one pixel of each period, if wanted through one point of the lens only.

It is the scene's own camera, written to on its evaluated copy, so it needs no Open Shading Language but for panoramas
whose film has no number for its size.  The film is that of `blender_camera_viewplane()`, the lens that of
`kernel/camera/camera.h`.
"""

import numpy as np
from cycles.engine import with_osl

from ..blender.refusal import Refused
from ..blender.region import Region
from . import camera_film, exposure, osl_camera

# Panoramas whose film Cycles itself can make larger than the frame: by the sensor's size, or by the range that is seen.
# (That of an equirectangular one ends at the poles; the others have no number for it in `kernel/camera/projection.h`.)
_BY_SENSOR = {"FISHEYE_EQUISOLID", "FISHEYE_LENS_POLYNOMIAL"}
_BY_RANGE = {"CENTRAL_CYLINDRICAL"}
# In a square frame this is a polynomial of the first degree.
_BY_SENSOR_IF_SQUARE = {"FISHEYE_EQUIDISTANT"}


def check(scene, camera):
    """Raise `Refused` if sub-frames cannot be seen through this camera object (or None) of the scene."""
    osl_camera.check_is_camera(camera)
    data = camera.data
    if data.type == "CUSTOM":
        raise Refused(
            f'Camera "{camera.name}" is custom (OSL), of which sub-frames cannot take single pixels; '
            "use another lens type, or set Method to In Place"
        )
    if not _can_be_enlarged(data, Region.of_render(scene.render), scene.render) and not with_osl():
        kind = data.bl_rna.properties["panorama_type"].enum_items[data.panorama_type].name
        raise Refused(
            f'Camera "{camera.name}" is panoramic ({kind}), which sub-frames give by Open Shading Language only; '
            "use another camera, or set Method to In Place"
        )


def cameras(engine, scene):
    """The evaluated camera objects that a picture of this evaluated scene is seen through; `Refused` as `check`."""
    found = []
    for _, camera in osl_camera.cameras(engine, scene):
        check(scene, camera)
        if camera not in found:
            if any(camera.data == other.data for other in found):
                raise Refused(
                    f'Cameras that share the data "{camera.data.name}" cannot be rendered together by sub-frames; '
                    "make it a single user, or set Method to Gather"
                )
            found.append(camera)
    return found


def aim(written, camera, render, region, side, first, lens_numbers=None):
    """Make an evaluated camera object that of a cell.

    Parameters
    ----------
    written : Overwritten
    camera : bpy.types.Object
    render : bpy.types.RenderSettings
    region : Region
    side : int
        Pixels of the film from one pixel of the raster to the next.
    first : float array, shape (2,)
        What the middle of the region's first pixel shows: a position on the film, in pixels of the frame.
    lens_numbers : float array, shape (2,), optional
        The lens point, as numbers in [0, 1); Cycles' own lens by default.
    """
    data, frame = camera.data, np.array(region.frame)
    # Shift counts in widths (or heights) of the sensor, but of the frame in a panorama.
    span = np.ones(2)
    if data.type != "PANO":
        sides = camera_film.sides(region, render)
        span = sides / sides[0 if camera_film.is_horizontal(data, region, render) else 1]
    # Raster position p shows the film position first + side * (p - raster).
    raster = np.add(region.corner, 0.5)
    shift = (data.shift_x, data.shift_y) + span * ((first + side * (0.5 * frame - raster)) / frame - 0.5)
    if lens_numbers is not None and _stops_down(camera, render):
        shift = shift - _stop_down(written, camera, lens_numbers)
    if _can_be_enlarged(data, region, render):
        _enlarge(written, data, side)
    elif side > 1:
        osl_camera.enlarge(written, data, render, region, side)
    written.set(data, shift_x=shift[0] / side, shift_y=shift[1] / side)


def _stops_down(camera, render):
    """Whether the lens is open, and a pinhole at one of its points sees what that point does.

    Otherwise Cycles' own lens stays: all pixels of a sub-frame draw the same point there, too, that of the sequence.
    """
    dof, stereo = camera.data.dof, camera.data.stereo
    # Blender turns eyes that toe in where they stand.
    is_turned = render.use_multiview and render.views_format == "STEREO_3D" and stereo.convergence_mode == "TOE"
    return dof.use_dof and camera.data.type != "PANO" and not is_turned and _focus_distance(camera) > 0.0


def _stop_down(written, camera, lens_numbers):
    """Close the lens but for one point; return by how much to move the film, in the units of shift."""
    data, distance = camera.data, _focus_distance(camera)
    point = np.append(camera_film.lens_radius(data) * exposure.lens_points(lens_numbers, data.dof), 0.0)
    matrix = camera.matrix_world.copy()
    axes = np.array(matrix.normalized().to_3x3())
    if data.type == "ORTHO":
        # All rays run along one tilted axis, from a film that stays as it was; the near clip is upright, too.
        backwards = np.append(point[:2], distance)
        backwards /= np.linalg.norm(backwards)
        moved = point - data.clip_start * (1.0 / backwards[2] - 1.0) * backwards
        for row in range(3):
            matrix[row][2] = axes[row] @ backwards
        shift = np.zeros(2)
    else:
        # What is in focus must not move in the picture.
        moved = point
        shift = point[:2] / distance * data.lens / camera_film.sensor(data)
    for row in range(3):
        matrix[row][3] += axes[row] @ moved
    written.move(camera, matrix)
    written.set(data.dof, use_dof=False)
    return shift


def _can_be_enlarged(data, region, render):
    """Whether Cycles itself can make the film of this camera larger than the frame."""
    width, height = camera_film.sides(region, render)
    by_sensor = _BY_SENSOR | (_BY_SENSOR_IF_SQUARE if width == height else set())
    return data.type != "PANO" or data.panorama_type in by_sensor | _BY_RANGE


def _enlarge(written, data, side):
    """Make the film so many times larger; with the sensor also the distance between the films of a stereo pair."""
    if data.type == "PANO" and data.panorama_type in _BY_SENSOR_IF_SQUARE:
        terms = {f"fisheye_polynomial_k{power}": 0.0 for power in range(5)}
        terms["fisheye_polynomial_k1"] = -data.fisheye_fov / camera_film.sensor(data)
        written.set(data, panorama_type="FISHEYE_LENS_POLYNOMIAL", **terms)
    if data.type != "PANO" or data.panorama_type in _BY_SENSOR:
        written.set(data, sensor_width=side * data.sensor_width, sensor_height=side * data.sensor_height)
    if data.type == "ORTHO":
        written.set(data, ortho_scale=side * data.ortho_scale)
    if data.type == "PANO" and data.panorama_type in _BY_RANGE:
        for axis in "uv":
            names = [f"central_cylindrical_range_{axis}_{end}" for end in ("min", "max")]
            low, high = (getattr(data, name) for name in names)
            middle, half = 0.5 * (low + high), 0.5 * side * (high - low)
            written.set(data, **dict(zip(names, (middle - half, middle + half), strict=True)))


def _focus_distance(camera):
    """Distance of the plane in focus along the camera's axis, as `blender_camera_focal_distance()`."""
    dof = camera.data.dof
    target = dof.focus_object
    if target is None:
        return dof.focus_distance
    place = target.matrix_world
    if target.pose and dof.focus_subtarget in target.pose.bones:
        place = place @ target.pose.bones[dof.focus_subtarget].matrix
    return abs(camera.matrix_world.normalized().col[2].xyz.dot(camera.matrix_world.translation - place.translation))
