# SPDX-License-Identifier: GPL-3.0-or-later
"""What an artist does, done in a Blender window; run by `tests/ui/test_window.py`, never imported.

Each step notes what it saw in `facts.json` in the current folder and takes a screenshot; judging them is up to the
tests.
"""

import importlib
import json
import os
import subprocess
import time
import traceback

import bpy

FOLDER = os.getcwd()
FACTS = {}

# Seconds for a render, on a busy machine.
RENDER = 120

# By its name xdotool would press F12 together with Alt, which the display's keymap has too; this is its code.
F12, ESCAPE = "96", "Escape"


def note(**facts):
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


def until(condition, seconds):
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


def module(name):
    """A module of the installed extension."""
    return importlib.import_module(f"bl_ext.user_default.spectral_tiles.addon.{name}")


def install():
    bpy.ops.screen.userpref_show("INVOKE_DEFAULT", section="EXTENSIONS")
    yield from idle(1)
    archive = os.path.join(FOLDER, "spectral_tiles.zip")
    bpy.ops.extensions.package_install_files(
        "EXEC_DEFAULT", filepath=archive, repo="user_default", enable_on_install=True
    )
    yield from idle(1)
    shoot("preferences")
    note(enabled="bl_ext.user_default.spectral_tiles" in bpy.context.preferences.addons)
    with bpy.context.temp_override(window=bpy.context.window_manager.windows[-1]):
        bpy.ops.wm.window_close()
    yield from idle(0.5)


def build_scene():
    """Blender's first scene, with a turning cube, an open lens and a bright world, small."""
    scene = bpy.context.scene
    scene.render.engine = "SPECTRAL_TILES"
    scene.render.resolution_x, scene.render.resolution_y = 80, 60
    scene.render.filepath = os.path.join(FOLDER, "frame_")
    scene.render.use_motion_blur = True
    scene.cycles.use_denoising = False  # Debian's Blender lacks what our denoising needs
    scene.camera.data.dof.use_dof = True
    cube = bpy.data.objects["Cube"]
    for frame in (1, 4):
        cube.rotation_euler[2] = 0.3 * frame
        cube.keyframe_insert("rotation_euler", frame=frame)
    scene.frame_set(1)
    area("PROPERTIES").spaces[0].context = "RENDER"
    yield from idle(0.5)


def panel():
    scene, layer = bpy.context.scene, bpy.context.view_layer
    forecast = module("forecast")
    with looking_at("PROPERTIES"):
        bpy.ops.screen.screen_full_area()
    yield from idle(1)
    shoot("panel_automatic")
    scene.spectral_tiles.tile = "SPECTRAL_64"
    redraw()
    yield from idle(1)
    shoot("panel_tile")
    icons = module("tile_picture").icons(module("library").tile(scene.spectral_tiles))
    note(uses=forecast.uses(scene, layer), refusals=forecast.refusals(scene, layer), icons=icons)
    note(overhead=forecast.overhead(scene, layer))
    scene.spectral_tiles.tile = "AUTO"
    # As it is where there is Open Shading Language, which Debian's Blender lacks.
    driver = module("driver")
    check_build, driver.check_build = driver.check_build, lambda: None
    redraw()
    yield from idle(1)
    shoot("panel_gather")
    note(overhead_of_gather=forecast.overhead(scene, layer))
    driver.check_build = check_build
    scene.camera.data.type = "CUSTOM"
    redraw()
    yield from idle(1)
    shoot("panel_in_place")
    note(calls_with_custom_camera=forecast.render_calls(scene, layer))
    scene.spectral_tiles.driver = "SUBRENDER"
    redraw()
    yield from idle(1)
    shoot("panel_refused")
    note(refusals_of_custom_camera=forecast.refusals(scene, layer))
    scene.spectral_tiles.driver, scene.camera.data.type = "AUTO", "PERSP"
    scene.cycles.use_denoising = True
    note(refusals_of_denoising=forecast.refusals(scene, layer))
    scene.cycles.use_denoising = False
    with looking_at("PROPERTIES"):
        bpy.ops.screen.back_to_previous()
    yield from idle(1)


def undo():
    settings = bpy.context.scene.spectral_tiles
    for samples in (3, 5):
        settings.samples = samples
        with looking_at("VIEW_3D"):
            bpy.ops.ed.undo_push(message="Samples")
    with looking_at("VIEW_3D"):
        bpy.ops.ed.undo()
    note(samples_after_undo=bpy.context.scene.spectral_tiles.samples)
    yield


def save_result(name):
    """The render result as a float EXR."""
    settings = bpy.context.scene.render.image_settings
    before = settings.file_format, settings.color_depth
    settings.file_format, settings.color_depth = "OPEN_EXR", "32"
    bpy.data.images["Render Result"].save_render(os.path.join(FOLDER, f"{name}.exr"))
    settings.file_format, settings.color_depth = before


def still():
    """F12, on the keyboard."""
    bpy.context.scene.spectral_tiles.samples = 1
    press(F12)
    yield from until(rendering, 10)
    yield from until(lambda: not rendering(), RENDER)
    yield from idle(1)
    shoot("still")
    save_result("still")
    press(ESCAPE)
    yield from idle(0.5)


def escape(fact):
    """Press Esc while a render runs, and note how long it takes to end."""
    start = time.monotonic()
    press(ESCAPE)
    yield from until(lambda: not rendering(), RENDER)
    note(**{fact: round(time.monotonic() - start, 2)})


def cancel():
    """F12 for a long render, then Esc."""
    bpy.context.scene.spectral_tiles.samples = 1024
    press(F12)
    yield from until(rendering, 10)
    yield from idle(4)
    shoot("cancel")
    note(was_rendering=rendering())
    yield from escape("seconds_to_cancel")
    press(ESCAPE)
    yield from idle(0.5)


def many():
    """Thousands of sub-renders, one picture after the other."""
    bpy.context.scene.spectral_tiles.samples = 64
    for number in range(10):
        bpy.ops.render.render("INVOKE_DEFAULT")
        yield from until(rendering, 10)
        yield from until(lambda: not rendering(), RENDER)
        note(pictures=number + 1)
        yield from idle(0.2)
    press(ESCAPE)
    yield from idle(0.5)


def animation():
    scene = bpy.context.scene
    scene.spectral_tiles.samples = 1
    scene.frame_start, scene.frame_end = 1, 3
    bpy.ops.render.render("INVOKE_DEFAULT", animation=True)
    yield from until(rendering, 10)
    yield from until(lambda: not rendering(), RENDER)
    yield from idle(0.5)
    shoot("animation")
    press(ESCAPE)
    yield from idle(0.5)


def compare():
    """Compare with Cycles, and both slots."""
    bpy.context.scene.spectral_tiles.samples = 1
    slots = bpy.data.images["Render Result"].render_slots
    bpy.ops.spectral_tiles.compare("INVOKE_DEFAULT")
    yield from until(rendering, 10)
    yield from until(lambda: not rendering() and slots.active.name == "Spectral Tiles", RENDER)
    yield from idle(1)
    names = [slot.name for slot in slots]
    for name in ("Cycles", "Spectral Tiles"):
        slots.active_index = names.index(name)
        redraw()
        yield from idle(0.5)
        shoot(f"slot_{name}")
        save_result(name)
    note(slots=names, native_afterwards=module("engine").SpectralTilesRender.native)
    press(ESCAPE)
    yield from idle(0.5)


def generate():
    """Generate a tile in the background; then another one, which is cancelled."""
    settings = bpy.context.scene.spectral_tiles
    making = module("tile_making")
    path = os.path.join(FOLDER, "made.npz")
    bpy.ops.spectral_tiles.generate_tile("EXEC_DEFAULT", filepath=path, method="scanning", size="64")
    yield from until(lambda: making.job.fraction > 0.3, 60)
    redraw()
    yield from idle(0.2)
    shoot("generating")
    yield from until(lambda: making.job is None, 120)
    note(tile=settings.tile, tile_path_is_right=settings.tile_path == path, tile_size=os.path.getsize(path))
    bpy.ops.spectral_tiles.generate_tile("EXEC_DEFAULT", filepath=os.path.join(FOLDER, "cancelled.npz"), size="128")
    yield from until(lambda: making.job.fraction > 0.0, 60)
    start = time.monotonic()
    bpy.ops.spectral_tiles.cancel_tile()
    yield from until(lambda: making.job is None, 30)
    note(seconds_to_cancel_tile=round(time.monotonic() - start, 2), tile_path_kept=settings.tile_path == path)
    note(cancelled_file_is_there=os.path.exists(os.path.join(FOLDER, "cancelled.npz")))
    settings.tile = "AUTO"
    yield


def presets():
    """A preset of the user's own is added, used and removed."""
    settings = bpy.context.scene.spectral_tiles
    settings.samples = 11
    bpy.ops.spectral_tiles.preset_add(name="Mine")
    settings.samples = 1
    path = bpy.utils.preset_find("Mine", "spectral_tiles")
    bpy.ops.script.execute_preset(filepath=path, menu_idname="SPECTRAL_TILES_PT_presets")
    note(samples_of_own_preset=settings.samples)
    bpy.ops.spectral_tiles.preset_add(name="Mine", remove_name=True)
    note(own_preset_afterwards=bpy.utils.preset_find("Mine", "spectral_tiles"))
    yield


def off_and_on():
    """Switch the extension off and on in the preferences, twenty times."""
    for _ in range(20):
        bpy.ops.preferences.addon_disable(module="bl_ext.user_default.spectral_tiles")
        yield
        bpy.ops.preferences.addon_enable(module="bl_ext.user_default.spectral_tiles")
        yield
    yield from idle(0.5)
    note(engine_afterwards=bpy.context.scene.render.engine, samples_afterwards=bpy.context.scene.spectral_tiles.samples)


def refused():
    """F12 and the comparison where they cannot be done: nothing is rendered, and Blender goes on."""
    scene = bpy.context.scene
    scene.spectral_tiles.driver, scene.camera.data.type = "SUBRENDER", "CUSTOM"
    press(F12)
    yield from until(rendering, 10)
    yield from until(lambda: not rendering(), RENDER)
    shoot("refused")
    try:
        bpy.ops.spectral_tiles.compare("INVOKE_DEFAULT")
    except RuntimeError as error:
        note(comparison_of_refused=str(error))
    note(renders_after_refusal=rendering())
    scene.spectral_tiles.driver, scene.camera.data.type = "AUTO", "PERSP"
    press(ESCAPE)
    yield from idle(0.5)


def preview():
    """Pictures in lists and browsers: of a red material, a green light and a blue world."""
    paint = bpy.data.materials.new("Paint")
    shader = next(node for node in paint.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
    shader.inputs["Base Color"].default_value = (0.9, 0.05, 0.05, 1)
    lamp = bpy.data.lights.new("Lamp", "POINT")
    lamp.color = (0.05, 0.9, 0.05)
    sky = bpy.data.worlds.new("Sky")
    background = next(node for node in sky.node_tree.nodes if node.type == "BACKGROUND")
    background.inputs["Color"].default_value = (0.05, 0.05, 0.9, 1)
    for thing in (paint, lamp, sky):
        thing.asset_generate_preview()
        yield from until(lambda: bpy.app.is_job_running("RENDER_PREVIEW"), 10)
        yield from until(lambda: not bpy.app.is_job_running("RENDER_PREVIEW"), RENDER)
        yield from idle(0.5)
        picture = bpy.data.images.new("Preview", *thing.preview.image_size)
        picture.pixels.foreach_set(thing.preview.image_pixels_float)
        picture.filepath_raw, picture.file_format = os.path.join(FOLDER, f"preview_{thing.name}.png"), "PNG"
        picture.save()


def render_and_cancel(name, seconds):
    """Pictures of a render after some seconds and of what is left when it is cancelled."""
    press(F12)
    yield from until(rendering, 10)
    yield from idle(seconds)
    shoot(name)
    note(**{f"{name}_was_rendering": rendering()})
    yield from escape(f"seconds_to_cancel_{name}")
    yield from idle(1)
    shoot(f"{name}_cancelled")
    press(ESCAPE)
    yield from idle(0.5)


def demo():
    """The demo scene, cancelled."""
    bpy.ops.wm.open_mainfile(filepath=os.path.join(FOLDER, "spinning_wheels.blend"), load_ui=False)
    yield from idle(1)
    scene = bpy.context.scene
    scene.render.engine = "SPECTRAL_TILES"
    scene.spectral_tiles.samples = 16
    scene.cycles.use_denoising = False
    yield from render_and_cancel("demo", 6)


def in_order():
    """What the window shows while GATHER renders, and what Esc leaves.

    Debian's Blender lacks what its camera needs, so Cycles renders by the scene's own: the pixels are in order, and
    putting them in order takes them out of it, in the window as in the result.
    """
    driver, plan, camera = (module(name) for name in ("driver", "plan", "camera"))
    before = driver.check_build, plan.Plan.write, camera.replace
    driver.check_build, plan.Plan.write, camera.replace = (lambda *_: None,) * 3
    scene = bpy.context.scene
    scene.render.resolution_percentage = 50
    scene.spectral_tiles.samples = 256
    yield from render_and_cancel("in_order", 8)
    driver.check_build, plan.Plan.write, camera.replace = before


STEPS = (
    install, build_scene, panel, undo, presets, generate, refused, still, cancel, many, animation, compare, off_and_on,
    preview, demo, in_order,
)  # fmt: skip


def story():
    view = bpy.context.preferences.view
    view.show_splash, view.render_display_type = False, "SCREEN"
    for step in STEPS:
        start = time.monotonic()
        yield from step()
        note(**{f"{step.__name__}_seconds": round(time.monotonic() - start, 1)})
    note(finished=True)


RUNNING = story()


def advance():
    try:
        next(RUNNING)
        return 0.05
    except StopIteration:
        pass
    except BaseException:
        note(error=traceback.format_exc())
        shoot("error")
    bpy.ops.wm.quit_blender()
    return None


bpy.app.timers.register(advance, first_interval=2.0, persistent=True)
