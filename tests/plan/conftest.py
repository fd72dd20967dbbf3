# SPDX-License-Identifier: GPL-3.0-or-later
import pytest

pytest.importorskip("bpy", reason="these tests run inside Blender's Python module")


@pytest.fixture(autouse=True)
def _registered(extension):
    """Every test of the add-on has it registered."""
