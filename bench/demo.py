# SPDX-License-Identifier: GPL-3.0-or-later
"""``python -m bench demo``: one scene by Cycles and by ours, denoised, in the same time, as pictures to look at."""

import shutil
from pathlib import Path

import matplotlib.pyplot as plt

from bench import side_by_side
from bench.doc_parts import renew, write_picture
from bench.equal_time import is_near, value_in_time
from bench.jobs import engine_state
from bench.metrics import SIGMAS
from bench.real_figures import error_maps, seen
from bench.real_renders import NATIVE, OURS, REFERENCE, REFERENCE_SEEDS, THRESHOLD, Render, Result, rendered
from bench.scene_files import ROOT, SceneFile
from bench.table import Progress, table

CYCLES, SAME_TIME, TILES = "Cycles", "Cycles in the same time", "Spectral Tiles"

#: Renders that look for Cycles' threshold of the same time, and by how much its time may then differ.
_TRIES, _NEAR = 3, 0.10


def make(scene: SceneFile, width: int, threshold: float, reference_samples: int, folder: Path, docs: bool) -> str:
    """Write both pictures and their comparison, and return the table of times and errors.

    Parameters
    ----------
    scene : SceneFile
        What to render.
    width : int
        Of the pictures in pixels; the height follows from the scene.
    threshold : float
        Noise threshold of Cycles and of ours. The picture beside ours is Cycles' with the threshold that takes it as
        much of the processor's time, found by a few renders.
    reference_samples : int
        Samples a pixel of each half of the converged picture, which has no denoiser.
    folder : Path
        Where to; made if missing.
    docs : bool
        Whether the comparison becomes the picture of README, too.

    Raises
    ------
    ValueError
        No such threshold was found; the pictures are written, and the message holds the table.
    """
    folder.mkdir(parents=True, exist_ok=True)
    progress = Progress(4 + _TRIES)

    def picture(name: str, render: Render) -> Result:
        progress.step(f"{scene.name}: {name}, {render.setting}")
        return rendered(scene, width, render)

    def native(value: float) -> Render:
        return Render(NATIVE, THRESHOLD, value, denoise=True, beside=engine_state())

    ours = picture(TILES, Render(OURS, THRESHOLD, threshold, denoise=True))
    first = picture(CYCLES, native(threshold))
    known = [(threshold, first.processor)]

    def seconds(value: float) -> float:
        return picture(CYCLES, native(value)).processor

    other = value_in_time(THRESHOLD, known, ours.processor, seconds, _TRIES)
    same_time = rendered(scene, width, native(other))
    results = {CYCLES: first, SAME_TIME: same_time, TILES: ours}
    thresholds = {CYCLES: threshold, SAME_TIME: other, TILES: threshold}
    halves = [
        seen(picture("converged", Render(NATIVE, REFERENCE, reference_samples, seed=seed)).pixels())
        for seed in REFERENCE_SEEDS
    ]
    errors, maps = {}, {}
    for name, result in results.items():
        shutil.copy(result.png, folder / f"{name.lower().replace(' ', '_')}.png")
        maps[name], *_ = of_sigmas = error_maps(seen(result.pixels()), halves)
        errors[name] = [1000 * max(float(each.mean()), 0.0) ** 0.5 for each in of_sigmas]
    shown = [
        (
            name,
            f"noise threshold {thresholds[which]:g}, denoised: {results[which].processor:.0f} s",
            plt.imread(results[which].png)[..., :3],
        )
        for name, which in ((CYCLES, SAME_TIME), (TILES, TILES))
    ]
    sheet = side_by_side.write(folder / "side_by_side.png", shown, maps[SAME_TIME] - maps[TILES])

    rows = [
        [
            f"{name}, threshold {thresholds[name]:g}",
            *(f"{seconds:.1f}" for seconds in (results[name].processor, results[name].wall)),
            *(f"{error:.2f}" for error in errors[name]),
        ]
        for name in results
    ]
    header = ["", "processor s", "wall s", *(f"RMSE x 1000, sigma {sigma}" for sigma in SIGMAS)]
    text = f"{scene.name}, {width} px wide, denoised\n{table(header, rows)}\n\nPictures in {folder}"
    if not is_near(same_time.processor, ours.processor, _NEAR):
        raise ValueError(f"{text}\nNo threshold was found with which Cycles takes as long as ours.")
    if docs:
        write_picture("demo", sheet)
        renew(ROOT / "README.md", "demo", _caption(scene, results, thresholds, errors))
    return f"{text}, compared in side_by_side.png"


def _caption(scene: SceneFile, results: dict, thresholds: dict, errors: dict) -> str:
    """Return README's picture with what it shows."""
    cycles, ours = (
        f"a noise threshold of {thresholds[name]:g}, {results[name].processor:.0f} s of the processor's time"
        for name in (SAME_TIME, TILES)
    )
    less = errors[TILES][0] / errors[SAME_TIME][0]
    alt = "The same scene by Cycles and by Spectral Tiles in the same time, with enlarged parts below"
    return (
        f"![{alt}](docs/demo.jpg)\n\n"
        f"Both denoised, in the same time. Left Cycles with {cycles}; right Spectral Tiles with {ours}, and "
        f"{less:.2f} of the error\n(root mean square; `python -m bench demo --scene {scene.name}`)."
    )
