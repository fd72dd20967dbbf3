# SPDX-License-Identifier: GPL-3.0-or-later
"""OpenImageIO as Blender bundles it."""

import importlib
import os
import sys

import bpy

from .refusal import Refused


def load():
    """The `OpenImageIO` module that this Blender bundles.

    Blender itself has its bundled site-packages on `sys.path`; with the `bpy` wheel they lie beside the module and
    must be added.  Installing OpenImageIO from PyPI is no way out: a second copy in one process breaks `oslquery`.

    Raises
    ------
    Refused
        The build has none (distribution packages).
    """
    python = f"python{sys.version_info[0]}.{sys.version_info[1]}"
    bundled = os.path.join(bpy.utils.resource_path("LOCAL"), "python", "lib", python, "site-packages")
    if bpy.app.module and os.path.isdir(bundled) and bundled not in sys.path:
        sys.path.append(bundled)
    try:
        return importlib.import_module("OpenImageIO")
    except ImportError as error:
        raise Refused("This build of Blender has no OpenImageIO module, which Spectral Tiles needs") from error
