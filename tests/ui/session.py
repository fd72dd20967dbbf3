# SPDX-License-Identifier: GPL-3.0-or-later
"""What an artist does, done in a Blender window; run by `tests/ui/test_window.py`, never imported.

Each step notes what it saw in `facts.json` in the current folder and takes a screenshot; judging them is up to the
tests.
"""

import os
import sys
import time
import traceback

import bpy

sys.path.append(os.getcwd())

import artist
from artist import FOLDER, area, back, drawn, looking_at, module, note, settings, shoot, shoot_still, until
from render_steps import (
    animation,
    bake,
    cancel,
    compare,
    demo,
    disable_while_rendering,
    in_order,
    many,
    preview,
    region,
    still,
    sub_frames,
    viewport,
)  # fmt: skip


def install():
    bpy.ops.screen.userpref_show("INVOKE_DEFAULT", section="EXTENSIONS")
    yield from drawn()
    archive = os.path.join(FOLDER, "spectral_tiles.zip")
    bpy.ops.extensions.package_install_files(
        "EXEC_DEFAULT", filepath=archive, repo="user_default", enable_on_install=True
    )
    yield from shoot_still("preferences")
    note(enabled="bl_ext.user_default.spectral_tiles" in bpy.context.preferences.addons)
    with bpy.context.temp_override(window=bpy.context.window_manager.windows[-1]):
        bpy.ops.wm.window_close()
    yield from drawn()


def build_scene():
    """Blender's first scene, with a turning cube, an open lens and a bright world, small."""
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.spectral_tiles.enabled = True
    scene.render.resolution_x, scene.render.resolution_y = 80, 60
    scene.render.filepath = os.path.join(FOLDER, "frame_")
    scene.render.use_motion_blur = True
    scene.cycles.samples, scene.cycles.use_adaptive_sampling = artist.SAMPLES, False
    scene.cycles.use_denoising = False  # Debian's Blender lacks what our denoising needs
    scene.camera.data.dof.use_dof = True
    cube = bpy.data.objects["Cube"]
    for frame in (1, 4):
        cube.rotation_euler[2] = 0.3 * frame
        cube.keyframe_insert("rotation_euler", frame=frame)
    scene.frame_set(1)
    # The properties from top to bottom, with our panels open.
    panels = module("interface.panel")
    panels.unregister()
    for panel in (panels.SPECTRAL_TILES_PT_sampling, panels.SPECTRAL_TILES_PT_advanced):
        panel.bl_options = set()
    panels.register()
    with looking_at("OUTLINER"):
        bpy.ops.screen.area_close()
    yield from drawn()
    bpy.ops.screen.area_move(x=area("PROPERTIES").x, y=400, delta=-100)
    yield from back()  # from the splash screen
    area("PROPERTIES").spaces[0].context = "RENDER"
    yield from drawn()


# A tab of the properties, and the object that it tells of.
TABS = {
    "MATERIAL": "Cube", "LIGHT": "Light", "WORLD": "Cube", "CAMERA": "Camera", "OBJECT": "Cube",
    "RENDER": "Cube", "OUTPUT": "Cube", "VIEW_LAYER": "Cube",
}  # fmt: skip
SPACE_NAMES = {"LIGHT": "DATA", "CAMERA": "DATA"}


def polls():
    """Names of the panels of the properties, in any of their tabs, that are shown where the tab is."""
    with looking_at("PROPERTIES"):
        panels = [found for name in dir(bpy.types) if hasattr(found := getattr(bpy.types, name), "bl_space_type")]
        return [
            panel.__name__
            for panel in panels
            if issubclass(panel, bpy.types.Panel)
            and (panel.bl_space_type, panel.bl_region_type) == ("PROPERTIES", "WINDOW")
            and _is_shown(panel)
        ]


def _is_shown(panel):
    try:
        return not hasattr(panel, "poll") or panel.poll(bpy.context)
    except AttributeError:  # some of Cycles' ask for a light where there is none
        return False


def tabs():
    """The tabs of the properties, with the switch off and on."""
    shown = {}
    for is_on in (False, True):
        settings().enabled = is_on
        shown[is_on] = {}
        for tab, name in TABS.items():
            bpy.context.view_layer.objects.active = bpy.data.objects[name]
            yield  # or the properties show another object's tabs
            area("PROPERTIES").spaces[0].context = SPACE_NAMES.get(tab, tab)
            yield
            shown[is_on][tab] = polls()
            yield from artist.shoot_alone(f"tab_{tab}_{is_on}".lower())
    area("PROPERTIES").spaces[0].context = "RENDER"
    yield from drawn()
    note(panels_off=shown[False], panels_on=shown[True], render_panels=polls())
    bpy.context.scene.render.engine = "BLENDER_EEVEE"
    note(render_panels_of_eevee=polls())
    bpy.context.scene.render.engine = "CYCLES"
    yield


def panel():
    scene, layer = bpy.context.scene, bpy.context.view_layer
    forecast = module("interface.forecast")

    def told():
        how = forecast.chosen(scene, layer)
        return {"method": how.method, "sentence": forecast.sentence(scene, layer), "refusals": how.refusals,
                "differences": how.differences}  # fmt: skip

    yield from shoot_still("panel_on")
    note(told_on=told())
    settings().enabled = False
    yield from shoot_still("panel_off")
    settings().enabled = True
    settings().method = "GATHER"
    yield from shoot_still("panel_refused")
    note(told_of_gather=told())
    # As it is where there is Open Shading Language, which Debian's Blender lacks.
    checks = module("drivers.gather").CHECKS
    module("drivers.gather").CHECKS = ()
    settings().pattern = "SPECTRAL_64"
    yield from artist.shoot_alone("panel_pattern")
    pattern = module("drivers.frame").pattern_tile(scene)
    note(told_of_pattern=told(), icons=module("interface.pattern_icons").icons(pattern))
    settings().filter = "MITCHELL_NETRAVALI"
    yield from artist.shoot_alone("panel_filter")
    settings().filter, settings().pattern, settings().method = "AS_CYCLES", "AUTO", "SUB_FRAMES"
    yield from shoot_still("panel_sub_frames")
    settings().method = "AUTO"
    module("drivers.gather").CHECKS = checks
    scene.cycles.samples = 1024
    yield from shoot_still("panel_many_samples")
    note(told_of_many_samples=told())
    scene.cycles.samples = artist.SAMPLES
    scene.cycles.use_denoising = True
    note(told_of_denoising=told())
    scene.cycles.use_denoising = False


def undo():
    for count in (16, 32):
        settings().sub_frames = count
        with looking_at("VIEW_3D"):
            bpy.ops.ed.undo_push(message="Sub-Frames")
    with looking_at("VIEW_3D"):
        bpy.ops.ed.undo()
    note(sub_frames_after_undo=settings().sub_frames)
    yield


def presets():
    """A preset of the user's own is added, used and removed."""
    settings().sub_frames = 11
    bpy.ops.spectral_tiles.preset_add(name="Mine")
    settings().sub_frames = 16
    path = bpy.utils.preset_find("Mine", "spectral_tiles")
    bpy.ops.script.execute_preset(filepath=path, menu_idname="SPECTRAL_TILES_PT_presets")
    note(sub_frames_of_own_preset=settings().sub_frames)
    bpy.ops.spectral_tiles.preset_add(name="Mine", remove_name=True)
    note(own_preset_afterwards=bpy.utils.preset_find("Mine", "spectral_tiles"))
    settings().sub_frames = 16
    yield


def generate():
    """Generate a pattern in the background; then another one, which is cancelled."""
    making = module("interface.pattern_making")
    path = os.path.join(FOLDER, "made.npz")
    bpy.ops.spectral_tiles.generate_pattern("EXEC_DEFAULT", filepath=path, method="scanning", size="64")
    yield from until(lambda: making.job is None or making.job.fraction > 0.3)
    yield from drawn()
    shoot("generating")
    yield from until(lambda: making.job is None)
    note(pattern=settings().pattern, path_is_right=settings().pattern_path == path, size=os.path.getsize(path))
    cancelled = os.path.join(FOLDER, "cancelled.npz")
    bpy.ops.spectral_tiles.generate_pattern("EXEC_DEFAULT", filepath=cancelled, size="128")
    yield from until(lambda: making.job.fraction > 0.0)
    start = time.monotonic()
    bpy.ops.spectral_tiles.cancel_pattern()
    yield from until(lambda: making.job is None)
    note(seconds_to_cancel_pattern=round(time.monotonic() - start, 2), path_kept=settings().pattern_path == path)
    note(cancelled_file_is_there=os.path.exists(cancelled))
    settings().pattern = "AUTO"
    yield


def refused():
    """F12 and the comparison where they cannot be done: nothing is rendered, and Blender goes on."""
    settings().method = "GATHER"
    yield from artist.rendered()
    yield from shoot_still("refused")
    try:
        bpy.ops.spectral_tiles.compare("INVOKE_DEFAULT")
    except RuntimeError as error:
        note(comparison_of_refused=str(error))
    note(renders_after_refusal=artist.rendering())
    settings().method = "AUTO"
    yield from back()


def off_and_on():
    """Switch the extension off and on in the preferences, twenty times."""
    for _ in range(20):
        bpy.ops.preferences.addon_disable(module="bl_ext.user_default.spectral_tiles")
        yield
        bpy.ops.preferences.addon_enable(module="bl_ext.user_default.spectral_tiles")
        yield
    yield from drawn()
    note(engine_afterwards=bpy.context.scene.render.engine, switch_afterwards=settings().enabled)


STEPS = (
    install, build_scene, tabs, panel, undo, presets, generate, refused, still, cancel, many, region, animation,
    compare, sub_frames, bake, viewport, off_and_on, preview, disable_while_rendering, demo, in_order,
)  # fmt: skip


def story():
    view = bpy.context.preferences.view
    view.show_splash, view.render_display_type = False, "SCREEN"
    artist.listen()
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
