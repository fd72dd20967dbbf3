# SPDX-License-Identifier: GPL-3.0-or-later
"""Rendering in fresh processes: what to render, how to ask for it, and the cache of what was rendered before."""

import hashlib
import json
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from functools import cache
from importlib.metadata import version
from pathlib import Path

import numpy as np

from bench.cache import CACHE
from bench.scene_files import ROOT, SceneFile

#: Native Cycles by its sampling pattern, and Cycles with the switch on.
AUTOMATIC, TABULATED, TILES = "AUTOMATIC", "TABULATED_SOBOL", "SPECTRAL_TILES"
NATIVE = (AUTOMATIC, TABULATED)

#: The number of an image of a film is that of its frame, and Cycles' seed times this.
FILM_SEED = 1000

#: What the engine's pictures depend on beside the scene: its code, its tiles and the generator it reads them with.
_ENGINE_FOLDERS = ("addon", "generator")


@dataclass(frozen=True)
class Settings:
    """How one image of a scene is made.

    Attributes
    ----------
    engine : str
        `AUTOMATIC` or `TABULATED` (native Cycles with that pattern), or `TILES` (the switch on).
    samples : int
        Samples a pixel.
    size : tuple of int
        Width and height in pixels.
    bounces : int or None
        Total bounces allowed, None for the scene's own.
    tile : str
        What our engine follows: ``AUTO``, a shipped tile by its identifier, or a tile file's path.
    method : str
        Of ours, `spectral_tiles.method`.
    first_sample : int
        Index of the first sample in native Cycles' sequence. Number 0 sits in the middle of its pixel; the others are
        anywhere in the pixel's filter.
    denoise : bool
        Whether Cycles' denoiser ends the render.
    still : bool
        Whether the scene is brought to rest, and what counts as seeds elsewhere are the frames of its animation.
    gaussian : float
        Standard deviation in pixels of a Gaussian pixel filter, 0 for a box of one pixel.
    film : str
        ``"moving"`` or ``"at_rest"``: what counts as seeds elsewhere are the frames (see `FILM_SEED`) of the scene's
        own animation, with a camera that moves in any case, or of the scene brought to rest. Empty for single pictures.
    fixed_seed : bool
        Whether all frames of a film have the same seed.
    options : tuple of (str, str)
        Settings of ours by their names in ``scene.spectral_tiles``, beside those that are the bench's.
    """

    engine: str = AUTOMATIC
    samples: int = 1
    size: tuple[int, int] = (512, 512)
    bounces: int | None = None
    tile: str = "AUTO"
    method: str = "GATHER"
    first_sample: int = 0
    denoise: bool = False
    still: bool = False
    gaussian: float = 0.0
    film: str = ""
    fixed_seed: bool = False
    options: tuple[tuple[str, str], ...] = ()


class RenderFailed(RuntimeError):
    """The rendering process ended without a result."""


def images(scene: SceneFile, settings: Settings, seeds: Sequence[int]) -> list[np.ndarray]:
    """Return linear RGB images, rendering in one fresh process those not cached.

    Beside each lies a .png of it as the scene's view shows it, see `picture`.

    Returns
    -------
    list of ndarray
        One for each seed, float32, shape (height, width, 3), rows from the bottom.
    """
    render(scene, [(settings, seeds)])
    return [np.load(_image_path(scene, settings, seed)) for seed in seeds]


def render(scene: SceneFile, wanted: Sequence[tuple[Settings, Sequence[int]]]) -> None:
    """Render in one fresh process what is not cached of images with several settings, each with several seeds."""
    tasks = []
    for settings, seeds in wanted:
        missing = [(seed, _image_path(scene, settings, seed)) for seed in seeds if not is_cached(scene, settings, seed)]
        if missing:
            missing[0][1].parent.mkdir(parents=True, exist_ok=True)
            tasks.append((settings, {"images": [[seed, str(path)] for seed, path in missing]}))
    if tasks:
        run_worker(scene, tasks)


def is_cached(scene: SceneFile, settings: Settings, seed: int) -> bool:
    """Tell whether an image need not be rendered."""
    path = _image_path(scene, settings, seed)
    return path.is_file() and path.with_suffix(".png").is_file()


def picture(scene: SceneFile, settings: Settings, seed: int) -> Path:
    """Return the .png of an image, rendering it if it is not cached."""
    images(scene, settings, [seed])
    return _image_path(scene, settings, seed).with_suffix(".png")


def processor_seconds(scene: SceneFile, settings: Settings, seeds: Sequence[int]) -> list[float]:
    """Return what rendering each image of a film took of the processor's time, on all cores together."""
    images(scene, settings, seeds)
    return [float(_image_path(scene, settings, seed).with_suffix(".seconds").read_text()) for seed in seeds]


def run_worker(scene: SceneFile, tasks: Sequence[tuple[Settings, dict]]) -> dict:
    """Run ``bench.worker`` in a fresh process and return what it measured.

    Parameters
    ----------
    scene : SceneFile
        What to open.
    tasks : sequence of (Settings, dict)
        How to render, and what to do, see `bench.worker`.

    Raises
    ------
    RenderFailed
        With the end of the process's output.
    """
    with tempfile.TemporaryDirectory(prefix="bench-") as folder:
        result = Path(folder) / "result.json"
        order = {
            "blend": str(scene.path),
            "folder": folder,
            "result": str(result),
            "tasks": [{"settings": asdict(settings), **task} for settings, task in tasks],
        }
        command = [sys.executable, "-m", "bench.worker", json.dumps(order)]
        done = subprocess.run(command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        if done.returncode or not result.is_file():
            tail = "\n".join(done.stdout.splitlines()[-15:])
            engines = ", ".join({settings.engine: None for settings, _ in tasks})
            raise RenderFailed(f"{scene.name} with {engines} ended with code {done.returncode}:\n{tail}")
        return json.loads(result.read_text())


def _image_path(scene: SceneFile, settings: Settings, seed: int) -> Path:
    return result_path(scene, settings, f"{'frame' if settings.still else 'seed'}_{seed}.npy")


def result_path(scene: SceneFile, settings: Settings, name: str) -> Path:
    """Return where the cache has something of a scene rendered with some settings; the name ends the file's."""
    width, height = settings.size
    bounces = "own" if settings.bounces is None else settings.bounces
    state = engine_state() if settings.engine == TILES else "native"
    parts = [settings.engine, state, f"{settings.samples}spp", f"{width}x{height}", f"bounces_{bounces}"]
    if settings.tile.endswith(".npz"):
        parts.append(f"tile_{hashlib.sha256(Path(settings.tile).read_bytes()).hexdigest()[:12]}")
    elif settings.tile != Settings.tile:
        parts.append(f"tile_{settings.tile}")
    if settings.engine == TILES and settings.method != Settings.method:
        parts.append(settings.method.lower())
    if settings.first_sample:
        parts.append(f"from_{settings.first_sample}")
    if settings.gaussian:
        parts.append(f"gaussian_{settings.gaussian}")
    parts += [name for name in ("denoise", "fixed_seed") if getattr(settings, name)]
    parts += [settings.film] if settings.film else []
    parts += [f"{name}_{value}" for name, value in settings.options]
    return CACHE / "images" / blender_version() / f"{scene.name}-{scene.key}" / "-".join((*parts, name))


@cache
def engine_state() -> str:
    """Return a digest of our engine's files as they are now."""
    digest = hashlib.sha256()
    for folder in _ENGINE_FOLDERS:
        for path in sorted((ROOT / folder).rglob("*")):
            if path.is_file() and "__pycache__" not in path.parts:
                digest.update(path.relative_to(ROOT).as_posix().encode() + path.read_bytes())
    return digest.hexdigest()[:12]


def blender_version() -> str:
    """Return the version of Blender that the workers run."""
    return version("bpy")
