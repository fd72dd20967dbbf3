# SPDX-License-Identifier: GPL-3.0-or-later
"""Cycles renders of single cells, or of rectangles of them, put together to samples of every pixel.

A cell is a picture of the scene at one moment, through one point of the lens, seen on every n-th pixel each way.  Such
a picture needs no motion blur, no depth of field and no special camera: the frame is set to the moment, a pinhole
stands at the lens point (`addon.cell_camera`), and Cycles' sample offset chooses the numbers of light and bounces.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from cycles import engine as cycles

from . import cell_camera, display, exposure, film, in_order, main_thread, persistence, shared_sequence
from .cell_levels import rectangles
from .cell_plan import CellPlan

# Width of Cycles' pixel filter, in pixels of a sub-render: the narrowest that it takes.
_PINNED = 0.01


@dataclass(frozen=True)
class Cells:
    """The cells of a plan, and how their samples are taken.

    Attributes
    ----------
    plan : CellPlan
    times : float array, shape (side, side, samples), or None
        When the samples are taken, in frames from the picture's; None without motion blur.
    offsets : float array, shape (side, side, samples, 2)
        Where in its pixel each sample is taken, from the centre, in pixels.
    drift : float array, shape (plan.count, 2)
        How far Cycles' own filter moves each point of the sequence, in pixels of a sub-render.  Further views draw from
        another sequence: their pixels are blurred by that, with a standard deviation below .05 pixels.
    """

    plan: CellPlan
    times: np.ndarray | None
    offsets: np.ndarray
    drift: np.ndarray

    @classmethod
    def of_plan(cls, plan, scene, motion_blur, kind):
        """Cells whose samples are spread over a pixel as one of Cycles' filters does it.

        Parameters
        ----------
        plan : CellPlan
        scene : bpy.types.Scene
        motion_blur : bool
            Whether anything moves.
        kind : str
            Cycles' name of the filter; its width is the scene's.
        """
        points = shared_sequence.values(("film.x", "film.y"), plan.count, plan.seed)
        drift = exposure.filter_offsets(points, "GAUSSIAN", _PINNED)
        drift[0] = 0.0
        return cls(
            plan=plan,
            times=exposure.shutter_times(plan.t, scene.render) if motion_blur else None,
            offsets=exposure.filter_offsets(plan.film, kind, scene.cycles.filter_width),
            drift=drift,
        )

    def shots(self, region, wanted=None):
        """The sub-renders that one sample takes.

        Parameters
        ----------
        region : addon.region.Region
        wanted : bool array, shape (height, width), optional
            The pixels that are to take it; all of them by default.

        Returns
        -------
        list of Shot
        """
        side = self.plan.side
        found = []
        for row, column in np.ndindex(side, side):
            # The cell's first pixel in the region.
            x, y = (column - region.corner[0]) % side, (row - region.corner[1]) % side
            if x >= region.size[0] or y >= region.size[1]:
                continue
            if wanted is None:
                found.append(Shot((row, column), (x, y), tuple(-(-size // side) for size in region.size)))
                continue
            for rows, columns in rectangles(wanted[y::side, x::side]):
                first = x + side * columns.start, y + side * rows.start
                found.append(Shot((row, column), first, (columns.stop - columns.start, rows.stop - rows.start)))
        return found


class Shot(NamedTuple):
    """A rectangle of a cell.

    Attributes
    ----------
    cell : (int, int)
        Row and column.
    first : (int, int)
        Its first pixel, in the region.
    size : (int, int)
        Its width and height in pixels of the cell, which may end beyond the region.
    """

    cell: tuple[int, int]
    first: tuple[int, int]
    size: tuple[int, int]


class Renders:
    """Renders samples of a picture, for an engine, and shows how far it is.

    Parameters
    ----------
    engine : bpy.types.RenderEngine
    depsgraph : bpy.types.Depsgraph
    job : subrender.Job
    progress : progress.Progress
    """

    def __init__(self, engine, depsgraph, job, progress):
        self._engine = engine
        self._depsgraph = depsgraph
        self._job = job
        self._progress = progress
        self._written = persistence.Overwritten()
        self._moment = None

    def sample(self, cells, sample, shots, before):
        """Passes with one sample in each pixel of some sub-renders.

        Parameters
        ----------
        cells : Cells
        sample : int
        shots : list of Shot
        before : dict
            Passes that are shown meanwhile; if empty, those that are rendered.

        Returns
        -------
        dict
            As of `film.read_passes`, black elsewhere, and where the user cancelled before.
        """
        region, side = self._job.region, cells.plan.side
        width, height = region.size
        passes = {}
        if cells.times is not None:
            # In the order of time, so that as little as possible changes from one to the next.
            shots = sorted(shots, key=lambda shot: cells.times[(*shot.cell, sample)])
        for shot in shots:
            if self._engine.test_break():
                break
            for key, pixels in self._render(cells, sample, shot).items():
                whole = passes.setdefault(key, np.zeros((height, width, pixels.shape[1]), np.float32))
                part = whole[shot.first[1] :: side, shot.first[0] :: side][: shot.size[1], : shot.size[0]]
                part[...] = pixels.reshape(height, width, -1)[: part.shape[0], : part.shape[1]]
            if (line := self._progress.step()) and passes:
                self._engine.shown = display.Picture(region, film.combined(before or passes), line)
        return {key: pixels.reshape(width * height, -1) for key, pixels in passes.items()}

    def put_back(self):
        """Leave the evaluated scene as it was."""
        self._written.put_back()
        self._engine.frame_set(self._job.frame[0], subframe=self._job.frame[1])

    def _render(self, cells, sample, shot):
        """Passes of a sub-render, in the lower left corner of otherwise meaningless ones."""
        index = (*shot.cell, sample)
        moment = None if cells.times is None else self._job.frame[0] + self._job.frame[1] + cells.times[index]

        def passes(point):
            main_thread.run(lambda: self._aim(cells, index, shot, point, moment), self._engine)
            cycles.reset(self._engine, self._job.data, self._depsgraph)
            cycles.render(self._engine, self._depsgraph)
            return film.read_passes(self._engine, self._job.layer.name)

        point = int(cells.plan.offset[index])
        seen = passes(point)
        missing = [key for key in seen if key[0] in film.FIRST_SAMPLE_PASSES]
        # The data of a picture are those of its plan's first sample.
        if missing and point > 0 and sample == 0 and cells is self._job.cells:
            first = passes(0)
            seen |= {key: first[key] for key in missing}
        return seen

    def _aim(self, cells, index, shot, point, moment):
        """Make the next Cycles render that of a rectangle with a point of the sequence; at the moment, if given."""
        engine, depsgraph, job, written = self._engine, self._depsgraph, self._job, self._written
        written.put_back()
        if moment is not None and moment != self._moment:
            engine.frame_set(math.floor(moment), subframe=moment % 1.0)
            self._moment = moment
        scene, side = depsgraph.scene_eval, cells.plan.side
        first = np.add(job.region.corner, 0.5) + shot.first + cells.offsets[index] - side * cells.drift[point]
        for made in cell_camera.cameras(engine, scene):
            cell_camera.aim(written, made, scene.render, job.region, side, first, cells.plan.lens[index])
        _set_sampling(written, scene, depsgraph.view_layer_eval, cells.plan, point)
        written.set(engine.render, **job.region.border(shot.size))


def _set_sampling(written, scene, layer, plan, point):
    """Make Cycles take the one sample, for all pixels alike, at the pixels' centres."""
    written.set(
        scene.cycles,
        samples=plan.count,
        sampling_pattern="TABULATED_SOBOL",
        scrambling_distance=0.0,
        auto_scrambling_distance=False,
        seed=plan.seed,
        use_animated_seed=False,
        use_sample_subset=True,
        sample_offset=point,
        sample_subset_length=1,
        use_adaptive_sampling=False,
        use_layer_samples="IGNORE",
        time_limit=0.0,
        pixel_filter_type="GAUSSIAN",
        filter_width=_PINNED,
        tile_size=in_order.LARGEST,
        use_denoising=False,
    )
    written.set(scene.render, use_motion_blur=False)
    written.set(layer, use_motion_blur=False)
