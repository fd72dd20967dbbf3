# SPDX-License-Identifier: GPL-3.0-or-later
"""``python -m bench report``: where we stand against Cycles, on one page."""

import os
import platform
from collections.abc import Sequence
from dataclasses import dataclass, replace
from datetime import date
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure

from bench import paper
from bench.crops import crop, write_crop
from bench.document import Heading, Part, Pictures, Plot, Table, page
from bench.errors import Errors
from bench.jobs import (
    AUTOMATIC,
    TABULATED,
    TILES,
    Settings,
    blender_version,
    engine_state,
    images,
    picture,
    render,
    run_worker,
)
from bench.metrics import SIGMAS, Ratio, flip_of_pictures, mean_square_error, ratio
from bench.readme import write_picture, write_table
from bench.reference import SEEDS as REFERENCE_SEEDS
from bench.reference import reference, reference_settings
from bench.scene_files import ROOT, SceneFile, scene_file
from bench.table import Progress
from bench.timing import times

LABELS = {AUTOMATIC: "Cycles", TABULATED: "Cycles, white noise", TILES: "Spectral Tiles"}

#: Scenes by name, and the middle of the crop that is shown, in parts of the picture from the upper left.
SCENES = {
    "wheels": (0.46, 0.40),
    "motion_blur": (0.46, 0.40),
    "moving_penumbra": (0.62, 0.35),
    "round_lens": (0.25, 0.35),
    "glossy_reflection": (0.55, 0.80),
    "interior": (0.45, 0.55),
    "windy_forest": (0.30, 0.55),
    "dandelion": (0.55, 0.35),
    "swinging_lamp": (0.45, 0.60),
}
QUICK_SCENES = ("motion_blur", "moving_penumbra", "interior")

#: Samples a pixel at which denoising, adaptive sampling and equal time are compared.
COMPARED = 4

#: The Gaussian by which scenes are judged, in pixels.
SIGMA = 1


@dataclass(frozen=True)
class Effort:
    """How much to render.

    Attributes
    ----------
    scenes : sequence of str
        Of `SCENES`.
    lines : int
        Width and height of their pictures.
    samples : sequence of int
        Samples a pixel.
    seeds : sequence of int
        One image each.
    reference_samples : int
        Samples a pixel of each half of the references.
    timed_size : tuple of int
        Pixels of the frames whose wall time is measured.
    pairs : int
        Pairs of timed processes.
    """

    scenes: Sequence[str]
    lines: int
    samples: Sequence[int]
    seeds: Sequence[int]
    reference_samples: int
    timed_size: tuple[int, int]
    pairs: int

    @property
    def settings(self) -> Settings:
        """Size of the pictures, the scenes' own bounces."""
        return Settings(size=(self.lines, self.lines))


@dataclass(frozen=True)
class Found:
    """What was measured on one scene.

    Attributes
    ----------
    errors : dict
        Mean square errors, shape (seeds, sigmas), by engine and samples a pixel.
    variants : dict
        Mean square errors by the name of a variant, at `COMPARED` samples.
    flips : dict
        FLIP of the variants' first pictures.
    parts : list
        Crops: a row of engines for each number of samples, then the variants.
    time_ratio : float
        Our time over native, at `COMPARED` samples.
    """

    errors: dict[tuple[str, int], Errors]
    variants: dict[str, Errors]
    flips: dict[str, float]
    parts: list[Part]
    time_ratio: float


def make(effort: Effort, experiments: paper.Effort, folder: Path, readme: bool) -> Path:
    """Write the page and its pictures to a folder and return the page's path.

    Parameters
    ----------
    effort : Effort
        Of the scenes.
    experiments : bench.paper.Effort
        Of the paper's experiments.
    folder : Path
        Where to; made if missing.
    readme : bool
        Also renew README's pictures and table.
    """
    pictures = folder / "pictures"
    pictures.mkdir(parents=True, exist_ok=True)
    progress = Progress(len(effort.scenes) + paper.steps(experiments) + 1)
    found = {name: _scene(name, effort, pictures, progress) for name in effort.scenes}
    summary = _summary(found, effort)
    parts = [
        *(replace(one.parts[0], rows=one.parts[0].rows[:1]) for name, one in found.items() if name in SHOWN),
        Heading("How this was measured", _conditions(effort)),
        Heading(
            "At equal samples",
            f"Mean square error of luminance after a Gaussian of sigma {SIGMA} pixel, over that of Cycles' automatic "
            f"pattern at the same number of samples, {len(effort.seeds)} seeds ± standard error. Below 1 is better. "
            "An exclamation mark: worse by more than two standard errors." + _worse(found),
        ),
        summary,
        _against_white(found, effort),
        Plot("Convergence: error over samples a pixel, both scales logarithmic", _convergence(found, effort, pictures)),
        Heading("Equal time, denoised, adaptive", _VARIANTS),
        _variants(found),
        _times(effort, progress),
        Heading("Tiles", "The step test, white noise = 1, lower is better; from README, which says how it is made."),
        tiles_table(),
        *paper.parts(experiments, pictures, progress),
        Heading("Scene by scene", "Crops pixel by pixel, first seed, through each scene's own view."),
        *(part for one in found.values() for part in one.parts),
    ]
    path = folder / "report.html"
    path.write_text(page("Spectral Tiles against Cycles", parts), encoding="utf-8")
    if readme:
        _write_readme(summary, effort)
    return path


def _conditions(effort: Effort) -> str:
    noun = f"{effort.lines}x{effort.lines} pixels, box filter of one pixel, the scenes' own bounces"
    return (
        f"Blender {blender_version()}, CPU: {_processor()}, {os.cpu_count()} threads, {platform.system()}, "
        f"engine state {engine_state()}, {date.today():%d %B %Y}.\n"
        f"{noun}. References: two halves of {effort.reference_samples} samples a pixel by native Cycles, whose own "
        "noise is taken out of the figures by multiplying the errors against one half and the other. Every engine "
        "renders the same files; nothing is tuned to a scene."
    )


def _processor() -> str:
    """Return the processor's name, where the system tells it."""
    info = Path("/proc/cpuinfo")
    lines = info.read_text().splitlines() if info.is_file() else []
    names = (line.partition(":")[2].strip() for line in lines if line.startswith("model name"))
    return next(names, platform.processor() or platform.machine())


# --- One scene -------------------------------------------------------------------------------------------------------


def _scene(name: str, effort: Effort, folder: Path, progress: Progress) -> Found:
    """Render and measure one scene."""
    progress.step(f"{name}: rendering")
    scene, base = scene_file(name), effort.settings
    time_ratio = _time_ratio(scene, replace(base, samples=COMPARED))
    longer = max(COMPARED, round(COMPARED * time_ratio))
    variants = {
        "Cycles": replace(base, samples=COMPARED),
        f"Cycles at equal time ({longer} samples)": replace(base, samples=longer),
        "Cycles, adaptive": replace(base, samples=COMPARED, adaptive=True),
        "Spectral Tiles": replace(base, samples=COMPARED, engine=TILES),
        "Cycles, denoised": replace(base, samples=COMPARED, denoise=True),
        "Spectral Tiles, denoised": replace(base, samples=COMPARED, engine=TILES, denoise=True),
    }
    plain = {
        (engine, count): replace(base, engine=engine, samples=count) for count in effort.samples for engine in LABELS
    }
    wanted = [(settings, effort.seeds) for settings in (*plain.values(), *variants.values())]
    render(scene, [(reference_settings(base, effort.reference_samples), REFERENCE_SEEDS), *wanted])

    truth = reference(scene, base, effort.reference_samples, progress.say)
    converged = picture(scene, reference_settings(base, effort.reference_samples), REFERENCE_SEEDS[0])

    def errors(settings: Settings) -> Errors:
        found = images(scene, settings, effort.seeds)
        return np.array([[mean_square_error(image, truth, sigma) for sigma in SIGMAS] for image in found])

    def shown(settings: Settings, label: str) -> Path:
        source = picture(scene, settings, effort.seeds[0])
        return write_crop(source, SCENES[name], effort.lines // 2, folder / f"{name}-{label}.png")

    rows = [
        (
            f"{count} {'sample' if count == 1 else 'samples'}:",
            [shown(plain[engine, count], f"{engine.lower()}-{count}") for engine in LABELS],
        )
        for count in effort.samples
    ]
    crops = [shown(settings, f"variant-{i}") for i, settings in enumerate(variants.values())]
    return Found(
        {key: errors(settings) for key, settings in plain.items()},
        {label: errors(settings) for label, settings in variants.items()},
        {
            label: flip_of_pictures(picture(scene, settings, effort.seeds[0]), converged)
            for label, settings in variants.items()
        },
        [
            Pictures(f"{name}: equal samples", list(LABELS.values()), rows),
            Pictures(f"{name}: {COMPARED} samples", list(variants)[:3], [("", crops[:3])]),
            Pictures("", list(variants)[3:], [("", crops[3:])]),
        ],
        time_ratio,
    )


def _time_ratio(scene: SceneFile, settings: Settings) -> float:
    """Return our wall time over native for one frame, from the second renders of one process."""
    both = [(replace(settings, engine=engine), {"repeats": 2}) for engine in (AUTOMATIC, TILES)]
    native, ours = (seconds[1][0] for seconds in run_worker(scene, both)["seconds"])
    return ours / native


# --- All scenes together ---------------------------------------------------------------------------------------------

_VARIANTS = (
    f"At {COMPARED} samples a pixel; adaptive sampling has that as its largest number and the scene's own threshold, "
    "so at so few samples it cannot gain. Root mean square error times 1000 and, in brackets, FLIP of the first seed's "
    "picture as the scene's view shows it. Equal time gives Cycles the samples it makes while Spectral Tiles makes "
    f"{COMPARED}, its plan being made already."
)


def _ratios(one: Found, effort: Effort, theirs: str) -> list[Ratio]:
    """Return our error over another engine's at each number of samples."""
    column = SIGMAS.index(SIGMA)
    return [
        ratio(one.errors[TILES, count][:, column], one.errors[theirs, count][:, column]) for count in effort.samples
    ]


def _is_worse(found: Ratio) -> bool:
    return found.value - 2 * found.spread > 1


def _worse(found: dict[str, Found]) -> str:
    """Return a sentence that names the scenes where Cycles is better."""
    names = [
        f"{name} ({count} spp)"
        for name, one in found.items()
        for engine, count in one.errors
        if engine == TILES
        and _is_worse(ratio(*(one.errors[e, count][:, SIGMAS.index(SIGMA)] for e in (TILES, AUTOMATIC))))
    ]
    return f"\nWorse by more than two standard errors: {', '.join(names) or 'none'}."


def _summary(found: dict[str, Found], effort: Effort) -> Table:
    rows, values = [], []
    for name, one in found.items():
        ratios = _ratios(one, effort, AUTOMATIC)
        values.append([r.value for r in ratios])
        rows.append([name, *(f"{r}{' !' if _is_worse(r) else ''}" for r in ratios)])
    rows.append(["median", *(f"{value:.3f}" for value in np.median(values, axis=0))])
    header = ["over Cycles", *(f"{count} spp" for count in effort.samples)]
    caption = (
        f"Mean square error over that of Cycles' automatic pattern at equal samples after a Gaussian of {SIGMA} pixel, "
        f"{effort.lines}x{effort.lines}, {len(effort.seeds)} seeds ± standard error, engine state {engine_state()}"
    )
    return Table(caption, header, rows)


def _against_white(found: dict[str, Found], effort: Effort) -> Table:
    each = {name: _ratios(one, effort, TABULATED) for name, one in found.items()}
    rows = [[name, *map(str, ratios)] for name, ratios in each.items()]
    medians = np.median([[r.value for r in ratios] for ratios in each.values()], axis=0)
    rows.append(["median", *(f"{value:.3f}" for value in medians)])
    header = ["over white noise", *(f"{count} spp" for count in effort.samples)]
    return Table("The same over Cycles' Tabulated Sobol, which is white noise over the image", header, rows)


def _convergence(found: dict[str, Found], effort: Effort, folder: Path) -> Path:
    """Draw error over samples, a small diagram a scene."""
    columns = min(3, len(found))
    figure = Figure(figsize=(3.4 * columns, 2.7 * -(-len(found) // columns)), layout="constrained")
    axes = figure.subplots(-(-len(found) // columns), columns, squeeze=False).ravel()
    for axis, (name, one) in zip(axes, found.items(), strict=False):
        for engine, label in LABELS.items():
            squares = [one.errors[engine, count][:, SIGMAS.index(SIGMA)] for count in effort.samples]
            spread = [np.sqrt(np.maximum(square, 0)).std() for square in squares]
            axis.errorbar(effort.samples, [np.sqrt(abs(square.mean())) for square in squares], spread, label=label)
        axis.set(title=name, xscale="log", yscale="log", xticks=effort.samples, xticklabels=map(str, effort.samples))
        axis.minorticks_off()
    for axis in axes[len(found) :]:
        axis.remove()
    axes[0].legend(fontsize="small")
    path = folder / "convergence.png"
    figure.savefig(path, dpi=100)
    return path


def _variants(found: dict[str, Found]) -> Table:
    column = SIGMAS.index(SIGMA)
    labels = [label.partition(" (")[0] for label in next(iter(found.values())).variants]
    rows = [
        [
            f"{name} (time x {one.time_ratio:.2f})",
            *(
                f"{1000 * np.sqrt(abs(errors[:, column].mean())):.1f} ({one.flips[label]:.3f})"
                for label, errors in one.variants.items()
            ),
        ]
        for name, one in found.items()
    ]
    return Table(f"RMSE x 1000 at sigma {SIGMA} (FLIP)", ["", *labels], rows)


def _times(effort: Effort, progress: Progress) -> Table:
    progress.step("wall times")
    return times([scene_file("wheels")], Settings(size=effort.timed_size), effort.pairs, progress.say)


def tiles_table() -> Table:
    """Return README's table of tiles."""
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    lines = [line for line in readme.partition("\n## Tiles")[2].splitlines() if line.startswith("|")]
    cells = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]
    end = next((i for i, row in enumerate(cells) if i > 1 and len(row) != len(cells[0])), len(cells))
    return Table("Mean square error of step functions after a Gaussian of 1 / 2 / 4 pixels", cells[0], cells[2:end])


# --- README ----------------------------------------------------------------------------------------------------------

#: Scenes of the pictures that README shows, and how they are cut and enlarged.
SHOWN = ("motion_blur",)
README_LINES, README_CROP, ENLARGED, MARGIN = 512, 160, 3, 12


def _write_readme(summary: Table, effort: Effort) -> None:
    """Renew README's pictures and the table between its two marks."""
    for name in SHOWN:
        one = Settings(size=(README_LINES, README_LINES))
        shown = []
        for engine in (AUTOMATIC, TILES):
            whole = plt.imread(picture(scene_file(name), replace(one, engine=engine), effort.seeds[0]))[..., :3]
            shown.append(crop(whole, SCENES[name], README_CROP).repeat(ENLARGED, 0).repeat(ENLARGED, 1))
        gap = np.ones((len(shown[0]), MARGIN, 3), np.float32)
        write_picture(name, np.concatenate((shown[0], gap, shown[1]), axis=1))
    write_table("report", summary)
