# SPDX-License-Identifier: GPL-3.0-or-later
"""The .blend files that are measured, and what identifies their content."""

import ast
import hashlib
import subprocess
import sys
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

from bench.cache import CACHE
from bench.scenes import BUILDERS

ROOT = Path(__file__).parent.parent


@dataclass(frozen=True)
class SceneFile:
    """A scene to measure.

    Attributes
    ----------
    name : str
        What tables call it.
    path : Path
        Its .blend file.
    key : str
        Identifies the content, so that cached images of an older state are not used.
    """

    name: str
    path: Path
    key: str


def scene_file(name: str) -> SceneFile:
    """Find a bench scene by name, or take any .blend file by its path.

    A scene with a committed file is measured as committed; the others are built into the cache when first needed.

    Raises
    ------
    ValueError
        If there is no such scene.
    """
    if name.endswith(".blend"):
        path = Path(name).resolve()
        if not path.is_file():
            raise ValueError(f"no such file: {name}")
        return SceneFile(path.stem, path, _digest(path.read_bytes()))
    if name not in BUILDERS:
        raise ValueError(f"no scene {name!r}; known are {', '.join(BUILDERS)} and any path of a .blend file")
    builder = Path(find_spec(BUILDERS[name]).origin)
    committed = builder.with_suffix(".blend")
    if committed.is_file():
        return SceneFile(name, committed, _digest(committed.read_bytes()))
    return _built(name)


def _built(name: str) -> SceneFile:
    """Return the scene a builder module makes, writing its file if it is not in the cache."""
    key = _digest(*_code(BUILDERS[name]))
    path = CACHE / "scenes" / f"{name}-{key}.blend"
    if not path.is_file():
        path.parent.mkdir(parents=True, exist_ok=True)
        write = (
            "import sys; from importlib import import_module; from pathlib import Path; "
            "from demo_blend.files import write_blend; "
            "write_blend(import_module(sys.argv[1]).build, Path(sys.argv[2]))"
        )
        command = [sys.executable, "-c", write, BUILDERS[name], str(path)]
        subprocess.run(command, cwd=ROOT, check=True, stdout=subprocess.DEVNULL)
    return SceneFile(name, path, key)


def _code(module: str) -> list[bytes]:
    """Return what a builder and the scene modules it imports do: syntax trees, which no comment or layout changes."""
    tree = ast.parse(Path(find_spec(module).origin).read_text(encoding="utf-8"))
    imported = (node.module for node in tree.body if isinstance(node, ast.ImportFrom))
    own = [name for name in imported if name.startswith(("bench.scenes.", "demo_blend."))]
    return [ast.dump(tree).encode(), *(code for name in own for code in _code(name))]


def _digest(*parts: bytes) -> str:
    return hashlib.sha256(b"\0".join(parts)).hexdigest()[:12]
