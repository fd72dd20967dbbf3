# SPDX-License-Identifier: GPL-3.0-or-later
"""Which camera adaptive subdivision is diced by, where that of the render is not the user's."""

import contextlib

import bpy

from ..blender.evaluated import put_back, values


@contextlib.contextmanager
def user_camera(session, cameras):
    """Make Cycles dice adaptive subdivision by a camera as it is now, for the time of a `with` block.

    A custom camera does not tell it the size of a pixel (`Camera::world_to_raster_size` of Cycles), that of a
    sub-frame tells another one.

    Parameters
    ----------
    session : Session
    cameras : iterable of bpy.types.Object
        The evaluated cameras that will be written to.
    """
    scene = session.scene
    chosen = scene.cycles.dicing_camera
    replaced = [camera for camera in cameras if chosen is None or chosen.data == camera.data]
    if not replaced:
        yield
        return
    with bpy.data.temp_data() as made:
        data = made.cameras.new(replaced[0].data.name)
        put_back(data, values(replaced[0].data))
        camera = made.objects.new("Dicing", data)
        camera.matrix_world = (chosen or replaced[0]).matrix_world
        scene.cycles.dicing_camera = camera
        try:
            yield
        finally:
            scene.cycles.dicing_camera = chosen
