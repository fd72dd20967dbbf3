# SPDX-License-Identifier: GPL-3.0-or-later
"""The process that renders, ``python -m bench.worker ORDER``; the order is JSON.

The order names a .blend file (``blend``), a scratch ``folder``, where to write the ``result``, and ``tasks``, for each
of which the file is opened afresh. A task has `bench.jobs.Settings` (``settings``) and one of these:

- ``images``: pairs of seed and path; each image is saved there as a float32 .npy of linear RGB, rows from the bottom,
  and beside it as .png through the scene's view, and of a film the render's processor seconds as text in .seconds.
- ``pictures``: pairs of seed and path without suffix; saved as .exr, as .png through the scene's view, and as .npy.
- ``repeats``: render that many times without saving; the result's ``seconds`` has a list for each such task, of pairs
  of wall and processor seconds.

Every result holds ``peak``, the process's largest resident size in bytes.
"""

import json
import resource
import sys
import time
from pathlib import Path

import bpy
import numpy as np

from bench.jobs import FILM_SEED, TILES
from generator.atomic_file import written_whole


def main(order: dict) -> None:
    """Do what the order says and write its result."""
    if any(task["settings"]["engine"] == TILES for task in order["tasks"]):
        import addon

        addon.register()
    result = {"seconds": []}
    for task in order["tasks"]:
        bpy.ops.wm.open_mainfile(filepath=order["blend"], load_ui=False)
        scene = bpy.context.scene
        prepare(scene, task["settings"])
        _do(task, scene, Path(order["folder"]), result)
    result["peak"] = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
    Path(order["result"]).write_text(json.dumps(result))


def _do(task: dict, scene: bpy.types.Scene, folder: Path, result: dict) -> None:
    """Do one task with the open scene."""
    film = task["settings"]["film"] != ""
    for seed, path in task.get("images", ()):
        set_seed(scene, seed, film)
        start = time.process_time()
        exr = render_to(scene, folder / "image.exr")
        if film:
            Path(path).with_suffix(".seconds").write_text(f"{time.process_time() - start}")
        _save_png(scene, Path(path).with_suffix(".png"))
        _save_pixels(exr, Path(path))
    for seed, path in task.get("pictures", ()):
        set_seed(scene, seed)
        exr = render_to(scene, Path(path).with_suffix(".exr"))
        _save_pixels(exr, Path(path).with_suffix(".npy"))
        _save_png(scene, Path(path).with_suffix(".png"))
    if "repeats" in task:
        set_seed(scene, 0)
        result["seconds"].append([_timed_render() for _ in range(task["repeats"])])


def prepare(scene: bpy.types.Scene, settings: dict) -> None:
    """Make engines comparable: the same filter, no adaptive sampling, and denoising only where asked for.

    Persistent data stays off: with it native Cycles silently ignores a changed seed.
    """
    scene.render.use_persistent_data = False
    scene.render.resolution_x, scene.render.resolution_y = settings["size"]
    scene.render.resolution_percentage = 100
    scene.render.use_border = False
    scene.render.use_compositing = False
    scene.render.use_sequencer = False
    scene.render.film_transparent = False
    image = scene.render.image_settings
    image.file_format = "OPEN_EXR"
    image.color_depth = "32"
    image.color_mode = "RGB"
    cycles = scene.cycles
    cycles.pixel_filter_type = "GAUSSIAN" if settings["gaussian"] else "BOX"
    cycles.filter_width = 4.0 * settings["gaussian"]  # Cycles' own measure
    cycles.use_adaptive_sampling = False
    cycles.use_denoising = settings["denoise"]
    cycles.use_sample_subset = settings["first_sample"] > 0
    cycles.sample_offset = settings["first_sample"]
    cycles.sample_subset_length = settings["samples"]
    cycles.use_animated_seed = settings["still"] or (settings["film"] != "" and not settings["fixed_seed"])
    if settings["still"] or settings["film"] == "at_rest":
        bring_to_rest(scene)
    if settings["film"] == "moving":
        move_camera(scene)
    if settings["bounces"] is not None:
        cycles.max_bounces = settings["bounces"]
    _use_engine(scene, settings["engine"], settings["tile"], settings["method"])
    if settings["engine"] == TILES:
        ours = scene.spectral_tiles
        ours.distribution = "EVEN"
        ours.filter = "GAUSSIAN" if settings["gaussian"] else "AS_CYCLES"
        if settings["gaussian"]:
            ours.filter_width = 6.0 * settings["gaussian"]
        set_options(ours, settings["options"])
    scene.cycles.samples = settings["first_sample"] + settings["samples"]


def _use_engine(scene: bpy.types.Scene, engine: str, tile: str, method: str) -> None:
    """Choose native Cycles with a sampling pattern, or ours with a tile."""
    scene.render.engine = "CYCLES"
    if engine == TILES:
        scene.spectral_tiles.enabled = True
        if tile.endswith(".npz"):
            scene.spectral_tiles.pattern_path = tile
            tile = "FILE"
        scene.spectral_tiles.pattern = tile
        scene.spectral_tiles.method = method
    else:
        scene.cycles.sampling_pattern = engine
        if hasattr(scene, "spectral_tiles"):
            scene.spectral_tiles.enabled = False


def bring_to_rest(scene: bpy.types.Scene) -> None:
    """Stop all objects where they are now."""
    scene.render.use_motion_blur = False
    for thing in scene.objects:
        thing.animation_data_clear()
        if thing.data is not None:
            thing.data.animation_data_clear()


def move_camera(scene: bpy.types.Scene) -> None:
    """Let a camera that stands travel to its right, a two hundredth a frame of its distance to what it shows."""
    camera = scene.camera
    if camera.animation_data and camera.animation_data.action:
        return
    sight = camera.matrix_world.to_3x3()
    hit, point, *_ = scene.ray_cast(
        bpy.context.evaluated_depsgraph_get(), camera.matrix_world.translation, -sight.col[2]
    )
    distance = (point - camera.matrix_world.translation).length if hit else 5.0
    start = camera.location.copy()
    for frame in (1, 201):
        camera.location = start + sight.col[0] * distance * (frame - scene.frame_current) / 200
        camera.keyframe_insert("location", frame=frame)
    for curve in camera.animation_data.action.layers[0].strips[0].channelbags[0].fcurves:
        for key in curve.keyframe_points:
            key.interpolation = "LINEAR"


def set_options(ours, options: list) -> None:
    """Change settings of Spectral Tiles, given as text.

    Parameters
    ----------
    ours : SpectralTilesSettings
        ``scene.spectral_tiles``.
    options : list of (str, str)
        Name and value.
    """
    for name, value in options:
        kind = type(getattr(ours, name))
        setattr(ours, name, value == "True" if kind is bool else kind(value))


def set_seed(scene: bpy.types.Scene, seed: int, film: bool = False) -> None:
    """Seed the render; with an animated seed it goes by the frame.

    Of a film it is the number of the frame, and Cycles' seed times `bench.jobs.FILM_SEED` on top.
    """
    if film:
        scene.cycles.seed, frame = divmod(seed, FILM_SEED)
        scene.frame_set(frame)
    elif scene.cycles.use_animated_seed:
        scene.frame_set(seed)
    else:
        scene.cycles.seed = seed


def render_to(scene: bpy.types.Scene, path: Path) -> Path:
    """Render the current frame to a float EXR and return its path."""
    scene.render.filepath = str(path)
    bpy.ops.render.render(write_still=True)
    if not path.is_file():
        raise RuntimeError("the render wrote no image")
    return path


def _save_pixels(exr: Path, path: Path) -> None:
    """Save an EXR's linear RGB as .npy, whole or not at all."""
    image = bpy.data.images.load(str(exr), check_existing=False)
    image.colorspace_settings.name = "Non-Color"  # no conversion on reading: the values as rendered
    width, height = image.size
    pixels = np.empty(width * height * 4, np.float32)
    image.pixels.foreach_get(pixels)
    bpy.data.images.remove(image)
    with written_whole(path) as temporary:
        np.save(temporary, pixels.reshape(height, width, 4)[..., :3])


def _save_png(scene: bpy.types.Scene, path: Path) -> None:
    """Save the last render as artists see it."""
    image = scene.render.image_settings
    image.file_format = "PNG"
    image.color_depth = "8"
    bpy.data.images["Render Result"].save_render(str(path), scene=scene)
    image.file_format = "OPEN_EXR"
    image.color_depth = "32"


def _timed_render() -> tuple[float, float]:
    """Wall and processor seconds of a render."""
    start = time.perf_counter(), time.process_time()
    bpy.ops.render.render()
    return time.perf_counter() - start[0], time.process_time() - start[1]


if __name__ == "__main__":
    main(json.loads(sys.argv[1]))
