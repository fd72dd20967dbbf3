# SPDX-License-Identifier: GPL-3.0-or-later
"""The extension's archive, ``python -m bench.archive --out FOLDER``: Blender's own command chooses and checks files.

The same files always give the same bytes, whenever and wherever they were checked out.
"""

import argparse
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path

import bpy

ROOT = Path(__file__).parents[1]


def build(folder: Path) -> Path:
    """Build the archive into `folder` and return its path; raises CalledProcessError if Blender refuses it."""
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
    subprocess.run([sys.executable, str(program), *arguments], check=True, capture_output=True, text=True)


def _write_reproducibly(source: Path, path: Path) -> None:
    """Copy an archive without what differs between check-outs: order, times and permissions of the files."""
    with zipfile.ZipFile(source) as old, zipfile.ZipFile(path, "w") as new:
        for name in sorted(old.namelist()):
            entry = zipfile.ZipInfo(name)  # its time is the earliest that archives know
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.external_attr = 0o644 << 16
            new.writestr(entry, old.read(name))


def main() -> int:
    """Build the archive and print where it is."""
    parser = argparse.ArgumentParser(prog="python -m bench.archive", description="Build the extension's archive.")
    parser.add_argument("--out", type=Path, default=Path("dist"), metavar="FOLDER", help="where to, dist if not told")
    try:
        print(build(parser.parse_args().out))
    except subprocess.CalledProcessError as error:
        print(error.stdout.strip() or error.stderr.strip(), file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
