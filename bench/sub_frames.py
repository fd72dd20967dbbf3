# SPDX-License-Identifier: GPL-3.0-or-later
"""Sub-Frames against what artists do by hand: a render for each moment, averaged in the compositor."""

import math
import tempfile
import time
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

import bpy
import matplotlib.pyplot as plt
import numpy as np
from scipy.ndimage import gaussian_filter

import addon
from addon.cycles import exposure
from bench import side_by_side
from bench.doc_parts import write_picture
from bench.document import Table
from bench.jobs import Settings
from bench.metrics import LUMINANCE, SIGMAS, Reference, mean_square_error, ratio
from bench.scene_files import SceneFile
from bench.table import Progress
from bench.worker import prepare

# Moments of one picture of the reference, as many as the setting takes, and how many such pictures there are.
_MOMENTS, _PICTURES = 256, 4

# A seed far from those that are measured.
_APART = 7919


def report(
    scenes: Sequence[SceneFile], size: tuple[int, int], samples: int, counts: Sequence[int], seeds: int, reference: int
) -> str:
    """Return the tables.

    Parameters
    ----------
    scenes : sequence of SceneFile
        What to render.
    size : tuple of int
        Width and height in pixels.
    samples : int
        Of a pixel, and moments of the comparison.
    counts : sequence of int
        Numbers of moments whose cost and banding is told.
    seeds : int
        Pictures of each kind.
    reference : int
        Samples a pixel of each picture of the reference.
    """
    addon.register()
    steps = len(scenes) * (_PICTURES + seeds + seeds * len({*counts, samples}) + 2 * len(counts))
    progress = Progress(steps)
    against, costs = [], []
    for scene_file in scenes:
        scene = _opened(scene_file, size)
        pictures = [_ours(scene, _MOMENTS, reference, _APART + seed, progress)[0] for seed in range(_PICTURES)]
        halves = Reference(*(np.mean(pictures[half::2], axis=0) for half in (0, 1)))
        by_hand = [_by_hand(scene, samples, seed, progress) for seed in range(seeds)]
        ours = {
            count: [_ours(scene, count, samples, seed, progress) for seed in range(seeds)]
            for count in sorted({*counts, samples})
        }
        against.append([scene_file.name, *_against(ours[samples], by_hand, halves)])
        for count in counts:
            finest = [_ours(scene, count, max(reference, count), 2 * _APART + seed, progress)[0] for seed in (0, 1)]
            seconds = np.median([taken for _, taken in ours[count]])
            error = np.mean([mean_square_error(picture, halves, 1) for picture, _ in ours[count]])
            banding = _banding(finest, halves)
            costs.append([scene_file.name, f"{count}", f"{seconds:.2f}", f"{1e6 * error:.1f}", f"{100 * banding:.2f}"])
    return "\n\n".join(
        str(table)
        for table in (
            Table(
                f"Sub-Frames, {samples} moments, over {samples} native renders of 1 sample each at even moments and "
                f"their mean, {size[0]}x{size[1]}: mean square error of luminance at Gaussians of sigma pixels, "
                f"against {_PICTURES * _MOMENTS} moments and {_PICTURES * reference} samples, {seeds} seeds; and wall "
                "time",
                ["", *(f"sigma {sigma}" for sigma in SIGMAS), "time", "spread of time"],
                against,
            ),
            Table(
                f"Sub-Frames at {samples} samples a pixel, by moments: seconds, mean square error x 1e6 at sigma 1; "
                f"and what no sample takes away (RMS at sigma 1 in percent of the mean, from two pictures of "
                f"{reference} samples or more)",
                ["", "moments", "seconds", "error", "banding %"],
                costs,
            ),
        )
    )


def write_pictures(scenes: Sequence[SceneFile], size: tuple[int, int], samples: int, moments: int) -> str:
    """Write the user guide's pictures, Cycles' own motion blur beside Sub-Frames, and return their names.

    Parameters
    ----------
    scenes : sequence of SceneFile
    size : tuple of int
        Width and height of each of the two in pixels.
    samples, moments : int
        Samples a pixel of both, and moments of Sub-Frames.
    """
    addon.register()
    names = []
    for scene_file in scenes:
        scene = _opened(scene_file, size)
        ours = scene.spectral_tiles
        ours.method, ours.sub_frames, scene.cycles.samples = "SUB_FRAMES", moments, samples
        scene.cycles.use_denoising = True
        shown = []
        for ours.enabled, title in ((False, "Cycles' motion blur"), (True, f"Sub-Frames, {moments}")):
            bpy.ops.render.render()
            shown.append((title, f"{samples} samples, denoised", _as_shown(scene)))
        difference = np.abs(shown[1][2] - shown[0][2]).mean(axis=2)[::-1]
        names.append(f"sub_frames_{scene_file.name}")
        with tempfile.TemporaryDirectory() as folder:
            write_picture(names[-1], side_by_side.write(Path(folder) / "sheet.png", shown, difference))
    return "\n".join(f"docs/{name}.jpg" for name in names)


def _as_shown(scene) -> np.ndarray:
    """RGB of the last render through the scene's view, rows from the top."""
    scene.render.image_settings.file_format, scene.render.image_settings.color_depth = "PNG", "8"
    with tempfile.TemporaryDirectory() as folder:
        path = str(Path(folder) / "picture.png")
        bpy.data.images["Render Result"].save_render(path, scene=scene)
        return plt.imread(path)[..., :3]


def _opened(scene_file: SceneFile, size: tuple[int, int]) -> bpy.types.Scene:
    bpy.ops.wm.open_mainfile(filepath=str(scene_file.path), load_ui=False)
    scene = bpy.context.scene
    prepare(scene, asdict(Settings(engine="BLUE_NOISE", size=size)))
    return scene


def _ours(scene, moments: int, samples: int, seed: int, progress: Progress) -> tuple[np.ndarray, float]:
    """Picture by Sub-Frames, and its seconds."""
    ours = scene.spectral_tiles
    ours.enabled, ours.method, ours.sub_frames = True, "SUB_FRAMES", moments
    scene.cycles.samples, scene.cycles.seed = samples, seed
    found = _rendered()
    ours.enabled = False
    progress.step(f"{moments} moments, {samples} samples: {found[1]:.1f} s")
    return found


def _by_hand(scene, moments: int, seed: int, progress: Progress) -> tuple[np.ndarray, float]:
    """Mean of native renders of one sample each at even moments of the shutter, and their seconds."""
    frame = scene.frame_current
    times = frame + exposure.shutter_times((np.arange(moments) + 0.5) / moments, scene.render)
    scene.render.use_motion_blur = False
    scene.cycles.samples = 1
    total, seconds = 0.0, 0.0
    for number, moment in enumerate(times):
        scene.frame_set(math.floor(moment), subframe=moment % 1.0)
        scene.cycles.seed = seed * moments + number
        picture, taken = _rendered()
        total, seconds = total + picture, seconds + taken
    scene.frame_set(frame)
    scene.render.use_motion_blur = True
    progress.step(f"{moments} native renders: {seconds:.1f} s")
    return total / moments, seconds


def _rendered() -> tuple[np.ndarray, float]:
    """Linear RGB of a render, (height, width, 3), and its seconds."""
    start = time.perf_counter()
    bpy.ops.render.render()
    seconds = time.perf_counter() - start
    with tempfile.TemporaryDirectory() as folder:
        path = str(Path(folder) / "picture.exr")
        bpy.data.images["Render Result"].save_render(path, scene=bpy.context.scene)
        image = bpy.data.images.load(path)
        image.colorspace_settings.name = "Non-Color"  # no conversion on reading: the values as rendered
        width, height = image.size
        pixels = np.empty(width * height * 4, np.float32)
        image.pixels.foreach_get(pixels)
        bpy.data.images.remove(image)
    return pixels.reshape(height, width, 4)[..., :3], seconds


def _against(ours: Sequence, by_hand: Sequence, halves: Reference) -> list[str]:
    """Errors of pictures over those of others, and the same of their seconds."""
    errors = [
        ratio(*([mean_square_error(picture, halves, sigma) for picture, _ in both] for both in (ours, by_hand)))
        for sigma in SIGMAS
    ]
    times = [one / other for (_, one), (_, other) in zip(ours, by_hand, strict=True)]
    return [*map(str, errors), f"{np.median(times):.2f}", f"{min(times):.2f}-{max(times):.2f}"]


def _banding(pictures: Sequence[np.ndarray], halves: Reference) -> float:
    """What is left of the error of pictures whose noises are independent: RMS over the mean of the reference."""
    one, other = (
        gaussian_filter((picture - half).astype(float) @ LUMINANCE, 1.0)
        for picture, half in zip(pictures, (halves.first, halves.second), strict=True)
    )
    return math.sqrt(max(0.0, float(np.mean(one * other)))) / float((halves.mean @ LUMINANCE).mean())
