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
import numpy as np

sys.path.append(os.getcwd())

import artist
from artist import FOLDER, area, back, idle, looking_at, module, note, press, redraw, rendering, shoot, until


def settings():
    return bpy.context.scene.spectral_tiles


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
    scene.render.engine = "CYCLES"
    scene.render.resolution_x, scene.render.resolution_y = 80, 60
    scene.render.filepath = os.path.join(FOLDER, "frame_")
    scene.render.use_motion_blur = True
    scene.cycles.samples, scene.cycles.use_adaptive_sampling = 1, False
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
    yield from idle(0.5)
    bpy.ops.screen.area_move(x=area("PROPERTIES").x, y=400, delta=-100)
    yield from back()  # from the splash screen
    area("PROPERTIES").spaces[0].context = "RENDER"
    yield from idle(0.5)


# A tab of the properties, and the object that it tells of.
TABS = {"MATERIAL": "Cube", "LIGHT": "Light", "WORLD": "Cube", "CAMERA": "Camera", "OBJECT": "Cube"}
SPACE_NAMES = {"LIGHT": "DATA", "CAMERA": "DATA"}


def polls():
    """Names of the panels of the properties that are shown."""
    tab = area("PROPERTIES").spaces[0].context
    with looking_at("PROPERTIES"):
        panels = [found for name in dir(bpy.types) if hasattr(found := getattr(bpy.types, name), "bl_space_type")]
        return [
            panel.__name__
            for panel in panels
            if issubclass(panel, bpy.types.Panel)
            and panel.bl_space_type == "PROPERTIES"
            and getattr(panel, "bl_context", "") == tab.lower()
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
            yield from idle(0.2)
            area("PROPERTIES").spaces[0].context = SPACE_NAMES.get(tab, tab)
            yield from idle(0.2)
            shown[is_on][tab] = polls()
            yield from artist.full_screen(f"tab_{tab}_{is_on}".lower())
    area("PROPERTIES").spaces[0].context = "RENDER"
    yield from idle(0.2)
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

    yield from artist.full_screen("panel_on")
    note(told_on=told())
    settings().enabled = False
    yield from artist.full_screen("panel_off")
    settings().enabled = True
    settings().method = "GATHER"
    yield from artist.full_screen("panel_refused")
    note(told_of_gather=told())
    # As it is where there is Open Shading Language, which Debian's Blender lacks.
    checks = module("drivers.gather").CHECKS
    module("drivers.gather").CHECKS = ()
    settings().pattern = "SPECTRAL_64"
    yield from artist.full_screen("panel_pattern")
    pattern = module("drivers.frame").pattern_tile(scene)
    note(told_of_pattern=told(), icons=module("interface.pattern_icons").icons(pattern))
    settings().filter = "MITCHELL_NETRAVALI"
    yield from artist.full_screen("panel_filter")
    settings().filter, settings().pattern, settings().method = "AS_CYCLES", "AUTO", "SUB_FRAMES"
    yield from artist.full_screen("panel_sub_frames")
    settings().method = "AUTO"
    module("drivers.gather").CHECKS = checks
    scene.cycles.samples = 1024
    yield from artist.full_screen("panel_many_samples")
    note(told_of_many_samples=told())
    scene.cycles.samples = 1
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
    yield from until(lambda: making.job.fraction > 0.3, 60)
    redraw()
    yield from idle(0.2)
    shoot("generating")
    yield from until(lambda: making.job is None)
    note(pattern=settings().pattern, path_is_right=settings().pattern_path == path, size=os.path.getsize(path))
    cancelled = os.path.join(FOLDER, "cancelled.npz")
    bpy.ops.spectral_tiles.generate_pattern("EXEC_DEFAULT", filepath=cancelled, size="128")
    yield from until(lambda: making.job.fraction > 0.0, 60)
    start = time.monotonic()
    bpy.ops.spectral_tiles.cancel_pattern()
    yield from until(lambda: making.job is None, 30)
    note(seconds_to_cancel_pattern=round(time.monotonic() - start, 2), path_kept=settings().pattern_path == path)
    note(cancelled_file_is_there=os.path.exists(cancelled))
    settings().pattern = "AUTO"
    yield


def refused():
    """F12 and the comparison where they cannot be done: nothing is rendered, and Blender goes on."""
    settings().method = "GATHER"
    press(artist.F12)
    yield from until(rendering, 10)
    yield from until(lambda: not rendering())
    yield from idle(0.5)
    shoot("refused")
    try:
        bpy.ops.spectral_tiles.compare("INVOKE_DEFAULT")
    except RuntimeError as error:
        note(comparison_of_refused=str(error))
    note(renders_after_refusal=rendering())
    settings().method = "AUTO"
    yield from back()


def still():
    """F12, on the keyboard."""
    before = artist.everything_set()
    yield from artist.rendered()
    note(changed_by_still=changes(before))
    shoot("still")
    artist.save_result("still")
    yield from back()


def changes(before):
    """What is set otherwise than it was."""
    after = artist.everything_set()
    return {name: [before.get(name), after.get(name)] for name in before | after if before.get(name) != after.get(name)}


def cancel():
    """F12 for a long render, a copy saved in its middle, then Esc."""
    bpy.context.scene.cycles.samples = 4096
    bpy.ops.wm.save_as_mainfile(filepath=os.path.join(FOLDER, "before.blend"), copy=True)
    before = artist.everything_set()
    press(artist.F12)
    yield from until(rendering, 10)
    yield from idle(4)
    shoot("cancel")
    note(was_rendering=rendering(), changed_during_render=changes(before))
    bpy.ops.wm.save_as_mainfile(filepath=os.path.join(FOLDER, "during.blend"), copy=True)
    note(was_still_rendering=rendering())
    yield from artist.escape("seconds_to_cancel")
    yield from idle(0.5)
    note(changed_by_cancelled=changes(before))
    yield from back()
    bpy.context.scene.cycles.samples = 1


def many():
    """One picture after the other."""
    for number in range(10):
        bpy.ops.render.render("INVOKE_DEFAULT")
        yield from until(lambda: not rendering())
        note(pictures=number + 1)
        yield from idle(0.2)
    yield from back()


def region():
    """A border of the picture."""
    render = bpy.context.scene.render
    render.use_border = True
    render.border_min_x, render.border_max_x, render.border_min_y, render.border_max_y = 0.25, 0.75, 0.25, 0.75
    yield from artist.rendered()
    shoot("region")
    artist.save_result("region")
    render.use_border = False
    yield from back()


def animation():
    scene = bpy.context.scene
    scene.frame_start, scene.frame_end = 1, 3
    before = artist.everything_set()
    bpy.ops.render.render("INVOKE_DEFAULT", animation=True)
    yield from until(rendering, 10)
    yield from until(lambda: not rendering())
    yield from idle(0.5)
    shoot("animation")
    note(changed_by_animation=changes(before))
    yield from back()


def compare():
    """Compare with Cycles, and both slots, with the switch off: it shows what it would do."""
    settings().enabled = False
    before = artist.everything_set()
    slots = bpy.data.images["Render Result"].render_slots
    bpy.ops.spectral_tiles.compare("INVOKE_DEFAULT")
    yield from until(lambda: not rendering() and slots.active.name == "Spectral Tiles")
    yield from idle(1)
    shoot("compared")
    names = [slot.name for slot in slots]
    for name in ("Cycles", "Spectral Tiles"):
        slots.active_index = names.index(name)
        redraw()
        yield from idle(0.5)
        shoot(f"slot_{name}")
        artist.save_result(name)
    slots.active_index = names.index("Cycles")
    press("j")
    yield from idle(0.5)
    note(slots=names, slot_after_j=slots.active.name, forced_afterwards=module("switch").forced)
    note(changed_by_comparison=changes(before))
    settings().enabled = True
    yield from back()


def bake():
    """Bake the light on the cube, with the switch off and on."""
    cube, scene = bpy.data.objects["Cube"], bpy.context.scene
    tree = cube.data.materials[0].node_tree
    node = tree.nodes.new("ShaderNodeTexImage")
    tree.nodes.active = node
    bpy.context.view_layer.objects.active = cube
    cube.select_set(True)
    scene.cycles.samples = 4
    baked = []
    for is_on in (False, True):
        settings().enabled = is_on
        node.image = bpy.data.images.new(f"Bake {is_on}", 32, 32, float_buffer=True)
        with looking_at("VIEW_3D"):
            bpy.ops.object.bake("INVOKE_DEFAULT", type="COMBINED")
        yield from until(lambda: bpy.app.is_job_running("OBJECT_BAKE"), 10)
        yield from until(lambda: not bpy.app.is_job_running("OBJECT_BAKE"))
        yield from idle(0.5)
        baked.append(np.array(node.image.pixels[:]))
    note(baked_light=float(baked[0].mean()), bake_differs_by=float(np.abs(baked[0] - baked[1]).max()))
    tree.nodes.remove(node)
    scene.cycles.samples = 1


def viewport():
    """The rendered view, with the switch off and on."""
    scene, shading = bpy.context.scene, area("VIEW_3D").spaces[0].shading
    scene.cycles.preview_samples, scene.cycles.use_preview_denoising = 4, False
    for is_on in (False, True):
        settings().enabled = is_on
        shading.type = "RENDERED"
        yield from idle(4)
        shoot(f"viewport_{is_on}".lower())
        shading.type = "SOLID"
        yield from idle(0.5)


def preview():
    """Pictures in lists and browsers: of a red material, a green light and a blue world, off and on."""
    paint = bpy.data.materials.new("Paint")
    shader = next(node for node in paint.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
    shader.inputs["Base Color"].default_value = (0.9, 0.05, 0.05, 1)
    lamp = bpy.data.lights.new("Lamp", "POINT")
    lamp.color = (0.05, 0.9, 0.05)
    sky = bpy.data.worlds.new("Sky")
    background = next(node for node in sky.node_tree.nodes if node.type == "BACKGROUND")
    background.inputs["Color"].default_value = (0.05, 0.05, 0.9, 1)
    for thing in (paint, lamp, sky):
        for is_on in (False, True):
            settings().enabled = is_on
            thing.asset_generate_preview()
            yield from until(lambda: bpy.app.is_job_running("RENDER_PREVIEW"), 10)
            yield from until(lambda: not bpy.app.is_job_running("RENDER_PREVIEW"))
            yield from idle(0.5)
            picture = bpy.data.images.new("Preview", *thing.preview.image_size)
            picture.pixels.foreach_set(thing.preview.image_pixels_float)
            picture.filepath_raw = os.path.join(FOLDER, f"preview_{thing.name}_{is_on}.png")
            picture.file_format = "PNG"
            picture.save()


def off_and_on():
    """Switch the extension off and on in the preferences, twenty times."""
    for _ in range(20):
        bpy.ops.preferences.addon_disable(module="bl_ext.user_default.spectral_tiles")
        yield
        bpy.ops.preferences.addon_enable(module="bl_ext.user_default.spectral_tiles")
        yield
    yield from idle(0.5)
    note(engine_afterwards=bpy.context.scene.render.engine, switch_afterwards=settings().enabled)


def disable_while_rendering():
    """Disable the extension in the middle of a render, which goes on or ends, as does Blender."""
    bpy.context.scene.cycles.samples = 2048
    press(artist.F12)
    yield from until(rendering, 10)
    yield from idle(2)
    bpy.ops.preferences.addon_disable(module="bl_ext.user_default.spectral_tiles")
    yield from idle(1)
    yield from artist.escape("seconds_to_cancel_disabled")
    yield from back()
    bpy.context.scene.cycles.samples = 1
    yield from artist.rendered()
    artist.save_result("disabled")
    yield from back()
    bpy.ops.preferences.addon_enable(module="bl_ext.user_default.spectral_tiles")


def render_and_cancel(name, seconds):
    """Pictures of a render after some seconds and of what is left when it is cancelled."""
    press(artist.F12)
    yield from until(rendering, 10)
    yield from idle(seconds)
    shoot(name)
    note(**{f"{name}_was_rendering": rendering()})
    yield from artist.escape(f"seconds_to_cancel_{name}")
    yield from idle(1)
    shoot(f"{name}_cancelled")
    yield from back()


def demo():
    """The demo scene, cancelled."""
    bpy.ops.wm.open_mainfile(filepath=os.path.join(FOLDER, "spinning_wheels.blend"), load_ui=False)
    yield from idle(1)
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.spectral_tiles.enabled = True
    scene.cycles.samples = 1024
    scene.cycles.use_denoising = False
    yield from render_and_cancel("demo", 6)


def in_order():
    """What the window shows while Gather renders, and what Esc leaves.

    Debian's Blender lacks what its camera needs, so Cycles renders by the scene's own: the pixels are in order, and
    putting them in order takes them out of it, in the window as in the result.
    """
    gather, plan_image, camera = (module(name) for name in ("drivers.gather", "cycles.plan_image", "cycles.osl_camera"))
    before = gather.CHECKS, plan_image.write, camera.replace
    gather.CHECKS, plan_image.write, camera.replace = (), lambda *_: None, lambda *_: None
    scene = bpy.context.scene
    scene.render.resolution_percentage = 50
    scene.cycles.samples, scene.cycles.use_adaptive_sampling = 256, False
    settings().method = "GATHER"
    yield from render_and_cancel("in_order", 8)
    gather.CHECKS, plan_image.write, camera.replace = before


STEPS = (
    install, build_scene, tabs, panel, undo, presets, generate, refused, still, cancel, many, region, animation,
    compare, bake, viewport, off_and_on, preview, disable_while_rendering, demo, in_order,
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
