# SPDX-License-Identifier: GPL-3.0-or-later
"""Both drivers render the same picture, with as much noise."""

import bpy
import numpy as np
import pytest

from addon import cell_plan
from tests import rendering
from tests.scenes import builders

SEEDS = range(16)
SCENES = (
    builders.hair, builders.many_lights, builders.instances, builders.stereo_pair, builders.subsurface, builders.volume,
)  # fmt: skip


def all_views(passes):
    """The Combined pass, of all views one above the other."""
    views = [pixels[..., :3] for name, pixels in passes.items() if "Combined" in name]
    return np.concatenate(views).astype(np.float64)


@pytest.mark.parametrize("build", SCENES, ids=lambda build: build.__name__)
def test_sub_renders_agree_with_gather(tmp_path, monkeypatch, build):
    """In expectation, and in a pixel's mean square error to a tenth.

    Sixty-four sub-renders a picture, not 256, for the sake of time: the error of a pixel does not depend on it.
    """
    monkeypatch.setattr(cell_plan, "_DIFFERENT", 64)
    build()
    stacks = {}
    for driver in ("GATHER", "SUBRENDER"):
        bpy.context.scene.spectral_tiles.driver = driver
        stacks[driver] = rendering.stack(tmp_path, "SPECTRAL_TILES", SEEDS, choose=all_views)
    rendering.assert_same_expectation(stacks["SUBRENDER"], stacks["GATHER"], block=8)
    # Highlights that few samples find would decide the mean alone.
    errors = [np.minimum(images, 1.0).var(axis=0, ddof=1).mean() for images in stacks.values()]
    assert np.divide(*errors) == pytest.approx(1.0, abs=0.1)
