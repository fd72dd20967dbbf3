# SPDX-License-Identifier: GPL-3.0-or-later
"""Both drivers render the same picture, with as much noise."""

import bpy
import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from addon.plan import cell_plan
from tests import rendering
from tests.scenes import builders

SEEDS = range(32)
SCENES = (
    builders.hair, builders.many_lights, builders.instances, builders.stereo_pair, builders.subsurface, builders.volume,
    builders.camera_inside_a_volume, builders.dome,
)  # fmt: skip

# How much more error may be left after a Gaussian of a pixel.  In haze around the camera, two points of the sequence
# that pixels share complement each other less (correlation -0.28) than two of Cycles' blue noise (-0.55).
AT_MOST = {builders.camera_inside_a_volume: 1.3}


def all_views(passes):
    """The Combined pass, of all views one above the other."""
    views = [pixels[..., :3] for name, pixels in passes.items() if "Combined" in name]
    return np.concatenate(views).astype(np.float64)


def squared_errors(images, sigma):
    """Each picture's mean square distance from the mean of all, after a Gaussian of sigma pixels."""
    # Highlights that few samples find would decide it alone.
    errors = np.minimum(images, 1.0)
    errors -= errors.mean(axis=0)
    if sigma:
        errors = gaussian_filter(errors, (0, sigma, sigma, 0))
    return np.square(errors).mean(axis=(1, 2, 3))


@pytest.mark.parametrize("build", SCENES, ids=lambda build: build.__name__)
def test_sub_renders_agree_with_gather(tmp_path, monkeypatch, build):
    """In expectation; in the mean square error of a pixel, to a tenth; of a Gaussian of a pixel, it is no more.

    Sixty-four sub-renders a picture, not 256, for the sake of time: the error of a pixel does not depend on it, but
    control variates need more; both go without.
    """
    monkeypatch.setattr(cell_plan, "_DIFFERENT", 64)
    build()
    bpy.context.scene.spectral_tiles.noise_reduction = False
    stacks = {}
    for driver in ("GATHER", "SUB_FRAMES"):
        bpy.context.scene.spectral_tiles.method = driver
        stacks[driver] = rendering.stack(tmp_path, "SPECTRAL_TILES", SEEDS, choose=all_views)
    rendering.assert_same_expectation(stacks["SUB_FRAMES"], stacks["GATHER"], block=8)
    for sigma in (0, 1):
        ours, gathered = (squared_errors(stacks[driver], sigma) for driver in ("SUB_FRAMES", "GATHER"))
        ratio = ours.mean() / gathered.mean()
        # Eight by eight cells that repeat: their blurred error is known to a tenth at best.
        spread = ratio * np.sqrt(sum(e.var(ddof=1) / len(e) / e.mean() ** 2 for e in (ours, gathered)))
        assert ratio <= AT_MOST.get(build, 1.1) + 2.0 * spread
        if sigma == 0:
            assert ratio >= 0.9
