# SPDX-License-Identifier: GPL-3.0-or-later
"""Debian's Blender, inside the root that `make_root` makes: in a window of a virtual display, or without one."""

import contextlib
import shutil
import subprocess
import tempfile
from pathlib import Path

HERE = Path(__file__).parent
DEMO = HERE.parent.parent / "demo_blend" / "spinning_wheels.blend"

# Seconds for everything that `session.py` does; four minutes on a machine that does nothing else.
_LIMIT = 1500


def make_root(root):
    """Make the root if it is not there; return why it cannot be made, or None."""
    done = subprocess.run([HERE / "make_root", root], capture_output=True, text=True)
    if done.returncode == 0:
        return None
    return (done.stdout + done.stderr).strip() or f"no root could be made, see {root}.log"


@contextlib.contextmanager
def home(root):
    """A folder inside the root for one profile of Blender: as a path here, removed in the end."""
    with tempfile.TemporaryDirectory(dir=root / "tmp", prefix="spectral_tiles_") as folder:
        yield Path(folder)


def run(root, home, *command, limit=_LIMIT):
    """Run a command inside the root, where `home` is "~" and the current folder.

    Returns
    -------
    subprocess.CompletedProcess
        With the output as text, both streams in one.
    """
    inside = "/" + str(home.relative_to(root))
    variables = [f"HOME={inside}", f"TMPDIR={inside}", "PATH=/usr/bin:/bin", "LIBGL_ALWAYS_SOFTWARE=1"]
    enter = ["chroot", str(root), "env", "-C", inside, "-i", *variables, "timeout", str(limit)]
    return subprocess.run([*enter, *command], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)


def run_session(root, archive, results):
    """Let Blender go through `session.py`, in a window.

    Parameters
    ----------
    root : Path
        Of `make_root`.
    archive : Path
        The extension's.
    results : Path
        Folder for `facts.json`, screenshots, pictures and Blender's output, `log.txt`.
    """
    with home(root) as folder:
        shutil.copy(archive, folder / "spectral_tiles.zip")
        for name in ("artist.py", "render_steps.py", "session.py"):
            shutil.copy(HERE / name, folder)
        shutil.copy(DEMO, folder)
        display = ["xvfb-run", "-a", "-s", "-screen 0 1280x900x24"]
        blender = ["blender", "--factory-startup", "--gpu-backend", "opengl", "-P", "session.py"]
        (results / "log.txt").write_text(run(root, folder, *display, *blender).stdout)
        for made in folder.iterdir():
            if made.suffix in {".blend", ".exr", ".json", ".png", ".txt"}:
                shutil.copy(made, results)
