# SPDX-License-Identifier: GPL-3.0-or-later
"""Cycles' own sampling settings, as they are in force in a view layer."""

from dataclasses import dataclass

from ..blender.region import Region
from .random_numbers import animated_seed
from .session import LARGEST


@dataclass(frozen=True)
class Sampling:
    """How many samples Cycles would take.

    Attributes
    ----------
    samples : int
        Of a pixel; with a threshold the most.
    first, count : int
        The samples of these that are rendered: fewer than all if there is a sample subset, none if it starts beyond
        the last one.
    threshold : float or None
        Noise threshold; None if all pixels take the same samples.
    least : int
        Samples that a pixel takes at least before the threshold is asked; 0 is automatic.
    time_limit : float
        Seconds of a render; 0 for none.
    frame_seed : int
        That Cycles renders the frame with.
    """

    samples: int
    first: int
    count: int
    threshold: float | None
    least: int
    time_limit: float
    frame_seed: int

    @classmethod
    def of_layer(cls, scene, layer):
        """What a scene's settings mean for one of its view layers (`BlenderSync::sync_integrator`)."""
        settings = scene.cycles
        samples = settings.samples
        if layer.samples and settings.use_layer_samples != "IGNORE":
            bounded = settings.use_layer_samples == "BOUNDED"
            samples = min(samples, layer.samples) if bounded else layer.samples
        first, count = 0, samples
        if settings.use_sample_subset:
            first = min(settings.sample_offset, samples)
            count = min(settings.sample_subset_length, samples - first)
        is_adaptive = settings.use_adaptive_sampling
        # 0 is automatic (`Integrator::get_adaptive_sampling`).
        threshold = settings.adaptive_threshold or max(0.001, 1.0 / max(samples, 1))
        return cls(
            samples=samples,
            first=first,
            count=count,
            threshold=threshold if is_adaptive else None,
            least=settings.adaptive_min_samples if is_adaptive else 0,
            time_limit=settings.time_limit,
            frame_seed=animated_seed(settings.seed, scene.frame_current, scene.frame_subframe)
            if settings.use_animated_seed
            else settings.seed,
        )

    @property
    def is_whole(self):
        """Whether all samples are rendered."""
        return self.count == self.samples

    @property
    def is_even(self):
        """Whether every pixel takes all samples, however long that may take."""
        return self.threshold is None and not self.time_limit


def is_tiled(scene):
    """Whether Cycles would render a scene in tiles, of steps of 128 pixels (`Session::get_effective_tile_size`)."""
    side = -(-scene.cycles.tile_size // 128) * 128
    return scene.cycles.use_auto_tile and side**2 < Region.of_render(scene.render).pixels


def exactly(samples, seed=None):
    """Settings by which Cycles draws the numbers that are known ahead, exactly so many samples in every pixel.

    Parameters
    ----------
    samples : int
    seed : int, optional
        The scene's own by default.

    Returns
    -------
    dict
        By property of `scene.cycles`.
    """
    seeds = {} if seed is None else {"seed": seed, "use_animated_seed": False}
    return seeds | {
        "samples": samples,
        "use_adaptive_sampling": False,
        "use_layer_samples": "IGNORE",
        "time_limit": 0.0,
        "sampling_pattern": "BLUE_NOISE",
        # Cycles' own tiles reach the result only when all layers are done, so there shall be one.
        "tile_size": LARGEST,
        # Cycles' denoiser is called once all pixels are there and in order.
        "use_denoising": False,
    }
