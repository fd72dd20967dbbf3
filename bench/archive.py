# SPDX-License-Identifier: GPL-3.0-or-later
"""The extension's archive, ``python -m bench archive``: Blender's own command chooses and checks files.

The same files always give the same bytes, whenever and wherever they were checked out.
"""

import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path

import bpy

from generator.atomic_file import written_whole

ROOT = Path(__file__).parents[1]


def build(folder: Path) -> Path:
    """Build the archive into `folder` and return its path; raises ValueError with Blender's words if it refuses it."""
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as unfinished:
        _blender_ext("build", "--source-dir", str(ROOT), "--output-dir", unfinished)
        made = next(Path(unfinished).glob("*.zip"))
        archive = folder / made.name
        _write_reproducibly(made, archive)
    _blender_ext("validate", str(archive))
    return archive


def _blender_ext(*arguments: str) -> None:
    program = Path(bpy.utils.resource_path("LOCAL"), "scripts/addons_core/bl_pkg/cli/blender_ext.py")
    done = subprocess.run([sys.executable, str(program), *arguments], capture_output=True, text=True)
    if done.returncode:
        raise ValueError(f"the archive is refused: {done.stdout.strip() or done.stderr.strip()}")


def _write_reproducibly(source: Path, path: Path) -> None:
    """Copy an archive without what differs between check-outs: order, times and permissions of the files."""
    with zipfile.ZipFile(source) as old, written_whole(path) as temporary, zipfile.ZipFile(temporary, "w") as new:
        for name in sorted(old.namelist()):
            entry = zipfile.ZipInfo(name)  # its time is the earliest that archives know
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.external_attr = 0o644 << 16
            new.writestr(entry, old.read(name))
