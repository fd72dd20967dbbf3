# SPDX-License-Identifier: GPL-3.0-or-later
"""Renders of real files by fresh processes, each kept in the cache as soon as it is done."""

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np

from bench.cache import CACHE
from bench.jobs import RenderFailed, blender_version, engine_state
from bench.scene_files import ROOT, SceneFile, scene_file

NATIVE, OURS = "native", "ours"

#: What decides how many samples are taken: their number, Cycles' noise threshold, or a reference's number.
EVEN, THRESHOLD, REFERENCE = "even", "threshold", "reference"

#: Raw and denoised pictures.
RAW, DENOISED = "raw", "denoised"

#: Seeds of the reference's halves, far from those of measured renders.
REFERENCE_SEEDS = (70001, 70002)

#: Seconds after which a process is given up.
_PATIENCE = 3600

#: To be raised when the worker's pictures or times change their meaning.
_STATE = "1"

#: As `bench.real_worker` has them, which cannot be imported here without starting Blender.
_NO_SWITCH = 4


class NoSwitch(ValueError):
    """The extension beside this bench cannot be switched on in Cycles."""


@dataclass(frozen=True)
class Render:
    """How a file is rendered.

    Attributes
    ----------
    engine : str
        `NATIVE` or `OURS`.
    rule : str
        `EVEN`, `THRESHOLD` or `REFERENCE`.
    value : float
        Samples a pixel, or the noise threshold.
    denoise : bool
        Whether Cycles' denoiser ends the render.
    seed : int
        Of Cycles.
    repeat : int
        Above 0 for a render that is only timed once more; it has no picture.
    options : tuple of (str, str)
        Settings of ours that are not the default, by their names in ``scene.spectral_tiles``.
    beside : str
        What of ours a native render is timed beside, empty if that does not matter.
    """

    engine: str
    rule: str
    value: float
    denoise: bool = False
    seed: int = 1
    repeat: int = 0
    options: tuple[tuple[str, str], ...] = ()
    beside: str = ""

    @property
    def setting(self) -> str:
        """What tables call the setting that artists choose."""
        return f"{self.rule} {self.value:g}"

    @property
    def mode(self) -> str:
        return DENOISED if self.denoise else RAW

    @property
    def name(self) -> str:
        """What the cache calls it."""
        state = engine_state() if self.engine == OURS else self.beside and f"beside_{self.beside}"
        parts = [self.engine, state, self.rule, f"{self.value:g}", self.mode, f"seed_{self.seed}"]
        parts += [f"{name}_{value}" for name, value in self.options]
        parts.append(f"repeat_{self.repeat}" if self.repeat else "")
        return "-".join(part for part in parts if part)


@dataclass(frozen=True)
class Result:
    """What a render took.

    Attributes
    ----------
    wall, processor : float
        Seconds of the render, without opening the file; the processor's on all cores together.
    peak : int
        Largest resident size of the process in bytes.
    size : tuple of int
        The picture's width and height.
    path : Path
        Of the cached figures; a .npy and a .png lie beside it, but not for repeats.
    """

    wall: float
    processor: float
    peak: int
    size: tuple[int, int]
    path: Path

    def pixels(self) -> np.ndarray:
        """Return linear RGB, float32, shape (height, width, 3), rows from the bottom."""
        return np.load(self.path.with_suffix(".npy")).astype(np.float32)

    @property
    def png(self) -> Path:
        return self.path.with_suffix(".png")


def blend_files(folder: Path, names: Sequence[str] = ()) -> list[SceneFile]:
    """Return the .blend files of a folder and its subfolders.

    Parameters
    ----------
    folder : Path
    names : sequence of str
        Of files to take, with or without suffix; all if empty.

    Raises
    ------
    ValueError
        If there is none, or one of the names is not there.
    """
    found = {}
    for path in sorted(folder.rglob("*.blend")):
        name = path.relative_to(folder).with_suffix("").as_posix()
        found[name] = replace(scene_file(str(path)), name=name)
    if not found:
        raise ValueError(f"no .blend files in {folder}")
    if not names:
        return list(found.values())
    wanted = [name.removesuffix(".blend") for name in names]
    if missing := [name for name in wanted if name not in found]:
        raise ValueError(f"not in {folder}: {', '.join(missing)}")
    return [found[name] for name in wanted]


def cached(scene: SceneFile, width: int, render: Render) -> Result | None:
    """Return what is known of a render, None if it is still to be done."""
    path = _path(scene, width, render)
    if not path.is_file():
        return None
    known = json.loads(path.read_text())
    return Result(known["wall"], known["processor"], known["peak"], tuple(known["size"]), path)


def rendered(scene: SceneFile, width: int, render: Render) -> Result:
    """Return what is known of a render, after rendering in a fresh process if nothing is.

    Raises
    ------
    RenderFailed
        With the last line that the process printed.
    NoSwitch
        The extension has no switch.
    """
    if known := cached(scene, width, render):
        return known
    path = _path(scene, width, render)
    path.parent.mkdir(parents=True, exist_ok=True)
    order = {
        "blend": str(scene.path),
        "render": asdict(render),
        "width": width,
        "result": str(path),
        "picture": None if render.repeat else str(path.with_suffix("")),
    }
    if render.engine == OURS:
        order["extension"] = str(extension_copy())
    command = [sys.executable, "-m", "bench.real_worker", json.dumps(order)]
    try:
        done = subprocess.run(
            command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, errors="replace", timeout=_PATIENCE
        )
    except subprocess.TimeoutExpired:
        raise RenderFailed(f"given up after {_PATIENCE} s") from None
    reason = next((line for line in reversed(done.stdout.splitlines()) if line.strip()), "nothing was said")
    if done.returncode == _NO_SWITCH:
        raise NoSwitch(f"{reason}; --native-only measures Cycles alone")
    result = cached(scene, width, render)
    if result is None:
        raise RenderFailed(f"{reason} (code {done.returncode})" if done.returncode < 0 else reason)
    return result


def extension_copy() -> Path:
    """Return the folder of a copy of ours as it was when this command began, whatever is edited while it runs."""
    folder = CACHE / "extensions" / engine_state()
    if not folder.is_dir():
        unfinished = folder.with_name(f"{folder.name}.part")
        shutil.rmtree(unfinished, ignore_errors=True)
        for part in ("addon", "generator"):
            shutil.copytree(ROOT / part, unfinished / part, ignore=shutil.ignore_patterns("__pycache__"))
        os.replace(unfinished, folder)
    return folder


def _path(scene: SceneFile, width: int, render: Render) -> Path:
    """Return where the cache has a render's figures."""
    scene_folder = f"{scene.name.replace('/', '+')}-{scene.key}"
    name = render.name.replace(".", ",").replace("/", "+")  # so that `with_suffix` changes the suffix only
    return CACHE / "real" / f"{blender_version()}-{_STATE}" / scene_folder / f"{width}" / f"{name}.json"
