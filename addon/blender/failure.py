# SPDX-License-Identifier: GPL-3.0-or-later
"""Saying no: a render that cannot be done ends with one clear line, in Blender's own way."""

import atexit
import os
import shutil
import traceback

import bpy

from .refusal import Cancelled, Refused

#: What went wrong in renders that were completed all the same: who waits for their end (a command line) clears it.
warnings = []


def report(engine, message, kind="ERROR"):
    """Show `message` as the render's error; on the command line also make Blender's exit code 1.

    An ERROR ends the render, and no picture is written; after a WARNING it goes on.

    Blender ends with code 0 after `blender -b scene.blend -f 1` whatever the engine reports, which a farm would take
    for success.  Inside Python (the `bpy` module, scripts) the operator raises `RuntimeError` as for any engine.
    """
    if kind == "WARNING":
        warnings.append(message)
    engine.report({kind}, message)
    engine.error_set(message)
    if bpy.app.background and not bpy.app.module:
        atexit.unregister(_fail)
        atexit.register(_fail, bpy.app.tempdir)


def attempt(engine, action, *arguments):
    """Call `action`; whatever it raises is shown as the render's error.

    Where something went wrong that was not refused goes to the console.  Nothing is raised: Blender would keep the
    error, and by it the engine, which it frees.
    """
    try:
        action(engine, *arguments)
    except Refused as refused:
        report(engine, str(refused))
    except Cancelled:
        pass  # as Blender knows
    except (OSError, MemoryError) as error:
        report(engine, f"Cannot render: {error}")
    except Exception as error:
        traceback.print_exc()
        report(engine, f"Spectral Tiles failed, see the console: {type(error).__name__}: {error}")


def _fail(folder):
    shutil.rmtree(folder, ignore_errors=True)  # as Blender does when it ends by itself
    os._exit(1)
