# SPDX-License-Identifier: GPL-3.0-or-later
"""Converged references, cached on disk."""

from collections.abc import Callable

from bench.jobs import Settings, images, is_cached
from bench.metrics import Reference
from bench.scene_files import SceneFile

#: Seeds of the two halves, far from those of measured renders.
SEEDS = (70001, 70002)

#: Samples a pixel of each half. The error figures are free of the reference's noise on average (`metrics`), so this
#: only has to keep the spread down: at 64 the noise moves a ratio at 16 samples a pixel by about one percent.
SAMPLES = 64
QUICK_SAMPLES = 32


def reference(scene: SceneFile, settings: Settings, samples: int, say: Callable[[str], None]) -> Reference:
    """Return the reference for images of `settings`, rendering its halves natively if they are not cached.

    Parameters
    ----------
    scene : SceneFile
        What to render.
    settings : Settings
        Of the measured images; how they are sampled does not count.
    samples : int
        Samples a pixel of each half.
    say : callable
        Told what takes long.
    """
    settings = reference_settings(settings, samples)
    halves = []
    for half, seed in enumerate(SEEDS, 1):
        if not is_cached(scene, settings, seed):
            say(f"{scene.name}: reference {half}/2, {samples} samples a pixel")
        halves += images(scene, settings, [seed])
    return Reference(*halves)


def reference_settings(settings: Settings, samples: int) -> Settings:
    """Return how the halves of the reference for images of `settings` are rendered."""
    return Settings(
        samples=samples,
        size=settings.size,
        bounces=settings.bounces,
        still=settings.still,
        gaussian=settings.gaussian,
    )
