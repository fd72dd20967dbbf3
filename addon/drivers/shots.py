# SPDX-License-Identifier: GPL-3.0-or-later
"""A picture out of shots: calls of Cycles, each at its own moment, for all pixels or for every n-th one each way."""

import numpy as np

from ..blender import display, main_thread, timeline
from ..blender.evaluated import render_settings
from ..blender.progress import Progress
from ..blender.region import Rectangle
from ..cycles import cell_camera, dicing, exposure, passes
from ..cycles.standstill import Standstill
from ..picture.picture import mean
from ..picture.reconstruction import Reconstruction
from . import steps

#: Width of Cycles' pixel filter where the place in the pixel is ours: the narrowest that it takes.
PINNED = 0.01


class Shots:
    """Renders the shots of a frame.

    Parameters
    ----------
    session : Session
    frame : Frame
    plan : SubFramePlan
    sampling : dict
        Settings of `scene.cycles`.
    place : callable, optional
        CellShot -> where in its pixel it is taken: two numbers in [0, 1).  By default Cycles' filter says it.
    offset : callable, optional
        The same, from the centre, in pixels; by default what `place` says.
    lens : callable, optional
        CellShot -> lens numbers.  By default the lens is left open.
    """

    def __init__(self, session, frame, plan, sampling, place=None, offset=None, lens=None):
        self.session, self.frame, self.plan = session, frame, plan
        self._sampling, self._place, self._offset, self._lens = sampling, place, offset, lens
        self._standing = Standstill(session.depsgraph)
        count, then = sum(map(len, plan.groups)), "denoising" if frame.denoise else ""
        self._progress = Progress(session.engine, count, then)
        self._opening = None

    @property
    def _is_aimed(self):
        return self.plan.side > 1 or self._place is not None

    def picture(self):
        """The mean of all shots, as far as the user did not cancel."""
        session, engine = self.session, self.session.engine
        cameras = cell_camera.cameras(engine, session.scene) if self._is_aimed else []
        picture, sums, taken = None, None, 0
        try:
            with (
                dicing.user_camera(session, cameras),
                main_thread.telling(self._progress.tell),
            ):
                for group in self.plan.groups:
                    found = self._group(group, picture)
                    if picture is not None and engine.test_break():
                        break
                    taken += group[0].count
                    if self.frame.filter is not None:
                        light = found.light
                        sums = sums or Reconstruction(self.frame.filter, *light.shape)
                        sums.add(light, self._positions(group))
                    picture = mean(picture, found, taken / group[0].count)
                    if self._progress.is_due():
                        self._show(picture)
        finally:
            session.leave()
        picture = picture.of_samples(taken)
        return picture if sums is None else picture.with_light(sums.pixels())

    def _show(self, picture):
        """Let the window show a picture, and how far all is."""
        shown = display.Picture(self.frame.region, picture.combined, self._progress.line)
        self.session.engine.shown = shown

    def _positions(self, group):
        """Where in its pixel the sample of each pixel lies, as `reconstruction.positions`."""
        side, (width, height), (left, bottom) = self.plan.side, self.frame.region.size, self.frame.region.corner
        numbers = np.zeros((2, side, side), np.uint16)
        for shot in group:
            numbers[:, *shot.cell] = 65536.0 * self._place(shot)
        rows, columns = np.arange(height) + bottom, np.arange(width) + left
        return numbers[:, rows[:, None] % side, columns % side]

    def _group(self, group, before):
        """The picture of a group, black where the user cancelled before; `before` is shown meanwhile."""
        side, engine, region = self.plan.side, self.session.engine, self.frame.region
        width, height = region.size
        whole = {}
        for shot in group:
            if engine.test_break() and (whole or before):
                break
            bottom, left = np.subtract(shot.cell, region.corner[::-1]) % side
            if left >= width or bottom >= height:
                continue
            for key, pixels in self._render(shot, (left, bottom), before is None).items():
                target = whole.setdefault(key, np.zeros((height * width, pixels.shape[1]), np.float32))
                target = target.reshape(height, width, -1)[bottom::side, left::side]
                target[...] = pixels.reshape(height, width, -1)[: target.shape[0], : target.shape[1]]
            self._progress.step()
            if shot is not group[-1] and self._progress.is_due():
                self._show(before or steps.pictured(self.session, whole))
        return steps.pictured(self.session, whole)

    def _render(self, shot, first, with_data):
        """Passes of a shot, in the lower left corner; `first` is the pixel of the region where it begins."""
        session, time = self.session, None
        if self.frame.use.motion_blur and shot.opening != self._opening:
            self._opening = shot.opening
            time = session.time + exposure.shutter_times(np.array(shot.opening), session.scene.render).mean()
        session.go_to(time, lambda written: self._aim(written, shot, first))
        with timeline.kept(session.original_scene, session.time):
            found = session.call()
        # Cycles writes some data with the very first sample only.
        data = steps.pictured(session, found).of_kind(passes.Kind.FIRST_SAMPLE)
        if with_data and data and shot.first > 0:
            very_first = shot._replace(first=0, count=1)
            session.go_to(None, lambda written: self._aim(written, very_first, first))
            first_sample = session.call({name for name, _ in data})
            found |= {key: first_sample[key] for key in data}
        return found

    def _aim(self, written, shot, first):
        """Make Cycles' next call that of a shot."""
        scene, region, side = self.session.scene, self.frame.region, self.plan.side
        self._standing.hold(written)
        written.set(scene.render, use_motion_blur=False)
        written.set(
            scene.cycles,
            **self._sampling,
            use_sample_subset=True,
            sample_offset=shot.first,
            sample_subset_length=shot.count,
        )
        if not self._is_aimed:
            return
        if self._place is None:
            offset = np.zeros(2)
            written.set(scene.cycles, filter_width=max(PINNED, scene.cycles.filter_width / side))
        else:
            offset = self._offset(shot) if self._offset else self._place(shot) - 0.5
            written.set(scene.cycles, pixel_filter_type="GAUSSIAN", filter_width=PINNED)
        middle = np.add(region.corner, 0.5) + first + offset
        lens_numbers = self._lens(shot) if self._lens else None
        for camera in cell_camera.cameras(self.session.engine, scene):
            cell_camera.aim(written, camera, scene.render, region, side, middle, lens_numbers)
        size = (-(-length // side) for length in region.size)
        written.set(render_settings(self.session.engine), **region.border(Rectangle(0, 0, *size)))
