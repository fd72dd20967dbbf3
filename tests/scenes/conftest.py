# SPDX-License-Identifier: GPL-3.0-or-later
import pytest

pytest.importorskip("bpy", reason="these tests run inside Blender's Python module")


@pytest.fixture(autouse=True)
def _registered(extension):
    """Every scene has it registered."""
