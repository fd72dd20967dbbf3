# SPDX-License-Identifier: GPL-3.0-or-later
"""The method Rounds: rectangles of the picture go on with their pixels' samples where these are needed (`plan.rounds`).

Every call is Cycles' own render of a border and a sample subset, so this works with every camera and on every device,
and each pixel's samples are those that it would have natively.
"""

import contextlib
import functools
import time

import bpy
import numpy as np

from ..blender.display import Picture
from ..blender.region import Rectangle, Region
from ..cycles import denoiser, passes, sampling
from ..cycles.session import LARGEST
from ..cycles.shot import Shot
from ..farm import layers
from ..picture.accumulation import Accumulation
from ..plan import rounds
from ..plan.costs import Costs, Counted
from . import steps

# Seconds, for each thread, of the samples that tell where they take long.  If it is less, a picture takes a second or
# so, and rates are not worth their calls.
_TELLING = 0.05

# Mean samples of a picture whose parts err independently of each other: Cycles' first few do not, as edges show.
_LEAST_WITH_PARTS = 8

# Fewest samples of a picture with volumes.  In each call Cycles learns anew where these scatter light: 16 samples in
# several calls have up to 1.8 times the error of as many in one.
_LEARNED = 64

# Seconds between pictures in a window, and times what showing one takes: what is less than both is not worth it.
_SHOWN_EVERY, _SHOWN_TIMES = 0.5, 20.0

# Side of a square, and samples of its pixels, that tell what a call costs.
_TRIED = 8

# Part of a time limit that samples have at least, however long the denoiser takes.
_LEAST_PART = 0.25


def suit(scene, layer, sampling, use):
    """Whether samples can be spread by noise.

    Not if so few are wanted that they have no halves, or a part of them, or that Cycles learns little of volumes; nor
    in pictures so large that Cycles renders them in tiles; nor where an AOV bears the name of a colour that light is to
    be multiplied by again.
    """
    few = not sampling.is_whole or sampling.samples <= rounds.FEWEST or (use.volume and sampling.samples < _LEARNED)
    return not few and max(Region.of_render(scene.render).size) <= LARGEST and passes.can_be_mixed(layer)


def render(session, frame):
    """Render a frame."""
    begun = time.perf_counter()
    engine, sampled = session.engine, frame.sampling
    passes.add_divisors(engine, session.layer)
    steps.add_guides(session, frame)
    worth = rounds.DENOISED if frame.denoise else rounds.NOISY
    goal = rounds.Goal(sampled.samples, sampled.threshold, sampled.least, sampled.time_limit or None, worth)
    # What is to be denoised comes under another name, and Combined stays empty until then.
    light = passes.NOISY if frame.denoise else "Combined"
    denoising = functools.partial(steps.denoising_seconds, session, frame) if frame.denoise else None
    growing = grown(session, goal, lambda: time.perf_counter() - begun, light, denoising)
    # Rates change the mean, for samples where there is much noise take longer: a goal is what even samples would be.
    mean = goal.samples if goal.is_mean else growing.sums.counts.mean()
    has_parts = frame.denoise and mean >= _LEAST_WITH_PARTS
    return growing.sums.picture(has_parts), layers.facts(frame, session.layer_name)


def grown(session, goal, elapsed, light="Combined", denoising=None):
    """The picture of all rounds, as `Growing`."""
    session.set_sampling(**sampling.exactly(goal.length))
    growing = Growing(session, goal, elapsed, light, denoising)
    if growing.shoot_all(goal.first):
        for shots in _shots(goal, growing):
            if not growing.shoot(shots):
                break
    return growing


def _shots(goal, growing):
    """All shots but the first, round by round."""
    base, costs = goal.base(growing.costs.sample), growing.costs
    yield from rounds.opening(goal, base, growing.size, costs)
    growing.leave_time()
    if goal.seconds is None and not growing.weigh() and goal.is_mean:
        yield from rounds.evenly(goal, base, goal.samples, growing.size, costs, growing.spent)
    else:
        yield from rounds.rounds(goal, base, growing, costs, growing.spent)


class Growing:
    """A picture that grows by shots, with what they cost, and tells how far it is.

    Parameters
    ----------
    session : Session
    goal : rounds.Goal
    elapsed : callable
        Seconds since the render began.
    light : str
        Name of the pass whose noise is judged.
    denoising : callable, optional
        Seconds that the denoiser will take.

    Attributes
    ----------
    costs : Costs or Counted
        By time only if that is limited.
    """

    def __init__(self, session, goal, elapsed, light, denoising):
        self.session, self._goal, self._light, self._denoising = session, goal, light, denoising
        self._since_begun, self._left = elapsed, 0.0
        self.size = session.region.size
        # The processor's time tells what samples cost even where others use it, too, if they are taken there.
        is_processors = goal.seconds is None and session.scene.cycles.device == "CPU"
        self._clock = time.process_time if is_processors else elapsed
        self._threads = session.scene.render.threads if is_processors else 1
        self.costs = Counted(self.size, self._threads) if goal.seconds is None else Costs(self.size)
        self._samples = 0
        self._show_from = 0.0
        self._names = None
        # Seconds, calls and samples of the last shots.
        self._last = 0.0, 0, 0
        self.sums = None
        self.leave_time()

    def _elapsed(self):
        """Seconds since the render began, and those that are left for the denoiser."""
        return self._since_begun() + self._left

    def leave_time(self):
        """Leave a part of a time limit for the denoiser, which takes less of it if its guides are clean."""
        if self._goal.seconds is None or self._denoising is None:
            return
        if self.sums and (errors := self.sums.errors):
            steps.set_prefilter(self.session, errors)
        with contextlib.suppress(*denoiser.FAILURES):  # the denoiser says so itself when its turn comes
            self._left = min(self._denoising(), (1.0 - _LEAST_PART) * self._goal.seconds)

    @property
    def mean(self):
        """Mean of all samples so far, (height, width, 3)."""
        return self.sums.mean[..., :3]

    @property
    def half(self):
        """Mean of the first half of them."""
        return self.sums.half[..., :3]

    def shoot_all(self, count):
        """Render the first samples of all pixels, before all else; return whether more may follow."""
        self.session.set_sampling(use_sample_subset=True, sample_offset=0, sample_subset_length=count)
        begun = self._clock()
        found = self.session.call(then_rectangles=True)
        taken = self._clock() - begun
        width, height = self.size
        names = {name for name, _ in found}
        kinds = passes.kinds(self.session.original_layer, names)
        # What is denoised in the end is empty until then.
        self._names = names if self._light == "Combined" else names - {"Combined"}
        self.sums = Accumulation(self.size, kinds, self._light)
        everything = Rectangle(0, 0, width, height).part
        self.sums.add(everything, {key: pixels.reshape(height, width, -1) for key, pixels in found.items()}, 0, count)
        self._samples += count * width * height
        if self._goal.seconds is not None:
            self.costs.call = self._call_seconds(1, 1)
        self.costs.learn(everything, count, taken)
        return self._may_go_on

    def spent(self):
        """What the picture has cost so far, in the unit of `costs`."""
        return self._samples if self._goal.seconds is None else self._elapsed()

    def _call_seconds(self, side, count):
        """What a call for some samples of a square in the middle takes."""
        width, height = (min(side, length) for length in self.size)
        left, bottom = (self.size[0] - width) // 2, (self.size[1] - height) // 2
        asked = [Shot(Rectangle(left, bottom, width, height), self._goal.length, 0, count)] * 3
        begun, least = self._clock(), np.inf
        for _ in self.session.call_rectangles(asked, self._names):
            now = self._clock()
            least, begun = min(least, now - begun), now
        return least

    def weigh(self):
        """Let time tell what samples and calls count for; return whether it tells enough."""
        seconds, calls, samples = self._last
        if seconds < _TELLING * self._threads:
            return False
        count = min(_TRIED, self._goal.length)
        call = max(self._call_seconds(_TRIED, count) - count * _TRIED**2 * seconds / samples, 0.0)
        taken = seconds - calls * call
        if taken < _TELLING * self._threads:
            return False
        self.costs.weigh(call, taken / samples, (self.mean == self.half).all(axis=2))
        return True

    def show(self):
        """Show the picture so far, if there is a window, as often as can be seen."""
        begun = self._elapsed()
        if bpy.app.background or begun < self._show_from:
            return
        mean = self.sums.mean
        self.session.engine.shown = Picture(self.session.region, mean.reshape(-1, mean.shape[-1]))
        now = self._elapsed()
        self._show_from = now + max(_SHOWN_EVERY, _SHOWN_TIMES * (now - begun))

    def _tell(self, whole):
        """Tell how much is done of what the whole picture costs, as far as that is known."""
        part = min(self.spent() / max(whole, 1e-9), 1.0)
        self.session.engine.update_stats("", f"Sampling by noise, {part:.0%}")
        self.session.engine.update_progress(part)

    def shoot(self, shots):
        """Render shots; return whether more may follow."""
        whole = self._whole(shots)
        begun = first = self._clock()
        for shot, found in zip(shots, self.session.call_rectangles(shots, self._names), strict=True):
            if self.session.engine.test_break():
                return False
            part = shot.rectangle.part
            self.sums.add(part, found, shot.first, shot.count)
            now = self._clock()
            self.costs.learn(part, shot.count, now - begun)
            begun = now
            self._samples += shot.count * self.costs.pixels[part].sum()
            self._tell(whole)
            self.show()
            if not self._may_go_on:
                return False
        samples = sum(shot.count * shot.rectangle.width * shot.rectangle.height for shot in shots)
        self._last = self._clock() - first, len(shots), samples
        return True

    def _whole(self, shots):
        """What the picture will have cost, in the unit of `costs`, as far as that is known: at least these shots."""
        if self._goal.seconds is not None:
            return self._goal.seconds
        known = self._goal.length * self.costs.sample
        further = sum(shot.count * self.costs.pixels[shot.rectangle.part].sum() for shot in shots)
        return max(known, self._samples + further)

    @property
    def _may_go_on(self):
        is_late = self._goal.seconds is not None and self._elapsed() >= self._goal.seconds
        return not is_late and not self.session.engine.test_break()
