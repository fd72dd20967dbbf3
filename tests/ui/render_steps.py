# SPDX-License-Identifier: GPL-3.0-or-later
"""The steps of `session.py` that render, bake or preview."""

import functools
import os

import artist
import bpy
import numpy as np
from artist import (
    FOLDER,
    area,
    back,
    drawn,
    looking_at,
    module,
    note,
    press,
    rendering,
    settings,
    shoot,
    shoot_still,
    told,
    until,
)


def still():
    """F12, on the keyboard."""
    before = artist.everything_set()
    yield from artist.rendered()
    note(changed_by_still=changes(before))
    yield from shoot_still("still")
    artist.save_result("still")
    yield from back()


def changes(before):
    """What is set otherwise than it was."""
    after = artist.everything_set()
    return {name: [before.get(name), after.get(name)] for name in before | after if before.get(name) != after.get(name)}


# Samples, and percent of the size, of a render that nobody waits for.
LONG = {"samples": 4096, "percentage": 1000}


def take(samples, percentage=100):
    """Set how long a render is."""
    bpy.context.scene.cycles.samples = samples
    bpy.context.scene.render.resolution_percentage = percentage


def cancel():
    """F12 for a long render, a copy saved in its middle, then Esc."""
    take(**LONG)
    bpy.ops.wm.save_as_mainfile(filepath=os.path.join(FOLDER, "before.blend"), copy=True)
    before = artist.everything_set()
    yield from artist.half_rendered()
    shoot("cancel")
    note(changed_during_render=changes(before))
    bpy.ops.wm.save_as_mainfile(filepath=os.path.join(FOLDER, "during.blend"), copy=True)
    note(was_still_rendering=rendering())
    yield from artist.escape("seconds_to_cancel")
    note(changed_by_cancelled=changes(before))
    yield from back()
    take(artist.SAMPLES)


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
    yield from shoot_still("region")
    artist.save_result("region")
    render.use_border = False
    yield from back()


def animation():
    scene = bpy.context.scene
    scene.frame_start, scene.frame_end = 1, 3
    before = artist.everything_set()
    bpy.ops.render.render("INVOKE_DEFAULT", animation=True)
    yield from until(lambda: not rendering())
    yield from shoot_still("animation")
    note(changed_by_animation=changes(before))
    yield from back()


def compare():
    """Compare with Cycles, and both slots, with the switch off: it shows what it would do."""
    settings().enabled = False
    before = artist.everything_set()
    slots = bpy.data.images["Render Result"].render_slots
    are_complete = told("render_complete", times=2)
    bpy.ops.spectral_tiles.compare("INVOKE_DEFAULT")
    # It forces the switch off, then on, and leaves it to the scene in the end.
    yield from until(lambda: are_complete() and module("switch").forced is None)
    yield from shoot_still("compared")
    note(changed_by_comparison=changes(before))
    names = [slot.name for slot in slots]
    for name in ("Cycles", "Spectral Tiles"):
        slots.active_index = names.index(name)
        yield from shoot_still(f"slot_{name}")
        artist.save_result(name)
    # As the comparison has left them; the user's first slot holds a picture, too.
    stepped = []
    for _ in range(3):
        before = slots.active.name
        press("j")
        yield from until(lambda before=before: slots.active.name != before)
        stepped.append(slots.active.name)
        yield from shoot_still(f"stepped_{len(stepped)}")
    slots.active_index = 0
    press("j")
    yield from until(lambda: slots.active_index != 0)
    note(slots=names, stepped=stepped, stepped_from_the_first=slots.active.name)
    settings().enabled = True
    yield from back()
    screen = bpy.context.window_manager.windows[0].screen
    note(areas_after_comparison=[found.type for found in screen.areas], full_screen=screen.show_fullscreen)


def sub_frames():
    """F12 by Sub-Frames with a lamp that blinks: to the end; then with many samples, saved and cancelled on the way."""
    lamp = bpy.data.objects["Light"].data
    for frame, energy in ((0.7, 0), (1, 4000), (1.3, 0)):
        lamp.energy = energy
        lamp.keyframe_insert("energy", frame=frame)
    bpy.context.scene.frame_set(1)
    settings().method, settings().sub_frames = "SUB_FRAMES", 16
    layer = bpy.context.scene.view_layers[0]
    layer.use_pass_vector = True  # for which Cycles goes to other frames, too
    before, moments = artist.everything_set(), artist.TOLD["frame_change_post"]
    begun = len(moments)
    yield from artist.rendered()
    note(changed_by_sub_frames=changes(before), moments=len(moments) - begun)
    yield from shoot_still("sub_frames")
    artist.save_result("sub_frames")
    yield from back()
    take(1024, 500)
    bpy.ops.wm.save_as_mainfile(filepath=os.path.join(FOLDER, "before_sub_frames.blend"), copy=True)
    before = artist.everything_set()
    has_begun, has_more = told("frame_change_post", times=3), told("frame_change_post", times=5)
    press(artist.F12)
    yield from until(has_begun)
    note(changed_during_sub_frames=changes(before))
    bpy.ops.wm.save_as_mainfile(filepath=os.path.join(FOLDER, "during_sub_frames.blend"), copy=True)
    yield from until(has_more)  # which leaves the time of a moment for what follows
    begun = len(moments)
    yield from drawn()
    shoot("sub_frames_shown")
    yield from artist.escape("seconds_to_cancel_sub_frames")
    note(moments_after_escape=len(moments) - begun, changed_by_cancelled_sub_frames=changes(before))
    yield from shoot_still("sub_frames_left")
    yield from back()
    take(artist.SAMPLES)
    settings().method, layer.use_pass_vector = "AUTO", False
    lamp.animation_data_clear()


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
        yield from until(lambda: not bpy.app.is_job_running("OBJECT_BAKE"))
        baked.append(np.array(node.image.pixels[:]))
    note(baked_light=float(baked[0].mean()), bake_differs_by=float(np.abs(baked[0] - baked[1]).max()))
    tree.nodes.remove(node)
    scene.cycles.samples = artist.SAMPLES


def viewport():
    """The rendered view, with the switch off and on; in large pixels, so that it soon stays as it is."""
    scene, space = bpy.context.scene, area("VIEW_3D").spaces[0]
    scene.cycles.preview_samples, scene.cycles.use_preview_denoising = 4, False
    scene.render.preview_pixel_size = "8"
    space.overlay.show_overlays = False
    for is_on in (False, True):
        settings().enabled = is_on
        yield from drawn()
        space.shading.type = "RENDERED"
        yield from until(lambda: artist.look()[artist.MIDDLE_OF_VIEW].std() > 10)  # the cube is lit
        yield from shoot_still(f"viewport_{is_on}".lower(), looks=5)
        space.shading.type = "SOLID"
        yield from drawn()
    space.overlay.show_overlays = True


def has_preview(thing):
    """Whether the picture of a thing is there, and stays as it is."""
    is_there = thing.preview is not None and any(thing.preview.image_pixels)
    return is_there and not bpy.app.is_job_running("RENDER_PREVIEW")


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
    for original in (paint, lamp, sky):
        for is_on in (False, True):
            settings().enabled = is_on
            thing = original.copy()  # which has no preview yet
            thing.asset_generate_preview()
            yield from until(functools.partial(has_preview, thing))
            picture = bpy.data.images.new("Preview", *thing.preview.image_size)
            picture.pixels.foreach_set(thing.preview.image_pixels_float)
            picture.filepath_raw = os.path.join(FOLDER, f"preview_{original.name}_{is_on}.png")
            picture.file_format = "PNG"
            picture.save()


def disable_while_rendering():
    """Disable the extension in the middle of a render, which goes on or ends, as does Blender."""
    take(**LONG)
    yield from artist.half_rendered()
    bpy.ops.preferences.addon_disable(module="bl_ext.user_default.spectral_tiles")
    yield from drawn()
    yield from artist.escape("seconds_to_cancel_disabled")
    yield from back()
    take(artist.SAMPLES)
    yield from artist.rendered()
    artist.save_result("disabled")
    yield from back()
    bpy.ops.preferences.addon_enable(module="bl_ext.user_default.spectral_tiles")


def demo():
    """The demo scene, cancelled."""
    bpy.ops.wm.open_mainfile(filepath=os.path.join(FOLDER, "spinning_wheels.blend"), load_ui=False)
    yield from drawn()
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.spectral_tiles.enabled = True
    scene.cycles.samples = 4096
    scene.cycles.use_denoising = False
    yield from artist.half_rendered()
    shoot("demo")
    yield from artist.escape("seconds_to_cancel_demo")
    yield from shoot_still("demo_cancelled")
    yield from back()


def in_order():
    """What the window shows while Gather renders, and what Esc leaves.

    Debian's Blender lacks what its camera needs, so Cycles renders by the scene's own: the pixels are in order, and
    putting them in order takes them out of it, in the window as in the result.
    """
    gather, plan_image, camera = (module(name) for name in ("drivers.gather", "cycles.plan_image", "cycles.osl_camera"))
    before = gather.CHECKS, plan_image.write, camera.replace
    gather.CHECKS, plan_image.write, camera.replace = (), lambda *_: None, lambda *_: None
    take(1024, 25)
    bpy.context.scene.cycles.use_adaptive_sampling = False
    settings().method = "GATHER"
    yield from artist.half_rendered()
    yield from artist.until_clear(artist.SMALL)
    shoot("in_order")
    yield from artist.escape("seconds_to_cancel_in_order")
    yield from shoot_still("in_order_cancelled")
    yield from back()
    gather.CHECKS, plan_image.write, camera.replace = before
