# SPDX-License-Identifier: GPL-3.0-or-later
"""``python -m bench paper``: the experiments of Mitchell 1991, sections 7 and 8, rendered by Cycles."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure

from bench.crops import crop, write_crop
from bench.doc_parts import write_picture, write_table
from bench.document import DPI, Heading, Part, Pictures, Plot, Table
from bench.equal_quality import MOST, SIGMAS, RandomImages, random_images, worth
from bench.jobs import Settings, engine_state, images, picture, render
from bench.metrics import LUMINANCE, Reference, mean_square_error, ratio
from bench.reference import SEEDS as REFERENCE_SEEDS
from bench.reference import reference, reference_settings
from bench.samplers import CYCLES, OURS, RANDOM, SHIPPED_TILE, Sampler, joint, joint_and_marginal, scanning, white
from bench.scene_files import scene_file
from bench.table import Progress
from generator.atomic_file import written_whole
from generator.periodogram import Periodogram, error_periodogram


@dataclass(frozen=True)
class Experiment:
    """One of the paper's comparisons.

    Attributes
    ----------
    figures : str
        What the paper calls them.
    scene : str
        The demo scene.
    dims : tuple of str
        What is left to sample in it.
    crop : tuple of float
        Middle of the crop that is shown, in parts of the picture from the upper left.
    """

    figures: str
    scene: str
    dims: tuple[str, ...]
    crop: tuple[float, float]


TIME = ("t",)
LENS = ("lens.u", "lens.v")
PENUMBRA = ("t", "light.u", "light.v")
EXPERIMENTS = (
    Experiment("Figures 8 and 9", "motion_blur", TIME, (0.46, 0.40)),
    Experiment("Figures 11 and 12", "square_lens", LENS, (0.25, 0.35)),
    Experiment("Figures 11 and 12 with a round lens", "round_lens", LENS, (0.25, 0.35)),
    Experiment("Figures 13 and 14", "glossy_reflection", ("bsdf.u", "bsdf.v"), (0.55, 0.80)),
    Experiment("Figure 16", "moving_penumbra", PENUMBRA, (0.62, 0.35)),
)

#: Pixels a side of the crops that the docs show, how much they are enlarged, and pixels between them.
_EDGE, _ENLARGED, _MARGIN = 160, 3, 12


@dataclass(frozen=True)
class Effort:
    """How much to render.

    Attributes
    ----------
    scenes : sequence of str
        Which of the experiments.
    lines : int
        Width and height of the pictures.
    seeds : sequence of int
        Of each sampler's renders.
    reference_samples : int
        Samples a pixel of each half of the references.
    spectrum_samples : sequence of int
        Samples a pixel of the references that the error spectra are taken against; the paper had 100.
    """

    scenes: Sequence[str]
    lines: int
    seeds: Sequence[int]
    reference_samples: int
    spectrum_samples: Sequence[int]

    @property
    def experiments(self) -> list[Experiment]:
        """The experiments on these scenes."""
        return [experiment for experiment in EXPERIMENTS if experiment.scene in self.scenes]

    @property
    def settings(self) -> Settings:
        """One sample a pixel, the scenes' own bounces."""
        return Settings(size=(self.lines, self.lines))


def parts(effort: Effort, folder: Path, progress: Progress) -> list[Part]:
    """Render everything and return the parts of a report; pictures are written to `folder`."""
    if not effort.experiments:
        return []
    for experiment in effort.experiments:
        progress.step(f"rendering {experiment.scene}")
        _render(experiment, effort)
    return [
        Heading(
            "The paper's figures, by Cycles",
            "One sample a pixel, box filter. The scanning tile is the paper's own algorithm, 32x32 pixels, repeated; "
            "the scenes are lit as its ray tracer did it, so that only the named effect is left to sample.",
        ),
        *(_figures(experiment, effort, folder) for experiment in effort.experiments),
        *(part for experiment in effort.experiments for part in _spectra(experiment, effort, folder, progress)),
        *_equal_quality(effort, progress),
        *(_joint_and_marginal(each, effort, progress) for each in effort.experiments if each.dims == PENUMBRA),
    ]


def steps(effort: Effort) -> int:
    """Return how many steps of progress `parts` takes."""
    return 2 * len(effort.experiments) + sum(each.dims == TIME for each in effort.experiments) * len(
        effort.spectrum_samples
    )


def _samplers(experiment: Experiment) -> list[Sampler]:
    """Return whom an experiment compares."""
    return [RANDOM, scanning(experiment.dims), SHIPPED_TILE, OURS, CYCLES]


def _render(experiment: Experiment, effort: Effort) -> None:
    """Render in one process all that an experiment needs."""
    samplers = [*_samplers(experiment), white(experiment.dims)]
    if experiment.dims == PENUMBRA:
        samplers += [joint(PENUMBRA), joint_and_marginal(PENUMBRA)]
    wanted = [(sampler.settings(effort.settings), effort.seeds) for sampler in samplers]
    converged = reference_settings(effort.settings, effort.reference_samples)
    render(scene_file(experiment.scene), [*wanted, *random_images(effort.settings), (converged, REFERENCE_SEEDS)])


def _truth(experiment: Experiment, effort: Effort, progress: Progress) -> Reference:
    return reference(scene_file(experiment.scene), effort.settings, effort.reference_samples, progress.say)


def _figures(experiment: Experiment, effort: Effort, folder: Path) -> Part:
    """Return crops of one picture a sampler, and of the reference."""
    scene = scene_file(experiment.scene)
    samplers = _samplers(experiment)
    shown = [picture(scene, sampler.settings(effort.settings), effort.seeds[0]) for sampler in samplers]
    converged = reference_settings(effort.settings, effort.reference_samples)
    shown.append(picture(scene, converged, REFERENCE_SEEDS[0]))
    names = [*(sampler.name for sampler in samplers), f"converged, {effort.reference_samples} samples"]
    crops = [
        (name, write_crop(path, experiment.crop, folder / f"{experiment.scene}-{number}.png"))
        for number, (path, name) in enumerate(zip(shown, names, strict=True))
    ]
    return Pictures(f"{experiment.figures}: {experiment.scene}", [crops[:3], crops[3:]])


def _spectra(experiment: Experiment, effort: Effort, folder: Path, progress: Progress) -> list[Part]:
    """Return figures 10a and 10b, and their radial means, of the wheels that only move."""
    if experiment.dims != TIME:
        return []
    scene = scene_file(experiment.scene)
    found = []
    for count in effort.spectrum_samples:
        progress.step(f"figure 10: {experiment.scene} against {count} samples a pixel")
        truth = reference(scene, effort.settings, max(count // 2, 1), progress.say).mean
        spectra = {}
        for sampler in _samplers(experiment):
            errors = [
                (image - truth) @ LUMINANCE for image in images(scene, sampler.settings(effort.settings), effort.seeds)
            ]
            spectra[sampler.name] = error_periodogram(errors)
        path = folder / f"spectra-{count}.png"
        with written_whole(path) as temporary:
            _spectra_plot(spectra).savefig(temporary, dpi=DPI)
        found.append(
            Plot(
                f"Figure 10: error spectra of the spinning wheels against a reference of {count} samples a pixel, "
                f"mean of {len(effort.seeds)} seeds; zero frequency in the middle, lighter is more power. "
                "Below, radial means relative to the random values' mean",
                path,
            )
        )
    return found


def _spectra_plot(spectra: dict[str, Periodogram]) -> Figure:
    figure = Figure(figsize=(2.2 * len(spectra), 5.2), layout="constrained")
    axes = figure.subplot_mosaic([list(spectra), ["radial"] * len(spectra)], height_ratios=(2, 3))
    white = spectra[RANDOM.name].radial_mean.mean()
    for name, spectrum in spectra.items():
        size = len(spectrum.power)
        # Averages of 4 x 4 frequencies, so that a page shows the shape and not the speckle.
        smooth = spectrum.power[: size // 4 * 4, : size // 4 * 4].reshape(size // 4, 4, size // 4, 4).mean((1, 3))
        axes[name].imshow(np.sqrt(smooth / white), cmap="gray", vmin=0, vmax=2, origin="lower")
        axes[name].set(title=name, xticks=[], yticks=[])
        axes["radial"].plot(spectrum.radius / size, spectrum.radial_mean / white, label=name)
    axes["radial"].set(xlabel="cycles a pixel", ylabel="power, random values' mean = 1", yscale="log")
    axes["radial"].legend()
    return figure


def _equal_quality(effort: Effort, progress: Progress) -> list[Part]:
    """Return the table of how many random samples one sample is worth."""
    rows, values = [], {}
    for experiment in effort.experiments:
        progress.step(f"equal quality: {experiment.scene}")
        scene = scene_file(experiment.scene)
        random = RandomImages(scene, effort.settings, _truth(experiment, effort, progress))
        samplers = (white(experiment.dims), *_samplers(experiment)[1:])
        found = {s.name: worth(scene, effort.settings, s, effort.seeds, random) for s in samplers}
        for name, one in found.items():
            of_cycles = [ratio(found[CYCLES.name].errors[:, i], one.errors[:, i]) for i in range(len(SIGMAS))]
            ratios = [*one.same_film, *one.anywhere, one.by_flip, *of_cycles]
            values.setdefault(name, []).append([r.value for r in ratios])
            figures = [f"{_count(r.value)}±{r.spread:.2f}" if np.isfinite(r.value) else _count(r.value) for r in ratios]
            rows.append([f"{experiment.scene}, {name}", *figures])
    if len(effort.experiments) > 1:
        rows += [[f"median, {name}", *map(_count, np.median(each, axis=0))] for name, each in values.items()]
    sigmas = [f"sigma {sigma}" for sigma in SIGMAS]
    header = ["", *sigmas, *(f"anywhere, {s}" for s in sigmas), "FLIP", *(f"of Cycles', {s}" for s in sigmas)]
    return [
        Heading(
            f"Equal quality at {effort.lines} lines",
            "How many random samples a pixel have the error of one sample (section 7; the paper's experts said three "
            "or four for its scanning tile in the wheels). Mean square error of luminance after a Gaussian of sigma "
            "pixels, ± standard error. First against random values at the same place in the pixel, its middle; then, "
            "and by FLIP, against random samples anywhere in the pixel. The white tile is random values on the way a "
            "tile takes: it should be worth one. Last, errors of Cycles' pattern over one's own, also at one sample a "
            "pixel: how many of its samples one is worth if its error falls like that of random ones. "
            "Errors hold the aliasing of still edges too, which no sampling of the parameters helps; it weighs less at "
            "more lines.",
        ),
        Table(
            f"Random samples a pixel with the error of one sample; {effort.lines}x{effort.lines}, {len(effort.seeds)} "
            f"seeds ± standard error, {MOST} seeds of random samples, engine state {engine_state()}",
            header,
            rows,
        ),
    ]


def _count(samples: float) -> str:
    return f"{samples:.2f}" if np.isfinite(samples) else f"more than {MOST}"


def _joint_and_marginal(experiment: Experiment, effort: Effort, progress: Progress) -> Part:
    """Return section 8's comparison on the moving penumbra."""
    scene, truth = scene_file(experiment.scene), _truth(experiment, effort, progress)
    marginal = replace(scanning(experiment.dims), name="marginal only")
    samplers = (RANDOM, marginal, joint(experiment.dims), joint_and_marginal(experiment.dims), SHIPPED_TILE, OURS)
    middle, edge = experiment.crop, effort.lines // 4
    inside = tuple(slice(round(c * effort.lines - edge / 2), round(c * effort.lines + edge / 2)) for c in middle)
    inside = (slice(effort.lines - inside[1].stop, effort.lines - inside[1].start), inside[0])  # rows run upwards
    shadow = Reference(truth.first[inside], truth.second[inside])
    errors = {}
    for sampler in samplers:
        found = images(scene, sampler.settings(effort.settings), effort.seeds)
        errors[sampler.name] = np.array(
            [
                [mean_square_error(image, truth, sigma) for sigma in SIGMAS]
                + [mean_square_error(image[inside], shadow, sigma) for sigma in SIGMAS]
                for image in found
            ]
        )
    rows = [
        [name, *(str(ratio(own[:, i], errors[RANDOM.name][:, i])) for i in range(own.shape[1]))]
        for name, own in errors.items()
    ]
    header = ["", *(f"{where}, sigma {sigma}" for where in ("picture", "moving penumbra") for sigma in SIGMAS)]
    caption = f"Section 8: mean square error over that of random values, {len(effort.seeds)} seeds ± standard error"
    return Table(caption, header, rows)


def write_docs(effort: Effort, parts: Sequence[Part]) -> None:
    """Renew the docs' pictures and table: the wheels, the first of the spectra, and equal quality."""
    for experiment in effort.experiments:
        if experiment.dims == TIME:
            write_picture(experiment.scene, _beside_cycles(experiment, effort))
    plots = [part for part in parts if isinstance(part, Plot)]
    tables = [part for part in parts if isinstance(part, Table)]
    if plots:
        write_picture("error_spectra", plt.imread(plots[0].path)[..., :3])
    write_table("paper", tables[0])


def _beside_cycles(experiment: Experiment, effort: Effort) -> np.ndarray:
    """Return enlarged crops by Cycles' own pattern and by ours."""
    shown = []
    for sampler in (CYCLES, OURS):
        path = picture(scene_file(experiment.scene), sampler.settings(effort.settings), effort.seeds[0])
        part = crop(plt.imread(path)[..., :3], experiment.crop, min(_EDGE, effort.lines))
        shown.append(part.repeat(_ENLARGED, 0).repeat(_ENLARGED, 1))
    return np.concatenate((shown[0], np.ones((len(shown[0]), _MARGIN, 3), np.float32), shown[1]), axis=1)
