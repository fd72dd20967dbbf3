# SPDX-License-Identifier: GPL-3.0-or-later
"""The house: each wing of the add-on imports only what stands below it, and others keep to its public names."""

import ast
import importlib
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
WINGS = ("interface", "drivers", "farm", "picture", "plan", "cycles", "blender")
LONGEST = 400


def modules(folder):
    return sorted(path for path in (ROOT / folder).rglob("*.py"))


def imported(path, package):
    """Absolute names of the modules, or of what is in them, that a file imports."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = package[: len(package) - node.level + 1] if node.level else []
            module = ".".join([*base, *([node.module] if node.module else [])])
            yield from (f"{module}.{alias.name}" for alias in node.names)


def wing_of(name):
    """The wing that an absolute name is in, or None."""
    parts = name.split(".")
    return parts[1] if len(parts) > 1 and parts[0] == "addon" and parts[1] in WINGS else None


def package_of(path):
    return list(path.relative_to(ROOT).parts[:-1])


@pytest.mark.parametrize("wing", WINGS)
def test_arrows_run_down(wing):
    for path in modules(f"addon/{wing}"):
        for name in imported(path, package_of(path)):
            other = wing_of(name)
            assert other is None or WINGS.index(other) >= WINGS.index(wing), f"{path.name} imports {name}"


@pytest.mark.parametrize("wing", ["plan", "picture"])
def test_arithmetic_knows_no_blender(wing):
    for path in modules(f"addon/{wing}"):
        for name in imported(path, package_of(path)):
            assert name.split(".")[0] not in {"bpy", "cycles", "_cycles", "mathutils", "gpu", "bl_ui"}, path.name


def test_no_module_imports_itself_by_way_of_others():
    arrows = {}
    paths = {".".join(path.relative_to(ROOT).with_suffix("").parts): path for path in modules("addon")}
    for name, path in paths.items():
        found = set(imported(path, package_of(path)))
        arrows[name] = {other for other in paths if other in found or any(f.startswith(f"{other}.") for f in found)}
        arrows[name] -= {name}
    done, left = set(), set(arrows)
    while ready := {name for name in left if arrows[name] <= done}:
        done |= ready
        left -= ready
    assert not left


@pytest.mark.parametrize("folder", ["bench", "tests", "demo_blend"])
def test_others_keep_to_public_names(folder):
    """They import modules that a wing lists as public, and from these what does not begin with an underscore."""
    for path in modules(folder):
        for name in imported(path, package_of(path)):
            wing = wing_of(name)
            if wing is not None and name.count(".") > 1:
                _, _, module, *inside = name.split(".")
                assert module in importlib.import_module(f"addon.{wing}").__all__, f"{path.name} imports {name}"
                assert not any(part.startswith("_") for part in inside), f"{path.name} imports {name}"


@pytest.mark.parametrize("folder", ["addon", "generator", "bench", "demo_blend"])
def test_no_file_is_long(folder):
    lengths = {path.name: len(path.read_text(encoding="utf-8").splitlines()) for path in modules(folder)}
    assert {name: length for name, length in lengths.items() if length > LONGEST} == {}
