# SPDX-License-Identifier: GPL-3.0-or-later
"""Where a camera's film lies and how large it is (`blender_camera_viewplane()` of Blender's `blender/camera.cpp`)."""

import math
from typing import NamedTuple


class Film(NamedTuple):
    """Film of a camera, in the units that `camera.osl` takes for its projection.

    Attributes
    ----------
    projection : str
    corner, size : (float, float)
        Lower left corner and size.
    eye_shift : float
        How far the left eye's film of an off-axis stereo pair lies to the right, and the right eye's to the left.
    """

    projection: str
    corner: tuple[float, float]
    size: tuple[float, float]
    eye_shift: float


def of_camera(data, render, region):
    """Film of a camera's data, for a frame of a region's size."""
    width, height = region.frame
    pixel_aspect = render.pixel_aspect_x, render.pixel_aspect_y
    x_ratio, y_ratio = width * pixel_aspect[0], height * pixel_aspect[1]
    horizontal = x_ratio > y_ratio if data.sensor_fit == "AUTO" else data.sensor_fit == "HORIZONTAL"
    sensor = data.sensor_height if data.sensor_fit == "VERTICAL" else data.sensor_width
    aspect = x_ratio / y_ratio if horizontal else y_ratio / x_ratio
    if data.type == "PANO":
        sensor_size = (sensor, sensor / aspect) if horizontal else (sensor / aspect, sensor)
        corner, size = _panorama_plane(data, sensor_size)
        shifted = (corner[0] + data.shift_x * size[0], corner[1] + data.shift_y * size[1])
        return Film(data.panorama_type, shifted, size, 0.0)
    half_x, half_y = (aspect, 1.0) if horizontal else (1.0, aspect)
    orthographic = data.type == "ORTHO"
    scale = data.ortho_scale / (2.0 * aspect) if orthographic else 0.5 * sensor / data.lens / aspect
    middle_x, middle_y = 2.0 * aspect * data.shift_x, 2.0 * aspect * data.shift_y
    # BKE_camera_multiview_shift_x
    stereo = data.stereo
    eye_shift = stereo.interocular_distance / data.sensor_width * data.lens / stereo.convergence_distance
    if stereo.pivot == "CENTER":
        eye_shift *= 0.5
    return Film(
        "ORTHOGRAPHIC" if orthographic else "PERSPECTIVE",
        (scale * (middle_x - half_x), scale * (middle_y - half_y)),
        (2.0 * scale * half_x, 2.0 * scale * half_y),
        2.0 * aspect * scale * eye_shift,
    )


def _panorama_plane(data, sensor):
    """Lower left corner and size of a panorama's film, as `panorama()` of `camera.osl` takes it."""
    if data.panorama_type == "EQUIRECTANGULAR":
        low, high = (data.longitude_min, data.latitude_min), (data.longitude_max, data.latitude_max)
    elif data.panorama_type == "CENTRAL_CYLINDRICAL":
        radius = data.central_cylindrical_radius
        low = (data.central_cylindrical_range_u_min, data.central_cylindrical_range_v_min / radius)
        high = (data.central_cylindrical_range_u_max, data.central_cylindrical_range_v_max / radius)
    else:
        half = {
            "EQUIANGULAR_CUBEMAP_FACE": (math.pi / 4, math.pi / 4),
            "MIRRORBALL": (1.0, 1.0),
            "FISHEYE_EQUIDISTANT": (data.fisheye_fov / 2, data.fisheye_fov / 2),
            "FISHEYE_EQUISOLID": (sensor[0] / 2, sensor[1] / 2),
            "FISHEYE_LENS_POLYNOMIAL": (sensor[0] / 2, sensor[1] / 2),
        }[data.panorama_type]
        low, high = (-half[0], -half[1]), half
    return low, (high[0] - low[0], high[1] - low[1])
