# SPDX-License-Identifier: GPL-3.0-or-later
"""Where a camera's film lies, how large it is, and how wide its lens (Cycles' `blender/camera.cpp`)."""

import math
from typing import NamedTuple

import numpy as np


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


def sides(region, render):
    """Width and height of the frame, float array, to be compared."""
    return np.multiply(region.frame, (render.pixel_aspect_x, render.pixel_aspect_y))


def is_horizontal(data, region, render):
    """Whether the sensor's size is the film's width."""
    width, height = sides(region, render)
    return width > height if data.sensor_fit == "AUTO" else data.sensor_fit == "HORIZONTAL"


def sensor(data):
    """Size of the sensor along the side that counts, in millimetres."""
    return data.sensor_height if data.sensor_fit == "VERTICAL" else data.sensor_width


def lens_radius(data):
    """Radius of the open lens, in units of the scene."""
    radius = 1.0 / (2.0 * max(data.dof.aperture_fstop, 1e-5))
    return radius if data.type == "ORTHO" else 1e-3 * data.lens * radius


def of_camera(data, render, region):
    """Film of a camera's data, for a frame of a region's size."""
    x_ratio, y_ratio = sides(region, render)
    horizontal, film_sensor = is_horizontal(data, region, render), sensor(data)
    aspect = x_ratio / y_ratio if horizontal else y_ratio / x_ratio
    if data.type == "PANO":
        sensor_size = (film_sensor, film_sensor / aspect) if horizontal else (film_sensor / aspect, film_sensor)
        corner, size = _panorama_plane(data, sensor_size)
        shifted = (corner[0] + data.shift_x * size[0], corner[1] + data.shift_y * size[1])
        return Film(data.panorama_type, shifted, size, 0.0)
    half_x, half_y = (aspect, 1.0) if horizontal else (1.0, aspect)
    orthographic = data.type == "ORTHO"
    scale = data.ortho_scale / (2.0 * aspect) if orthographic else 0.5 * film_sensor / data.lens / aspect
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
