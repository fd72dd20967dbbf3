# SPDX-License-Identifier: GPL-3.0-or-later
"""``python -m bench release``: the extension's archive, tried as a user would install it, and the release's notes."""

import hashlib
import os
import re
import subprocess
import sys
import tempfile
import tomllib
from pathlib import Path

from bench.archive import ROOT, build
from bench.jobs import RenderFailed, blender_version
from generator.atomic_file import written_whole

#: What a fresh profile of Blender goes through: install, enable, render with the switch off and on, disable.
_TRIAL = """
import sys
import bpy
import numpy as np

archive, folder = sys.argv[1:]
bpy.ops.extensions.package_install_files(filepath=archive, repo="user_default", enable_on_install=True)
scene = bpy.context.scene
scene.render.engine = "CYCLES"
scene.render.resolution_x = scene.render.resolution_y = 64
scene.render.resolution_percentage = 100
scene.render.image_settings.file_format = "OPEN_EXR"
scene.cycles.samples = 16  # up to four are Cycles' own
scene.cycles.use_adaptive_sampling = scene.cycles.use_denoising = False
scene.cycles.sampling_pattern = "BLUE_NOISE"


def render(name):
    scene.render.filepath = f"{folder}/{name}.exr"
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(scene.render.filepath)
    return np.array(image.pixels)


off = render("off")
scene.spectral_tiles.enabled = True
for method in ("AUTO", "GATHER"):
    scene.spectral_tiles.method = method
    on = render(method)
    assert np.isfinite(on).all()
    assert abs(on.mean() - off.mean()) < 0.05 * off.mean(), "the picture is not Cycles'"
assert (on != off).any(), "the switch changes nothing"

from bl_ext.user_default.spectral_tiles.addon.interface import command_line
assert command_line.run(["tile", "--help"]) == command_line.DONE

bpy.ops.preferences.addon_disable(module="bl_ext.user_default.spectral_tiles")
assert (render("disabled") == off).all(), "Cycles is not as it was"
"""


def make(folder: Path) -> str:
    """Build the archive, try it, write ``release_notes.md`` beside it, and return what was done.

    Parameters
    ----------
    folder : Path

    Raises
    ------
    ValueError
        If the versions differ, the change log says nothing of this one, or Blender refuses the archive.
    RenderFailed
        If it fails where it was tried.
    """
    version = agreed_version()
    changes = changes_of(version)
    archive = build(folder)
    tried = [_try_in_module(archive), _try_in_window()]
    digest = hashlib.sha256(archive.read_bytes()).hexdigest()
    notes = folder / "release_notes.md"
    text = (
        f"# Spectral Tiles {version}\n\n{changes}\n\n## This archive\n\n"
        + "".join(f"- {line}\n" for line in tried)
        + f"- {archive.name}, {archive.stat().st_size:,} bytes, SHA-256 `{digest}`\n"
    )
    with written_whole(notes) as temporary:
        temporary.write_text(text, encoding="utf-8")
    return "\n".join((*tried, f"{archive}", f"{notes}"))


def agreed_version() -> str:
    """Return the version, which the manifest and the package must agree on."""
    found = {}
    for name, keys in (("blender_manifest.toml", ()), ("pyproject.toml", ("project",))):
        table = tomllib.loads((ROOT / name).read_text(encoding="utf-8"))
        for key in keys:
            table = table[key]
        found[name] = table["version"]
    if len(set(found.values())) > 1:
        raise ValueError("versions differ: " + ", ".join(f"{name} has {version}" for name, version in found.items()))
    return found["pyproject.toml"]


def changes_of(version: str) -> str:
    """Return what the change log tells of a version."""
    text = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    sections = dict(re.findall(r"^## (\S+)\n(.*?)(?=^## |\Z)", text, flags=re.M | re.S))
    if not sections.get(version, "").strip():
        raise ValueError(f"CHANGELOG.md says nothing of {version}")
    return sections[version].strip()


def _try_in_module(archive: Path) -> str:
    try_archive(archive)
    return f"Installed into a fresh profile and rendered with in Blender's module {blender_version()}"


def try_archive(archive: Path) -> None:
    """Install an archive into a fresh profile of Blender's module, and render with it; raises RenderFailed."""
    with tempfile.TemporaryDirectory(prefix="release-") as name:
        folder = Path(name)
        script = folder / "trial.py"
        script.write_text(_TRIAL)
        done = subprocess.run(
            [sys.executable, script, archive.resolve(), folder],
            env=os.environ | {"BLENDER_USER_RESOURCES": str(folder / "profile")},
            cwd=folder,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
    if done.returncode:
        tail = "\n".join(done.stdout.splitlines()[-15:])
        raise RenderFailed(f"the installed archive fails:\n{tail}")


def _try_in_window() -> str:
    """Run the tests in a real window; they build the same archive, byte for byte."""
    if not os.environ.get("SPECTRAL_TILES_WINDOW_ROOT"):
        return "Not tried in a window: SPECTRAL_TILES_WINDOW_ROOT names no folder for Blender's"
    command = [sys.executable, "-m", "pytest", "-q", "-n", "0", "tests/ui"]
    done = subprocess.run(command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    tail = done.stdout.strip().splitlines()
    if done.returncode:
        raise RenderFailed("the tests in a window fail:\n" + "\n".join(tail[-15:]))
    return f"Tried in a window of Debian's Blender: {tail[-1].strip(' =')}"
