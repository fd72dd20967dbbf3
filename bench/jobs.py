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
from pathlib import Path

import numpy as np

from bench.cache import CACHE
from bench.scene_files import ROOT, SceneFile

#: Native Cycles by its sampling pattern, and our engine.
AUTOMATIC, TABULATED, TILES = "AUTOMATIC", "TABULATED_SOBOL", "SPECTRAL_TILES"
NATIVE = (AUTOMATIC, TABULATED)

#: What the engine's pictures depend on beside the scene: its code, its tiles and the generator it reads them with.
_ENGINE_FOLDERS = ("addon", "generator")


@dataclass(frozen=True)
class Settings:
    """How one image of a scene is made.

    Attributes
    ----------
    engine : str
        `AUTOMATIC` or `TABULATED` (native Cycles with that pattern), or `TILES`.
    samples : int
        Samples a pixel.
    size : tuple of int
        Width and height in pixels.
    bounces : int or None
        Total bounces allowed, None for the scene's own.
    """

    engine: str = AUTOMATIC
    samples: int = 1
    size: tuple[int, int] = (512, 512)
    bounces: int | None = None


class RenderFailed(RuntimeError):
    """The rendering process ended without a result."""


def images(scene: SceneFile, settings: Settings, seeds: Sequence[int]) -> list[np.ndarray]:
    """Return linear RGB images, rendering in one fresh process those not cached.

    Returns
    -------
    list of ndarray
        One for each seed, float32, shape (height, width, 3), rows from the bottom.
    """
    paths = [_image_path(scene, settings, seed) for seed in seeds]
    missing = [(seed, path) for seed, path in zip(seeds, paths, strict=True) if not path.is_file()]
    if missing:
        paths[0].parent.mkdir(parents=True, exist_ok=True)
        run_worker(scene, settings, {"images": [[seed, str(path)] for seed, path in missing]})
    return [np.load(path) for path in paths]


def is_cached(scene: SceneFile, settings: Settings, seed: int) -> bool:
    """Tell whether an image need not be rendered."""
    return _image_path(scene, settings, seed).is_file()


def run_worker(scene: SceneFile, settings: Settings, task: dict) -> dict:
    """Run ``bench.worker`` in a fresh process and return what it measured.

    Parameters
    ----------
    scene : SceneFile
        What to open.
    settings : Settings
        How to render.
    task : dict
        What to do, see `bench.worker`.

    Raises
    ------
    RenderFailed
        With the end of the process's output.
    """
    with tempfile.TemporaryDirectory(prefix="bench-") as folder:
        result = Path(folder) / "result.json"
        order = {
            "blend": str(scene.path),
            "settings": asdict(settings),
            "folder": folder,
            "result": str(result),
            **task,
        }
        command = [sys.executable, "-m", "bench.worker", json.dumps(order)]
        done = subprocess.run(command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        if done.returncode or not result.is_file():
            tail = "\n".join(done.stdout.splitlines()[-15:])
            raise RenderFailed(f"{scene.name} with {settings.engine} ended with code {done.returncode}:\n{tail}")
        return json.loads(result.read_text())


def _image_path(scene: SceneFile, settings: Settings, seed: int) -> Path:
    width, height = settings.size
    bounces = "own" if settings.bounces is None else settings.bounces
    state = engine_state() if settings.engine == TILES else "native"
    name = f"{settings.engine}-{state}-{settings.samples}spp-{width}x{height}-bounces_{bounces}-seed_{seed}.npy"
    return CACHE / "images" / blender_version() / f"{scene.name}-{scene.key}" / name


@cache
def engine_state() -> str:
    """Return a digest of our engine's files as they are now."""
    digest = hashlib.sha256()
    for folder in _ENGINE_FOLDERS:
        for path in sorted((ROOT / folder).rglob("*")):
            if path.is_file() and "__pycache__" not in path.parts:
                digest.update(path.relative_to(ROOT).as_posix().encode() + path.read_bytes())
    return digest.hexdigest()[:12]


@cache
def blender_version() -> str:
    """Return the version of Blender that the workers run."""
    command = [sys.executable, "-c", "import bpy; print(bpy.app.version_string)"]
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout.split()[0]
