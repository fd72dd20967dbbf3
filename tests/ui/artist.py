# SPDX-License-Identifier: GPL-3.0-or-later
"""Hands and eyes of `session.py`, inside Blender: keys, waiting, screenshots, notes.

A busy machine may take a minute for what is done at once on another, and between two looks a render may have begun and
ended.  So nothing here waits for a number of seconds, or for a state that may be over: it waits for what Blender's
handlers have told (`told`), which stays told, or for a picture that stays as it is (`shoot_still`).
"""

import importlib
import json
import os
import subprocess
import time

import bpy
import numpy as np

FOLDER = os.getcwd()

#: Samples a pixel of a quick render that Automatic does not leave to Cycles.
SAMPLES = 16
FACTS = {}

# Seconds until something that does not happen is taken for an error.
PATIENCE = 180

# By its name xdotool would press F12 together with Alt, which the display's keymap has too; this is its code.
F12, ESCAPE = "96", "Escape"

# Rows and columns of the screen: the middle of a rendered picture, most of one of 240x135, the middle of the 3D view.
MIDDLE = slice(446, 486), slice(620, 660)
SMALL = slice(402, 530), slice(528, 752)
MIDDLE_OF_VIEW = slice(380, 480), slice(430, 530)

# The times at which Blender told of something, by the name of its handlers.
TOLD = {name: [] for name in ("render_init", "render_complete", "render_cancel", "frame_change_post")}


def listen():
    """Keep in `TOLD` what Blender tells, also in files that are opened later."""
    for name, times in TOLD.items():

        @bpy.app.handlers.persistent
        def keep(*_, times=times):
            times.append(time.monotonic())

        getattr(bpy.app.handlers, name).append(keep)


def told(*names, times=1):
    """Return what says whether Blender has told one of these so many times from now on."""
    before = sum(len(TOLD[name]) for name in names)
    return lambda: sum(len(TOLD[name]) for name in names) >= before + times


def note(**facts):
    """Keep facts for the tests."""
    FACTS.update(facts)
    with open(os.path.join(FOLDER, "facts.json"), "w", encoding="utf-8") as file:
        json.dump(FACTS, file, indent=1)


def look():
    """What the screen shows: uint8 array (rows from the top, columns, RGB)."""
    shot = subprocess.run(["import", "-window", "root", "-depth", "8", "ppm:-"], check=True, stdout=subprocess.PIPE)
    _, size, _, pixels = shot.stdout.split(b"\n", 3)
    width, height = map(int, size.split())
    return np.frombuffer(pixels, np.uint8).reshape(height, width, 3)


def shoot(name, seen=None):
    """Take a picture of the whole screen, or keep one that was taken."""
    seen = look() if seen is None else seen
    height, width, _ = seen.shape
    path = os.path.join(FOLDER, f"{name}.png")
    convert = ["convert", "-size", f"{width}x{height}", "-depth", "8", "rgb:-", path]
    subprocess.run(convert, check=True, input=seen.tobytes())


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


def until(condition):
    """Wait until `condition()` holds, which must stay so for a while; raises TimeoutError."""
    end = time.monotonic() + PATIENCE
    while not condition():
        if time.monotonic() > end:
            raise TimeoutError(f"still waiting after {PATIENCE} s")
        yield


def redraw():
    for window in bpy.context.window_manager.windows:
        for found in window.screen.areas:
            found.tag_redraw()


def drawn():
    """Let Blender handle what has happened and draw its windows, which it does whenever we wait."""
    redraw()
    yield
    redraw()
    yield


def shoot_still(name, looks=2):
    """Take a picture of the screen once it looks the same several times, drawn anew."""
    seen = []

    def is_still():
        redraw()
        seen.append(look())
        return len(seen) > looks and all(np.array_equal(seen[-1], before) for before in seen[-looks:])

    yield from until(is_still)
    shoot(name, seen[-1])


def shoot_alone(name):
    """Take a picture of the properties alone on the screen."""
    with looking_at("PROPERTIES"):
        bpy.ops.screen.screen_full_area()
    yield from shoot_still(name)
    with looking_at("PROPERTIES"):
        bpy.ops.screen.back_to_previous()
    yield


def rendered():
    """F12, to its end."""
    is_over = told("render_complete", "render_cancel")
    press(F12)
    yield from until(is_over)
    yield from until(lambda: not rendering())  # the job ends a little later than the render
    yield from drawn()


def half_rendered():
    """F12, until Cycles has shown how its picture grows."""
    has_begun = told("render_init")
    press(F12)
    yield from until(has_begun)
    seen = [look()[MIDDLE]]

    def has_grown():
        now = look()[MIDDLE]
        if not np.array_equal(now, seen[-1]):
            seen.append(now)
        return len(seen) > 3

    yield from until(has_grown)


def until_clear(place):
    """Wait until the picture that grows in a place of the screen has hardly any noise left."""
    seen = [means(look()[place])]

    def is_clear():
        now = means(look()[place])
        if not np.array_equal(now, seen[-1]):
            seen.append(now)
        return len(seen) > 2 and np.abs(seen[-1] - seen[-2]).mean() < 0.01 * seen[-1].mean()

    yield from until(is_clear)


def means(picture, side=8):
    """Means of a picture over squares, by which noise and the window's rounding of places hardly count."""
    height, width, _ = picture.shape
    picture = picture[: height // side * side, : width // side * side]
    return picture.reshape(height // side, side, width // side, side, 3).mean(axis=(1, 3))


def back():
    """Leave what lies over the 3D view: a message, a picture."""
    window = bpy.context.window_manager.windows[0]

    def is_back():
        press(ESCAPE)
        return any(found.type == "VIEW_3D" for found in window.screen.areas)

    yield from until(is_back)
    yield from drawn()


def escape(fact):
    """Press Esc while a render runs, and note how long it takes to end."""
    is_cancelled = told("render_cancel")
    start = time.monotonic()
    press(ESCAPE)
    yield from until(is_cancelled)
    yield from until(lambda: not rendering())
    note(**{fact: round(time.monotonic() - start, 2)})
    yield from drawn()


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
