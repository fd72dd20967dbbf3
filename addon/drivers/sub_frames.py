# SPDX-License-Identifier: GPL-3.0-or-later
"""The method Sub-Frames: moments of the shutter, rendered one by one, so that whatever is animated blurs.

The scene is evaluated at each moment, and Cycles renders it with its own lens and filter.  A frame takes no more samples
than it would at once, but has its scene updated as often as there are moments: `plan.sub_frame_plan` says who is
sampled when.  A pattern chosen by hand is followed to the letter instead, cell by cell (`drivers.pattern_cells`).
"""

import numpy as np

from ..blender import display, timeline
from ..blender.evaluated import render_settings, values
from ..blender.progress import Progress
from ..blender.refusal import Refused
from ..blender.region import Rectangle
from ..cycles import cell_camera, dicing, exposure, passes, sampling, shared_sequence
from ..cycles.sampling import Sampling
from ..cycles.standstill import Standstill
from ..farm import layers
from ..picture.picture import mean
from ..picture.reconstruction import Reconstruction
from ..plan import sub_frame_plan
from . import checks, pattern_cells, steps

# Width of Cycles' pixel filter where the place in the pixel is ours: the narrowest that it takes.
PINNED = 0.01


def _moments(scene, layer):
    """Moments that a view layer is rendered at."""
    moves = scene.render.use_motion_blur and layer.use_motion_blur
    return scene.spectral_tiles.sub_frames if moves else 1


def _aims(scene, layer):
    """Whether the camera is aimed at single pixels."""
    settings = scene.spectral_tiles
    if settings.pattern != "AUTO" or settings.filter != "AS_CYCLES":
        return True
    return sub_frame_plan.side(max(1, Sampling.of_layer(scene, layer).samples), _moments(scene, layer)) > 1


def _check_camera(scene, layer):
    if scene.camera is None:
        raise Refused("Cannot render, no camera in the scene")
    if scene.render.use_motion_blur and scene.cycles.rolling_shutter_type != "NONE":
        raise Refused("A rolling shutter cannot be rendered by sub-frames; set it to None, or set Method to In Place")
    if _aims(scene, layer):
        cell_camera.check(scene, scene.camera)


def _check_passes(scene, layer):
    if layer.use_pass_vector and _aims(scene, layer):
        raise Refused(
            f'The Vector pass of view layer "{layer.name}" cannot be rendered by sub-frames of fewer samples than '
            "moments, or with a pattern or filter; switch it off"
        )


def _check_culling(scene, layer):
    if scene.render.use_simplify and scene.cycles.use_camera_cull and _aims(scene, layer):
        raise Refused(
            "Camera Culling cannot be done by sub-frames of fewer samples than moments, or with a pattern or filter, "
            "each of which sees more than the picture; switch it off (Simplify), or set Method to In Place"
        )


# Each raises `Refused` if a scene's view layer cannot be rendered this way.  The panel asks them all beforehand.
CHECKS = (_check_camera, _check_passes, _check_culling, checks.pattern, pattern_cells.check_count, checks.denoiser)


def render(session, frame):
    """Render a frame; as `in_place.render`."""
    steps.add_guides(session, frame)
    passes.add_divisors(session.engine, session.layer)
    if frame.tile is not None:
        return pattern_cells.render(session, frame)
    sampled = frame.sampling
    moments = frame.sub_frames if frame.use.motion_blur else 1
    plan = sub_frame_plan.make(
        sampled.samples,
        moments,
        range(sampled.first, sampled.first + sampled.count),
        sampled.frame_seed,
        one_by_one=frame.filter is not None,
    )
    is_aimed = plan.side > 1 or frame.filter is not None
    cameras = cell_camera.cameras(session.engine, session.scene) if is_aimed else []
    with dicing.user_camera(session, {made: values(made.data) for made in cameras}):
        picture = _SubFrames(session, frame, plan, is_aimed).picture()
    return picture, layers.facts(frame, session.layer_name)


class _SubFrames:
    """Renders a plan's shots."""

    def __init__(self, session, frame, plan, is_aimed):
        self._session, self._frame, self._plan, self._is_aimed = session, frame, plan, is_aimed
        self._time = timeline.frame_of(session.original_scene)
        self._standing = Standstill(session.depsgraph)
        self._progress = Progress(session.engine, sum(map(len, plan.groups)), "Sub-Frame")
        self._opening = None
        # A box cannot be made narrower than a pixel of a cell's picture, which is larger than one of the film.
        is_box = session.scene.cycles.pixel_filter_type == "BOX"
        self._numbers = None
        if frame.filter is not None or (is_aimed and is_box):
            length = shared_sequence.length(plan.length)
            self._numbers = shared_sequence.values(("film.x", "film.y"), length, frame.sampling.frame_seed % 2**31)

    def picture(self):
        """The mean of all shots, as far as the user did not cancel."""
        picture, sums, taken = None, None, 0
        engine, frame = self._session.engine, self._frame
        try:
            for group in self._plan.groups:
                found = self._group(group, picture)
                if picture is not None and engine.test_break():
                    break
                taken += group[0].count
                if frame.filter is not None:
                    sums = sums or Reconstruction(frame.filter, *found.light.shape)
                    weights = np.full(frame.region.size[::-1], group[0].count / frame.sampling.count, np.float32)
                    sums.add(found.light, self._positions(group), weights)
                picture = mean(picture, found, taken / group[0].count)
                if engine.test_break():
                    break
        finally:
            self._session.leave(self._time)
        return picture if sums is None else picture.with_light(sums.pixels())

    def _group(self, group, before):
        """The picture of a group, black where the user cancelled before; `before` is shown meanwhile."""
        side, engine = self._plan.side, self._session.engine
        width, height = self._frame.region.size
        whole = {}
        for shot in group:
            if whole and engine.test_break():
                break
            left, bottom = (
                (place - corner) % side
                for place, corner in zip(reversed(shot.cell), self._frame.region.corner, strict=True)
            )
            if left >= width or bottom >= height:
                continue
            for key, pixels in self._render(shot, (left, bottom)).items():
                if side == 1:
                    whole[key] = pixels
                    continue
                target = whole.setdefault(key, np.zeros((height * width, pixels.shape[1]), np.float32))
                target = target.reshape(height, width, -1)[bottom::side, left::side]
                target[...] = pixels.reshape(height, width, -1)[: target.shape[0], : target.shape[1]]
            if line := self._progress.step():
                shown = before or steps.pictured(self._session, whole)
                engine.shown = display.Picture(self._frame.region, shown.combined, line)
        return steps.pictured(self._session, whole)

    def _render(self, shot, first):
        """Passes of a shot, in the lower left corner; `first` is the pixel of the region where it begins."""
        session = self._session
        is_new = shot.opening != self._opening
        self._opening = shot.opening
        start, end = exposure.shutter_times(np.array(shot.opening), session.scene.render) if is_new else (0.0, 0.0)
        time = self._time + 0.5 * (start + end) if is_new else None
        session.go_to(time, lambda written: self._aim(written, shot, first))
        found = session.call()
        # Cycles writes some data with the very first sample only.
        if self._plan.side > 1 and shot.first > 0 and any(name in passes.FIRST_SAMPLE for name, _ in found):
            session.set_sampling(sample_offset=0, sample_subset_length=1)
            data = session.call(passes.FIRST_SAMPLE)
            found |= {key: pixels for key, pixels in data.items() if found[key].shape == pixels.shape}
        return found

    def _aim(self, written, shot, first):
        """Make Cycles' next call that of a shot."""
        scene, region, side = self._session.scene, self._frame.region, self._plan.side
        self._standing.hold(written)
        written.set(scene.render, use_motion_blur=False)
        written.set(
            scene.cycles,
            **sampling.exactly(self._plan.length, self._frame.sampling.frame_seed % 2**31),
            use_sample_subset=True,
            sample_offset=shot.first,
            sample_subset_length=shot.count,
        )
        if not self._is_aimed:
            return
        if self._numbers is None:
            offset = np.zeros(2)
            written.set(scene.cycles, filter_width=max(PINNED, scene.cycles.filter_width / side))
        else:
            offset = self._offset(shot)
            written.set(scene.cycles, pixel_filter_type="GAUSSIAN", filter_width=PINNED)
        for made in cell_camera.cameras(self._session.engine, scene):
            cell_camera.aim(written, made, scene.render, region, side, np.add(region.corner, 0.5) + first + offset)
        size = (-(-length // side) for length in region.size)
        written.set(render_settings(self._session.engine), **region.border(Rectangle(0, 0, *size)))

    def _offset(self, shot):
        """Where in its pixel a shot is taken, from the centre, in pixels."""
        return self._numbers[shot.first] - 0.5

    def _positions(self, group):
        """Where in its pixel the sample of each pixel lies, as `reconstruction.positions`."""
        side, (width, height) = self._plan.side, self._frame.region.size
        left, bottom = self._frame.region.corner
        numbers = np.zeros((2, side, side), np.uint16)
        for shot in group:
            numbers[:, *shot.cell] = 65536.0 * self._numbers[shot.first]
        rows, columns = np.arange(height) + bottom, np.arange(width) + left
        return numbers[:, rows[:, None] % side, columns % side]
