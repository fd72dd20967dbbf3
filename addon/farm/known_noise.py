# SPDX-License-Identifier: GPL-3.0-or-later
"""Known noise of a frame that was rendered in layers: it is taken out of the merged picture, as of one render's.

Whether the noise goes with the random numbers shows only when all samples are there.  So layers are left as they are,
and say in their headers what their numbers followed; whoever merges them makes the same plan again.
"""

import json
import zlib
from dataclasses import asdict, dataclass, fields, replace

from ..blender.region import Region
from ..cycles.scene_use import SceneUse
from ..picture import control_variates
from ..plan import arranged_plan
from ..plan.sample_plan import Plan

# Samples a pixel that any known noise has been taken out at, by far; more of them would only take time.
_MOST_SAMPLES = 4096


def digest(plan):
    """What tells plans apart, as eight hexadecimal digits."""
    return f"{zlib.crc32(plan.film):08x}"


@dataclass(frozen=True)
class Description:
    """What must be known of a view layer's render for its known noise to be taken out later.

    Attributes
    ----------
    use : SceneUse
    region : Region
    seed : int
        As the user set it.
    frame : int or None
        As of `Sampling`.
    frame_seed : int
        That Cycles rendered with.
    method : str
        GATHER or IN_PLACE.
    added : list of str
        Passes that the frame has for being merged or denoised only.
    """

    use: SceneUse
    region: Region
    seed: int
    frame: int | None
    frame_seed: int
    method: str
    added: list

    @classmethod
    def read(cls, text, size, known):
        """Read a description out of a file.

        Parameters
        ----------
        text : str
            Of `described`, or anything.
        size : (int, int)
            Width and height of the picture.
        known : dict of str to str
            Its other facts.

        Returns
        -------
        Description or None
            None if it is damaged, or not that of the picture: then it could take any time and memory.
        """
        try:
            used, region, seed, frame, frame_seed, method, added = json.loads(text)
            region = Region(*map(tuple, region))
            use = SceneUse(**used)
            made = cls(use, region, seed, frame, frame_seed, method, added)
        except (ValueError, TypeError, RecursionError):
            return None
        return made if made._is_of(size, known) else None

    def _is_of(self, size, known):
        region = self.region
        pairs = all(len(pair) == 2 and all(map(_is_whole, pair)) for pair in region)
        types = all(type(getattr(self.use, one.name)) is one.type for one in fields(self.use))
        names = isinstance(self.added, list) and all(isinstance(name, str) for name in self.added)
        numbers = _is_whole(self.seed) and _is_whole(self.frame_seed) and (self.frame is None or _is_whole(self.frame))
        if not (pairs and types and names and numbers and self.method in ("GATHER", "IN_PLACE")):
            return False
        inside = all(
            0 <= corner < corner + length <= whole
            for whole, corner, length in zip(region.frame, region.corner, region.size, strict=True)
        )
        few = 0 <= self.use.lights < 2**31 and 0 <= self.use.blades < 2**31 and int(known["samples"]) <= _MOST_SAMPLES
        seeds = str(self.frame_seed) == known["seed"] and self.frame in (None, int(known["frame"]))
        return inside and few and seeds and size in (region.frame, region.size) and abs(self.seed) < 2**32


def _is_whole(value):
    return type(value) is int


def described(use, region, sampled, method, added):
    """The `Description` of a view layer's render as text.

    Parameters
    ----------
    use : SceneUse
    region : Region
    sampled : Sampling
    method : str
    added : list of str

    Returns
    -------
    str
    """
    return json.dumps([asdict(use), region, sampled.seed, sampled.frame, sampled.frame_seed, method, added])


def taken_out(description, samples, plan_digest, picture):
    """A merged picture without the noise that Cycles' numbers explain.

    Parameters
    ----------
    description : Description
    samples : int
        Samples a pixel.
    plan_digest : str
        Of the layers' plan.
    picture : Picture
        Of one view; it may be more than the part that was rendered.

    Returns
    -------
    Picture or None
        None if the plan cannot be made again here: a machine with another processor may round its choices differently.
    """
    use, region = description.use, description.region
    if description.method == "GATHER":
        plan = arranged_plan.make(use, region, samples, description.seed, description.frame)
    else:
        plan = Plan.in_place(description.frame_seed, region)
    if digest(plan) != plan_digest:
        return None
    clean = control_variates.of_picture(use, arranged_plan.drawn(plan, region, samples))
    lit = replace(
        picture, passes={key: pixels for key, pixels in picture.passes.items() if key[0] not in description.added}
    )
    if clean is None or not lit.light_keys:
        return picture
    left, bottom = region.corner if picture.size == region.frame else (0, 0)
    part = slice(bottom, bottom + region.size[1]), slice(left, left + region.size[0])
    return picture.with_passes(lit.pasted(clean(lit.cut(part), 0, samples), part).passes)
