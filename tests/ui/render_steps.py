# SPDX-License-Identifier: GPL-3.0-or-later
"""The steps of `session.py` that render, bake or preview."""

import os

import artist
import bpy
import numpy as np
from artist import FOLDER, area, back, idle, looking_at, module, note, press, redraw, rendering, settings, shoot, until


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
        # A script that renders into a window that shows a picture already would lose what had been in it.
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
    note(changed_by_comparison=changes(before))
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
    settings().enabled = True
    yield from back()
    screen = bpy.context.window_manager.windows[0].screen
    note(areas_after_comparison=[found.type for found in screen.areas], full_screen=screen.show_fullscreen)


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
