# SPDX-License-Identifier: GPL-3.0-or-later
"""The add-on's wings stand on each other: imports run down, in no circle, and two wings know nothing of Blender."""

from graphlib import TopologicalSorter

import matplotlib.pyplot as plt
import pytest

from bench import house


def test_imports_run_down():
    assert [f"{arrow.module} imports {arrow.imported}" for arrow in house.arrows() if arrow.runs_up] == []


def test_modules_import_each_other_in_no_circle():
    """What a wing's own `__init__` gathers is left out: it is the wing itself."""
    wings = set(house.WINGS)
    needs = {}
    for arrow in house.arrows():
        if arrow.module not in wings:
            needs.setdefault(arrow.module, set()).add(arrow.imported)
    TopologicalSorter(needs).prepare()


@pytest.mark.parametrize("wing", house.PURE)
def test_wings_of_arrays_know_no_blender(wing):
    files = sorted((house.ADDON / wing).glob("*.py"))
    assert files
    assert [path.name for path in files if house.imports_blender(path)] == []


def test_an_arrow_that_runs_up_is_found(tmp_path):
    for name, text in {
        "__init__.py": "from . import switch",
        "switch.py": "from .drivers import choice",
        "drivers/__init__.py": "",
        "drivers/choice.py": "from ..plan.rates import rate\n\ndef late():\n    from ..interface import panel",
        "plan/__init__.py": "",
        "plan/rates.py": "import numpy\nfrom .. import drivers\nfrom ...generator import make_tile",
        "interface/__init__.py": "",
        "interface/panel.py": "import bpy",
    }.items():
        path = tmp_path / name
        path.parent.mkdir(exist_ok=True)
        path.write_text(text)
    found = {(arrow.module, arrow.imported): arrow.runs_up for arrow in house.arrows(tmp_path)}
    assert found == {
        ("switch", "drivers.choice"): False,
        ("drivers.choice", "plan.rates"): False,
        ("drivers.choice", "interface.panel"): True,
        ("plan.rates", "drivers"): True,
    }
    assert house.imports_blender(tmp_path / "interface/panel.py")
    assert not house.imports_blender(tmp_path / "plan/rates.py")


def test_picture_is_drawn(tmp_path):
    said = house.draw(tmp_path / "inside" / "house.png")
    assert "modules" in said
    assert plt.imread(tmp_path / "inside" / "house.png").shape[0] > 500
