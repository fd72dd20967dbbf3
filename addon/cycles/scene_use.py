# SPDX-License-Identifier: GPL-3.0-or-later
"""What a frame uses: which of Cycles' random numbers have something to decide in it."""

from dataclasses import dataclass


@dataclass(frozen=True)
class SceneUse:
    """Sources of noise in a frame.

    Attributes
    ----------
    motion_blur, lens : bool
        Whether rays differ in time, in where they pass the lens.
    lights : int
        Emitters that Cycles chooses between (`scene_analysis.emitters`).
    bounces : bool
        Whether light that was scattered more than once is rendered.
    glow : bool
        Whether any emitter is not a lamp, so that scattered rays find much of the light.
    blades : int
        Of the lens; 0 if it is round, or a pinhole.
    """

    motion_blur: bool
    lens: bool
    lights: int
    bounces: bool
    glow: bool
    blades: int = 0

    @property
    def dims(self):
        """Tile dimensions that have something to decide, in the tile format's order."""
        dims = []
        if self.motion_blur:
            dims.append("t")
        if self.lens:
            dims += ["lens.u", "lens.v"]
        if self.lights:
            dims += ["light.u", "light.v"]
        if self.lights > 1:
            dims.append("light.pick")
        if self.bounces:
            dims += ["bsdf.u", "bsdf.v"]
        return tuple(dims)
