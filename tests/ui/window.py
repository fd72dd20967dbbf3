# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender in a window of a virtual display, inside the root that `make_root` makes."""

import shutil
import subprocess
import tempfile
from pathlib import Path

HERE = Path(__file__).parent

# Seconds for everything that `session.py` does.
_LIMIT = 600


def make_root(root):
    """Make the root if it is not there; return why it cannot be made, or None."""
    done = subprocess.run([HERE / "make_root", root], capture_output=True, text=True)
    return None if done.returncode == 0 else (done.stdout + done.stderr).strip() or f"see {root}.log"


def run(root, archive, results):
    """Let Blender go through the session.

    Parameters
    ----------
    root : Path
        Of `make_root`.
    archive : Path
        The extension's.
    results : Path
        Folder for `facts.json`, screenshots, pictures and Blender's output, `log.txt`.
    """
    with tempfile.TemporaryDirectory(dir=root / "tmp", prefix="spectral_tiles_") as inside:
        shutil.copy(archive, Path(inside, "spectral_tiles.zip"))
        shutil.copy(HERE / "session.py", inside)
        seen = "/" + str(Path(inside).relative_to(root))
        variables = [f"HOME={seen}", f"TMPDIR={seen}", "PATH=/usr/bin:/bin", "LIBGL_ALWAYS_SOFTWARE=1"]
        display = ["timeout", str(_LIMIT), "xvfb-run", "-a", "-s", "-screen 0 1280x900x24"]
        blender = ["blender", "--factory-startup", "--gpu-backend", "opengl", "-P", f"{seen}/session.py", "--", seen]
        with open(results / "log.txt", "w", encoding="utf-8") as log:
            command = ["chroot", str(root), "env", "-i", *variables, *display, *blender]
            subprocess.run(command, stdout=log, stderr=subprocess.STDOUT)
        for made in Path(inside).iterdir():
            if made.suffix in {".exr", ".json", ".png"}:
                shutil.copy(made, results)
