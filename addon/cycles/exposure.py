# SPDX-License-Identifier: GPL-3.0-or-later
"""From a sample's random numbers to the moment, the lens point and the place in the pixel that they stand for.

The maps are Cycles' own: `scene/camera.cpp` (shutter), `kernel/sample/mapping.h` and `kernel/camera/camera.h`
(aperture, also in `camera.osl`), `scene/film.cpp` (pixel filter).
"""

import numpy as np

# Steps of the tables that invert a distribution; Cycles' have 256 and 1024.
_STEPS = 1024


def _drawn(numbers, density, first, last):
    """Numbers in [0, 1) turned into positions with that density (callable) between `first` and `last`."""
    edges = np.linspace(first, last, _STEPS + 1)
    weights = density(0.5 * (edges[1:] + edges[:-1]))
    total = np.concatenate(([0.0], np.cumsum(weights)))
    # Where there is no weight at all, Cycles takes the last step.
    total[-1] = total[-1] or 1.0
    return np.interp(numbers, total / total[-1], edges)


def shutter_times(numbers, render):
    """When the samples are taken, in frames from the current one.

    Parameters
    ----------
    numbers : float array
        In [0, 1).
    render : bpy.types.RenderSettings

    Returns
    -------
    float64 array of the same shape
    """
    mapping = render.motion_blur_shutter_curve
    mapping.initialize()

    def opening(times):
        return np.array([max(0.0, mapping.evaluate(mapping.curves[0], time)) for time in times])

    first = {"START": 0.0, "CENTER": -0.5, "END": -1.0}[render.motion_blur_position]
    return render.motion_blur_shutter * (first + _drawn(numbers, opening, 0.0, 1.0))


def blackman_harris(x, half):
    """`filter_func_blackman_harris()` of Cycles' scene/film.cpp, between -half and half."""
    angle = np.pi * (x / half + 1.0)
    return 0.35875 - 0.48829 * np.cos(angle) + 0.14128 * np.cos(2.0 * angle) - 0.01168 * np.cos(3.0 * angle)


def filter_offsets(numbers, kind, width):
    """Where in the pixel the samples are taken, from its centre, in pixels.

    Parameters
    ----------
    numbers : float array
        In [0, 1).
    kind : str
        `scene.cycles.pixel_filter_type`.
    width : float
        `scene.cycles.filter_width`, in pixels; a box is one pixel wide whatever it says.

    Returns
    -------
    float64 array of the same shape
    """
    if kind == "BOX":
        return np.asarray(numbers, float) - 0.5

    # Cycles lets a Gaussian reach three, a Blackman-Harris filter two of its widths in all.
    half = 0.5 * width * {"GAUSSIAN": 3.0, "BLACKMAN_HARRIS": 2.0}[kind]

    def density(x):
        return np.exp(-2.0 * (3.0 * x / half) ** 2) if kind == "GAUSSIAN" else blackman_harris(x, half)

    return _drawn(numbers, density, -half, half)


def lens_points(numbers, dof):
    """Where the samples' rays pass a lens of radius 1.

    Parameters
    ----------
    numbers : float array, shape (..., 2)
        In [0, 1).
    dof : bpy.types.CameraDOFSettings

    Returns
    -------
    float64 array of the same shape
        On the camera's x and y axes.
    """
    u, v = np.moveaxis(np.asarray(numbers, float), -1, 0)
    points = _disk_points(u, v) if dof.aperture_blades < 3 else _polygon_points(dof, u, v)
    return points * (1.0 / dof.aperture_ratio, 1.0)


def _disk_points(u, v):
    """`sample_uniform_disk()`: Shirley and Chiu's concentric map."""
    a, b = 2.0 * u - 1.0, 2.0 * v - 1.0
    wide = a * a > b * b
    radius = np.where(wide, a, b)
    ratio = np.where(wide, b, a) / np.where(radius == 0.0, 1.0, radius)
    angle = np.where(wide, np.pi / 4 * ratio, np.pi / 2 - np.pi / 4 * ratio)
    return np.stack((radius * np.cos(angle), radius * np.sin(angle)), axis=-1)


def _polygon_points(dof, u, v):
    """`regular_polygon_sample()`: choose a triangle of the polygon by u, then a point in it."""
    corner = np.floor(u * dof.aperture_blades)
    s = np.sqrt(u * dof.aperture_blades - corner)
    a, b = 1.0 - s, v * s
    angle = np.pi / dof.aperture_blades
    x, y = (a + b) * np.cos(angle), (a - b) * np.sin(angle)
    turn = dof.aperture_rotation + 2.0 * corner * angle
    return np.stack((np.cos(turn) * x - np.sin(turn) * y, np.sin(turn) * x + np.cos(turn) * y), axis=-1)
