# SPDX-License-Identifier: GPL-3.0-or-later
"""Every pass of every kind of scene has native Cycles' expectation."""

import numpy as np
import pytest

from tests import rendering
from tests.scenes.builders import SCENES

SEEDS = range(16)
SAMPLES = 8

# Of the 50,000 blocks that are compared, one in ten thousand suites would have one 6 standard errors off by chance.
QUANTILE = 6.0


def comparable(name, image):
    """A pass as numbers whose mean over seeds means something."""
    if ".Crypto" in name:
        return coverage(image)
    # Depth has 1e10 where nothing is hit.
    return np.clip(image.astype(np.float64), -100.0, 100.0)


def coverage(image):
    """Coverage of three mattes: cryptomatte identifiers by the lowest bits of their hash."""
    names = image[..., 0::2].copy().view(np.uint32) % 3
    parts = image[..., 1::2]
    return np.stack([np.where(names == part, parts, 0.0).sum(axis=-1) for part in range(3)], axis=-1)


@pytest.mark.parametrize("build", SCENES, ids=lambda build: build.__name__)
def test_passes_have_the_native_mean(tmp_path, build):
    build()
    renders = {
        engine: [rendering.render(tmp_path, engine, SAMPLES, seed) for seed in SEEDS] for engine in rendering.ENGINES
    }
    native, ours = (renders[engine] for engine in rendering.ENGINES)
    assert set(native[0]) <= set(ours[0])
    for name in native[0]:
        stacks = [np.stack([comparable(name, passes[name]) for passes in renders[e]]) for e in rendering.ENGINES]
        for block in (4, 16, 32):
            rendering.assert_same_expectation(stacks[1], stacks[0], block, QUANTILE, name)
