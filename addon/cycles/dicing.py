# SPDX-License-Identifier: GPL-3.0-or-later
"""Which camera adaptive subdivision is diced by, where that of the render is not the user's."""

import contextlib

import bpy

from ..blender.evaluated import put_back


@contextlib.contextmanager
def user_camera(session, cameras):
    """Make Cycles dice adaptive subdivision by a camera as the user made it, for the time of a `with` block.

    A custom camera does not tell it the size of a pixel (`Camera::world_to_raster_size` of Cycles), that of a
    sub-frame tells another one.

    Parameters
    ----------
    session : Session
    cameras : dict of bpy.types.Object to dict
        The evaluated cameras that are written to, and the plain values of their data as the user set them.
    """
    scene = session.scene
    chosen = scene.cycles.dicing_camera
    replaced = [camera for camera in cameras if chosen is None or chosen.data == camera.data]
    if not replaced:
        yield
        return
    with bpy.data.temp_data() as made:
        data = made.cameras.new(cameras[replaced[0]]["name"])
        put_back(data, cameras[replaced[0]])
        camera = made.objects.new("Dicing", data)
        camera.matrix_world = (chosen or replaced[0]).matrix_world
        scene.cycles.dicing_camera = camera
        try:
            yield
        finally:
            scene.cycles.dicing_camera = chosen
