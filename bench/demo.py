# SPDX-License-Identifier: GPL-3.0-or-later
"""``python -m bench demo``: one scene by Cycles and by ours, denoised, in the same time, as pictures to look at."""

import shutil
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from bench import side_by_side
from bench.doc_parts import renew, write_picture
from bench.equal_time import is_near, value_in_time
from bench.jobs import engine_state
from bench.metrics import SIGMAS
from bench.real_figures import error_maps, seen
from bench.real_renders import EVEN, NATIVE, OURS, REFERENCE, REFERENCE_SEEDS, THRESHOLD, Render, Result, rendered
from bench.scene_files import ROOT, SceneFile
from bench.table import Progress, table

CYCLES, SAME_TIME, TILES = "Cycles", "Cycles in the same time", "Spectral Tiles"

#: Renders that look for Cycles' setting of the same time, of each kind, and by how much its time may then differ.
_TRIES, _NEAR = 3, 0.10

#: Samples everywhere that are tried first.
_SAMPLES = 32


@dataclass(frozen=True)
class _Shown:
    """A picture: how it was rendered, its square error pixel by pixel, and 1000 times the root of its mean by sigma.

    `blurred_error` is after a Gaussian of one pixel.
    """

    render: Render
    result: Result
    error: np.ndarray
    blurred_error: np.ndarray
    errors: list[float]

    @property
    def setting(self) -> str:
        """What an artist would call it."""
        value = self.render.value
        return f"a noise threshold of {value:g}" if self.render.rule == THRESHOLD else f"{value:g} samples everywhere"


def make(scene: SceneFile, width: int, threshold: float, reference_samples: int, folder: Path, docs: bool) -> str:
    """Write both pictures and their comparison, and return the table of times and errors.

    Parameters
    ----------
    scene : SceneFile
        What to render.
    width : int
        Of the pictures in pixels; the height follows from the scene.
    threshold : float
        Noise threshold of Cycles and of ours. The picture beside ours is Cycles' with the threshold, or the samples
        everywhere, with which it takes as much of the processor's time, whichever leaves less error; found by a few
        renders.
    reference_samples : int
        Samples a pixel of each half of the converged picture, which has no denoiser.
    folder : Path
        Where to; made if missing.
    docs : bool
        Whether the comparison becomes the picture of README, too.

    Raises
    ------
    ValueError
        Nothing takes Cycles as long; the pictures are written, and the message holds the table.
    """
    folder.mkdir(parents=True, exist_ok=True)
    progress = Progress(5 + 2 * _TRIES)

    def picture(render: Render) -> Result:
        progress.step(f"{scene.name}: {render.engine}, {render.setting}")
        return rendered(scene, width, render)

    def native(rule: str, value: float) -> Render:
        return Render(NATIVE, rule, value, denoise=True, beside=engine_state())

    halves = [
        seen(picture(Render(NATIVE, REFERENCE, reference_samples, seed=seed)).pixels()) for seed in REFERENCE_SEEDS
    ]

    def judged(render: Render) -> _Shown:
        result = rendered(scene, width, render)
        of_sigmas = error_maps(seen(result.pixels()), halves)
        return _Shown(render, result, *of_sigmas[:2], [1000 * max(float(e.mean()), 0.0) ** 0.5 for e in of_sigmas])

    ours = Render(OURS, THRESHOLD, threshold, denoise=True)
    time = picture(ours).processor
    found = []
    for rule, first in ((THRESHOLD, threshold), (EVEN, _SAMPLES)):
        seconds = partial(_seconds, picture, native, rule)
        value = value_in_time(rule, [(first, seconds(first))], time, seconds, _TRIES)
        found.append(judged(native(rule, value)))
    near = [each for each in found if is_near(each.result.processor, time, _NEAR)]
    pictures = {
        CYCLES: judged(native(THRESHOLD, threshold)),
        SAME_TIME: min(near or found, key=lambda each: each.errors[0]),
        TILES: judged(ours),
    }
    for name, each in pictures.items():
        shutil.copy(each.result.png, folder / f"{name.lower().replace(' ', '_')}.png")
    cycles, tiles = pictures[SAME_TIME], pictures[TILES]
    shown = [
        (
            name,
            f"{each.setting}, denoised: {each.result.processor:.0f} s",
            plt.imread(each.result.png)[..., :3],
        )
        for name, each in ((CYCLES, cycles), (TILES, tiles))
    ]
    maps = [np.sqrt(np.maximum(each.blurred_error, 0.0)) for each in (cycles, tiles)]
    sheet = side_by_side.write(folder / "side_by_side.png", shown, cycles.error - tiles.error, maps)

    rows = [
        [
            f"{name}, {each.setting}",
            *(f"{seconds:.1f}" for seconds in (each.result.processor, each.result.wall)),
            *(f"{error:.2f}" for error in each.errors),
        ]
        for name, each in pictures.items()
    ]
    header = ["", "processor s", "wall s", *(f"RMSE x 1000, sigma {sigma}" for sigma in SIGMAS)]
    text = f"{scene.name}, {width} px wide, denoised\n{table(header, rows)}\n\nPictures in {folder}"
    if not near:
        raise ValueError(f"{text}\nNo setting was found with which Cycles takes as long as ours.")
    if docs:
        write_picture("demo", sheet)
        renew(ROOT / "README.md", "demo", _caption(cycles, tiles))
    return f"{text}, compared in side_by_side.png"


def _seconds(picture: Callable, native: Callable, rule: str, value: float) -> float:
    """Return the processor time of Cycles' picture."""
    return picture(native(rule, value)).processor


def _caption(cycles: _Shown, tiles: _Shown) -> str:
    """Return README's picture with what it shows."""
    left, right = (f"{each.setting}, {each.result.processor:.0f} s of the processor's time" for each in (cycles, tiles))
    alt = "The same scene by Cycles and by Spectral Tiles in the same time, enlarged parts, and their errors"
    return (
        f"![{alt}](docs/demo.jpg)\n\n"
        f"Both denoised, in the same time. Left Cycles with {left};\nright Spectral Tiles with {right}, and "
        f"{tiles.errors[0] / cycles.errors[0]:.2f} of the error\n(root mean square; `python -m bench demo`). "
        "Below, where either is wrong, on the same scale."
    )
