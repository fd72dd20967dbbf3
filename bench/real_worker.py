# SPDX-License-Identifier: GPL-3.0-or-later
"""The process that renders one file once, ``python -m bench.real_worker ORDER``; the order is JSON.

The order names the .blend file (``blend``), how to render it (``render``, the fields of `bench.real_renders.Render`),
the picture's ``width``, the ``result`` to write and a ``picture``, a path without suffix, or none; for ours, too, the
folder where the ``extension`` lies. The picture is saved as .npy (float16, linear RGB, rows from the bottom, as
rendered) and as .png through the scene's view.

The result holds ``wall`` and ``processor`` seconds of the render alone (not of opening the file), ``peak`` in bytes of
memory, and the picture's ``size``. The process ends with `UNSUITABLE` if Cycles cannot render the file, and with
`NO_SWITCH` if the extension has no switch yet.
"""

import json
import os
import resource
import sys
import tempfile
import time
from pathlib import Path

import bpy
import numpy as np

UNSUITABLE, NO_SWITCH = 3, 4

#: Cycles' limit of samples where a noise threshold ends a render. Files have 4,096, of which the darkest corners'
#: pixels take what nobody sees.
MOST_SAMPLES = 1024

_LARGEST_HALF = 65504.0


def main(order: dict) -> None:
    """Render and write the result."""
    render = order["render"]
    if render["engine"] == "ours":
        sys.path.insert(0, order["extension"])
        import addon

        addon.register()
    bpy.ops.wm.open_mainfile(filepath=order["blend"], load_ui=False, use_scripts=False)
    scene = bpy.context.scene
    equal_terms(scene, order["width"])
    sample(scene, render)
    if render["engine"] == "ours":
        _switch_on(scene, render["options"])
    result = _measured_render() | {"size": [scene.render.resolution_x, scene.render.resolution_y]}
    if order["picture"]:
        _save(scene, Path(order["picture"]))
    unfinished = Path(order["result"]).with_suffix(".part")
    unfinished.write_text(json.dumps(result))
    os.replace(unfinished, order["result"])


def equal_terms(scene: bpy.types.Scene, width: int) -> None:
    """Let Cycles alone make the picture, of one view and one layer, on the processor, with the file's own filter."""
    if scene.camera is None:
        scene.camera = next((thing for thing in scene.objects if thing.type == "CAMERA"), None)
    if scene.camera is None:
        _end(UNSUITABLE, "it has no camera")
    render, cycles = scene.render, scene.cycles
    render.engine = "CYCLES"
    render.resolution_y = max(1, round(width * render.resolution_y / render.resolution_x))
    render.resolution_x, render.resolution_percentage = width, 100
    for unwanted in (
        "use_border",
        "use_compositing",
        "use_sequencer",
        "use_multiview",
        "use_stamp",
        "use_persistent_data",  # with it Cycles keeps the seed of the render before
        "use_single_layer",
    ):
        setattr(render, unwanted, False)
    render.threads_mode = "AUTO"
    cycles.device = "CPU"
    cycles.denoiser, cycles.denoising_use_gpu = "OPENIMAGEDENOISE", False
    cycles.use_animated_seed = cycles.use_sample_subset = False
    cycles.use_layer_samples = "IGNORE"
    first = next((layer for layer in scene.view_layers if layer.use), scene.view_layers[0])
    for layer in scene.view_layers:
        layer.use = layer == first


def sample(scene: bpy.types.Scene, render: dict) -> None:
    """Set samples, seed and denoiser."""
    cycles = scene.cycles
    by_threshold = render["rule"] == "threshold"
    cycles.sampling_pattern = "TABULATED_SOBOL" if render["rule"] == "reference" else "AUTOMATIC"
    cycles.scrambling_distance, cycles.auto_scrambling_distance = 1.0, False
    cycles.use_adaptive_sampling = by_threshold
    cycles.adaptive_min_samples = 0
    if by_threshold:
        cycles.adaptive_threshold = render["value"]
    cycles.samples = MOST_SAMPLES if by_threshold else round(render["value"])
    cycles.time_limit = 0.0
    cycles.seed = render["seed"]
    cycles.use_denoising = render["denoise"]
    for layer in scene.view_layers:
        layer.cycles.use_denoising = True


def _switch_on(scene: bpy.types.Scene, options: list) -> None:
    """Switch Spectral Tiles on, with some of its settings changed."""
    ours = scene.spectral_tiles
    if not hasattr(ours, "enabled"):
        _end(NO_SWITCH, "scene.spectral_tiles has no 'enabled'")
    ours.enabled = True
    for name, value in options:
        kind = type(getattr(ours, name))
        setattr(ours, name, value == "True" if kind is bool else kind(value))


def _measured_render() -> dict:
    """Render, and return what it took."""
    wall, processor = time.perf_counter(), _processor_seconds()
    try:
        finished = bpy.ops.render.render() == {"FINISHED"}
    except RuntimeError as error:
        _end(UNSUITABLE, str(error).strip())
    if not finished:
        _end(UNSUITABLE, "the render was cancelled")
    return {
        "wall": time.perf_counter() - wall,
        "processor": _processor_seconds() - processor,
        "peak": _peak_memory(),
    }


def _processor_seconds() -> float:
    used = resource.getrusage(resource.RUSAGE_SELF)
    return used.ru_utime + used.ru_stime


def _peak_memory() -> int:
    """Return the largest resident size in bytes."""
    status = Path("/proc/self/status")
    if status.is_file():  # on Linux `getrusage` counts the process that started this one, too
        lines = dict(line.split(":", 1) for line in status.read_text().splitlines())
        return int(lines["VmHWM"].split()[0]) * 1024
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


def _save(scene: bpy.types.Scene, path: Path) -> None:
    """Save the last render's values, and its look."""
    image = scene.render.image_settings
    rendered = bpy.data.images["Render Result"]
    image.media_type, image.file_format = "IMAGE", "OPEN_EXR"
    image.color_mode, image.color_depth, image.exr_codec = "RGB", "32", "NONE"
    image.color_management = "FOLLOW_SCENE"
    with tempfile.TemporaryDirectory(prefix="bench-") as folder:
        exr = os.path.join(folder, "picture.exr")
        rendered.save_render(exr, scene=scene)
        pixels = _pixels(exr)
    unfinished = path.with_suffix(".part.npy")
    np.save(unfinished, np.clip(pixels, -_LARGEST_HALF, _LARGEST_HALF).astype(np.float16))
    os.replace(unfinished, path.with_suffix(".npy"))
    image.file_format, image.color_depth = "PNG", "8"
    rendered.save_render(str(path.with_suffix(".png")), scene=scene)


def _pixels(exr: str) -> np.ndarray:
    """Return an EXR's values, shape (height, width, 3)."""
    image = bpy.data.images.load(exr, check_existing=False)
    image.colorspace_settings.name = "Non-Color"  # no conversion on reading: the values as rendered
    width, height = image.size
    pixels = np.empty(width * height * 4, np.float32)
    image.pixels.foreach_get(pixels)
    return pixels.reshape(height, width, 4)[..., :3]


def _end(code: int, reason: str) -> None:
    """End the process; the reason is the last line it prints."""
    print(f"\n{reason}", file=sys.stderr, flush=True)
    os._exit(code)  # Blender would print more lines at an orderly end


if __name__ == "__main__":
    main(json.loads(sys.argv[1]))
