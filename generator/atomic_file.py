"""Files that appear complete or not at all."""

import os
import tempfile
from contextlib import contextmanager
from pathlib import Path


def check_writable(path):
    """Raise an OSError if `path` is in no folder, or is a folder."""
    path = Path(path)
    if not path.parent.is_dir():
        raise FileNotFoundError(f"{path}: no such folder")
    if path.is_dir():
        raise IsADirectoryError(f"{path}: expected a file, got a folder")


@contextmanager
def replacing(path):
    """Give a temporary path beside `path`; move it onto `path` on success, remove it on any error or interrupt.

    The temporary name keeps the suffix of `path`, because image libraries choose the format by it.
    """
    path = Path(path)
    check_writable(path)
    handle, name = tempfile.mkstemp(prefix=f".{path.stem}.", suffix=path.suffix, dir=path.parent)
    os.close(handle)
    temporary = Path(name)
    try:
        yield temporary
        umask = os.umask(0)
        os.umask(umask)
        temporary.chmod(0o666 & ~umask)  # mkstemp makes private files; a tile is as public as any other file
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)
