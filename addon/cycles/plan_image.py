# SPDX-License-Identifier: GPL-3.0-or-later
"""A sample plan as an image that `camera.osl` reads."""

import numpy as np

from ..blender import openimageio
from ..blender.refusal import Refused


def write(plan, path):
    """Write film column and row, then the lens shift, as 16-bit integers.

    Parameters
    ----------
    plan : Plan
    path : str

    Raises
    ------
    Refused
        The folder is not writable, the disk is full.
    """
    entries = np.zeros((plan.film.size, 4), np.uint16)
    entries[:, 0] = plan.film % np.int32(plan.width)
    entries[:, 1] = plan.film // np.int32(plan.width)
    if plan.lens_shift is not None:
        # A shift by 1 may come out as 65535 / 65535; modulo 1 that is the same as none.
        entries[:, 2:] = np.rint(65535.0 * plan.lens_shift)
    image = openimageio.load().ImageBuf(entries.reshape(-1, plan.width, 4))
    image.specmod().attribute("compression", "none")
    if not image.write(path):
        raise Refused(f"Cannot write the sample plan to {path}: {image.geterror()}")
