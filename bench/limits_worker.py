# SPDX-License-Identifier: GPL-3.0-or-later
"""The process that records what Cycles makes of a file by parts of sequences, ``python -m bench.limits_worker ORDER``.

The order, in JSON, names the .blend file (``blend``), the ``width`` of the pictures, the ``parts`` (each a sequence's
length, a first sample and a count) and the ``record`` to write: an .npz of ``pictures``, float16 of shape (parts,
height, width, 3), means over each part's samples, and ``cost``, milliseconds of a sample of each pixel as Cycles'
*Render Time* pass has it in the longest part.
"""

import json
import os
import sys
import tempfile

import bpy
import numpy as np

from addon.blender import openimageio
from bench.real_worker import equal_terms, sample
from generator.atomic_file import written_whole


def main(order: dict) -> None:
    """Render all parts and write the record."""
    bpy.ops.wm.open_mainfile(filepath=order["blend"], load_ui=False, use_scripts=False)
    scene = bpy.context.scene
    equal_terms(scene, order["width"])
    sample(scene, {"rule": "even", "value": 1, "seed": 1, "denoise": False})
    scene.cycles.sampling_pattern, scene.cycles.use_sample_subset = "BLUE_NOISE", True
    for layer in scene.view_layers:
        layer.cycles.pass_render_time = True
    pictures, costs = [], []
    for length, first, count in order["parts"]:
        scene.cycles.samples, scene.cycles.sample_offset, scene.cycles.sample_subset_length = length, first, count
        bpy.ops.render.render()
        picture, cost = _rendered(scene)
        pictures.append(picture.astype(np.float16))
        costs.append(cost / count)
    longest = max(range(len(costs)), key=lambda part: order["parts"][part][2])
    with written_whole(order["record"]) as temporary:
        np.savez(temporary, pictures=np.array(pictures), cost=costs[longest])


def _rendered(scene: bpy.types.Scene) -> tuple[np.ndarray, np.ndarray]:
    """Return the last render's light, and the time of all samples of each pixel, rows from the bottom."""
    image = scene.render.image_settings
    image.media_type, image.file_format = "MULTI_LAYER_IMAGE", "OPEN_EXR_MULTILAYER"
    image.color_depth, image.exr_codec = "32", "NONE"
    oiio = openimageio.load()
    with tempfile.TemporaryDirectory(prefix="bench-") as folder:
        path = os.path.join(folder, "picture.exr")
        bpy.data.images["Render Result"].save_render(path, scene=scene)
        planes = {}
        for part in range(oiio.ImageBuf(path).nsubimages):
            image = oiio.ImageBuf(path, part, 0)
            planes |= zip(image.spec().channelnames, np.moveaxis(image.get_pixels(oiio.FLOAT)[::-1], 2, 0), strict=True)

    def channel(ending: str) -> np.ndarray:
        return next(plane for name, plane in planes.items() if name.endswith(ending))

    light = np.stack([channel(f"Combined.{each}") for each in "RGB"], axis=-1)
    return np.clip(np.nan_to_num(light), -6e4, 6e4), channel("Render Time.X")


if __name__ == "__main__":
    main(json.loads(sys.argv[1]))
