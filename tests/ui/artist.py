# SPDX-License-Identifier: GPL-3.0-or-later
"""Hands and eyes of `session.py`, inside Blender: keys, waiting, screenshots, notes."""

import importlib
import json
import os
import subprocess
import time

import bpy

FOLDER = os.getcwd()
FACTS = {}

# Seconds for a render, on a busy machine.
RENDER = 120

# By its name xdotool would press F12 together with Alt, which the display's keymap has too; this is its code.
F12, ESCAPE = "96", "Escape"


def note(**facts):
    """Keep facts for the tests."""
    FACTS.update(facts)
    with open(os.path.join(FOLDER, "facts.json"), "w", encoding="utf-8") as file:
        json.dump(FACTS, file, indent=1)


def shoot(name):
    """Take a picture of the whole screen."""
    subprocess.run(["import", "-window", "root", os.path.join(FOLDER, f"{name}.png")], check=True)


def press(key):
    """Press a key over the middle of the 3D view, or what Blender shows in its place."""
    subprocess.run(["xdotool", "mousemove", "500", "400", "key", key], check=True)


def area(kind):
    return next(found for found in bpy.context.window_manager.windows[0].screen.areas if found.type == kind)


def looking_at(kind):
    """Context of an area of the main window."""
    window = bpy.context.window_manager.windows[0]
    found = area(kind)
    region = next(part for part in found.regions if part.type == "WINDOW")
    return bpy.context.temp_override(window=window, area=found, region=region)


def rendering():
    return bpy.app.is_job_running("RENDER")


def idle(seconds):
    """Wait while Blender draws."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        yield


def until(condition, seconds=RENDER):
    """Wait for `condition()`; raises TimeoutError."""
    end = time.monotonic() + seconds
    while not condition():
        if time.monotonic() > end:
            raise TimeoutError(f"still waiting after {seconds} s")
        yield


def redraw():
    for window in bpy.context.window_manager.windows:
        for found in window.screen.areas:
            found.tag_redraw()


def full_screen(name, seconds=1.0):
    """Take a picture of the properties alone on the screen."""
    with looking_at("PROPERTIES"):
        bpy.ops.screen.screen_full_area()
    yield from idle(seconds)
    redraw()  # panels have their new heights only in the next drawing
    yield from idle(0.5)
    shoot(name)
    with looking_at("PROPERTIES"):
        bpy.ops.screen.back_to_previous()
    yield from idle(0.3)


def beside(name):
    """Take a picture of the properties beside the 3D view, as wide as people have them."""
    for _ in range(4):  # panels move to their new heights
        redraw()
        yield from idle(0.5)
    shoot(name)


def rendered():
    """F12, to its end."""
    press(F12)
    yield from until(rendering, 10)
    yield from until(lambda: not rendering())
    yield from idle(0.5)


def back():
    """Leave the picture for the 3D view."""
    for _ in range(3):
        press(ESCAPE)
        yield from idle(0.5)
        if any(found.type == "VIEW_3D" for found in bpy.context.window_manager.windows[0].screen.areas):
            return


def escape(fact):
    """Press Esc while a render runs, and note how long it takes to end."""
    start = time.monotonic()
    press(ESCAPE)
    yield from until(lambda: not rendering())
    note(**{fact: round(time.monotonic() - start, 2)})


def save_result(name):
    """The render result as a float EXR."""
    settings = bpy.context.scene.render.image_settings
    before = settings.file_format, settings.color_depth
    settings.file_format, settings.color_depth = "OPEN_EXR", "32"
    bpy.data.images["Render Result"].save_render(os.path.join(FOLDER, f"{name}.exr"))
    settings.file_format, settings.color_depth = before


def settings():
    return bpy.context.scene.spectral_tiles


def module(name):
    """A module of the installed extension."""
    return importlib.import_module(f"bl_ext.user_default.spectral_tiles.addon.{name}")


def plain_properties(data, depth=3):
    """All plain properties of data of Blender's, and of what belongs to it, by path."""
    found = {}
    for prop in data.bl_rna.properties:
        if prop.identifier in {"rna_type", "is_evaluated", "animation_data", "original", "depsgraph", "session_uid"}:
            continue
        value = getattr(data, prop.identifier)
        if prop.type in {"BOOLEAN", "INT", "FLOAT", "STRING", "ENUM"}:
            plain = isinstance(value, (bool, int, float, str))
            found[prop.identifier] = value if plain else repr(value if isinstance(value, set) else list(value))
        elif prop.type == "POINTER" and depth and value is not None and not isinstance(value, bpy.types.ID):
            found |= {f"{prop.identifier}.{key}": deep for key, deep in plain_properties(value, depth - 1).items()}
    return found


def everything_set():
    """What the user has set in the scene, its view layer, camera and world."""
    scene = bpy.context.scene
    parts = {"scene": scene, "camera": scene.camera, "lens": scene.camera.data, "world": scene.world}
    parts["layer"] = scene.view_layers[0]
    return {f"{name}.{key}": value for name, part in parts.items() for key, value in plain_properties(part).items()}
