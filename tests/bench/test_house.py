# SPDX-License-Identifier: GPL-3.0-or-later
"""The picture of the house: imports are read as they are, and drawn; `tests/test_house.py` tests that they run down."""

import matplotlib.pyplot as plt

from bench import house


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


def test_picture_is_drawn(tmp_path):
    said = house.draw(tmp_path / "inside" / "house.png")
    assert "modules" in said
    assert plt.imread(tmp_path / "inside" / "house.png").shape[0] > 500
