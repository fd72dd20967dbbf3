# SPDX-License-Identifier: GPL-3.0-or-later
"""The extension's archive, ``python -m bench.archive --out FOLDER``, made by Blender's own command."""

import argparse
import subprocess
import sys
from pathlib import Path

import bpy

ROOT = Path(__file__).parents[1]


def build(folder: Path) -> Path:
    """Build the archive into `folder` and return its path; raises CalledProcessError if Blender refuses it."""
    folder.mkdir(parents=True, exist_ok=True)
    builder = Path(bpy.utils.resource_path("LOCAL"), "scripts/addons_core/bl_pkg/cli/blender_ext.py")
    command = [sys.executable, str(builder), "build", "--source-dir", str(ROOT), "--output-dir", str(folder)]
    subprocess.run(command, check=True, capture_output=True, text=True)
    return max(folder.glob("*.zip"), key=lambda path: path.stat().st_mtime_ns)


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
