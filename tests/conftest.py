# SPDX-License-Identifier: GPL-3.0-or-later
import pytest


@pytest.fixture(scope="session")
def extension():
    """The add-on, registered in the `bpy` module for the whole session."""
    from tests import rendering

    with rendering.registered() as addon:
        yield addon
