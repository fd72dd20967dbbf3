# SPDX-License-Identifier: GPL-3.0-or-later
"""Figures of Mitchell 1991 from our own data, for docs/: ``python -m bench.figures --out docs/figures``."""

import argparse
import sys
from collections.abc import Callable
from functools import cache
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from addon.blender.region import Region
from addon.cycles import random_numbers
from addon.cycles.scene_analysis import SceneUse
from addon.plan import arranged_plan
from generator import make_tile
from generator.atomic_file import written_whole
from generator.best_candidate import best_candidates
from generator.periodogram import cylinder_power, mode_periodogram, pattern_periodogram

#: Designs that are compared, by the generator's names.
DESIGNS = ("white", "scanning", "spectral")

#: Side of the tiles and of the squares of pixels, and how much of them is drawn.
SIZE, SHOWN = 64, 48

SEED = 1991


def best_candidate() -> Figure:
    """Figure 4: one sequence of best candidates after 100, 400 and 1,600 points; figure 3: its spectrum."""
    figure, axes = _row(4)
    points = best_candidates(1600, 2, np.random.default_rng(SEED))
    for axis, count in zip(axes, (100, 400, 1600), strict=False):
        axis.plot(*points[:count].T, "k.", markersize=40 / count**0.5)
        axis.set(title=f"{count} points", xlim=(0, 1), ylim=(0, 1), xticks=[], yticks=[], box_aspect=1)
    power = pattern_periodogram([best_candidates(400, 2, np.random.default_rng(k)) for k in range(8)], 80).power
    _image(axes[3], power, "spectrum, 400 points", 2)
    return figure


def rooks() -> Figure:
    """Figure 15: two designs with the same marginal distributions and very different joint ones."""
    figure, axes = _row(2)
    for axis, title, column in zip(axes, ("good", "bad"), ([2, 5, 0, 7, 3, 6, 1, 4], range(8)), strict=True):
        axis.plot((np.arange(8) + 0.5) / 8, (np.array(column) + 0.5) / 8, "ks")
        axis.set(title=f"{title} joint distribution", xlim=(0, 1), ylim=(0, 1), xlabel="u", ylabel="v")
        axis.set_xticks(np.arange(9) / 8, [""] * 9)
        axis.set_yticks(np.arange(9) / 8, [""] * 9)
        axis.grid(True)
    return figure


def times() -> Figure:
    """Times of three tiles as grey pixels, and figure 10: the spectra of their errors."""
    figure, axes = _row(len(DESIGNS), rows=2)
    for column, (design, t) in enumerate(_times().items()):
        _image(axes[0, column], t[:SHOWN, :SHOWN, 0], f"{design}: times", 1)
        spectra = [mode_periodogram(t[..., None], (mode,)).power for mode in range(1, 5)]
        _image(axes[1, column], np.mean(spectra, axis=0), "spectrum of the error", 3)
    return figure


def cylinders() -> Figure:
    """Figure 5: power at low spatial frequencies, over the frequency in time."""
    figure, axes = _row(2)
    limits = (SIZE / 4, SIZE / 8)
    for design, t in _times().items():
        for axis, power in zip(axes, cylinder_power(t, 8, limits), strict=True):
            axis.plot(range(1, 9), power, "o-", label=design, color=_GREYS[design])
    for axis, limit in zip(axes, limits, strict=True):
        axis.set(title=f"below {limit / SIZE:g} a pixel", xlabel="frequency in time", ylim=(0, 1.9))
    axes[0].set_ylabel("power, white noise = 1")
    axes[1].legend(frameon=False, loc="upper right")
    return figure


def neighbourhoods() -> Figure:
    """Figure 6: the times found in discs of the image."""
    figure = Figure(figsize=(9, 3), layout="constrained")
    axes = figure.subplots(len(DESIGNS), 2)
    pixel = np.arange(SIZE) - SIZE // 2
    distance = np.hypot(pixel[:, None], pixel)
    for row, (design, t) in enumerate(_times().items()):
        for axis, radius in zip(axes[row], (1.5, 2.5), strict=True):
            axis.vlines(t[..., 0][distance <= radius], 0, 1, color="black")
            axis.set(xlim=(0, 1), xticks=[], yticks=[])
            axis.set_title(f"within {radius:g} pixels" if row == 0 else "")
        axes[row, 0].set_ylabel(design)
    for axis in axes[-1]:
        axis.set_xlabel("time")
    return figure


def arrangement() -> Figure:
    """The automatic plan: times as Cycles orders them, as we arrange them, and their errors' spectra."""
    region = Region((SIZE, SIZE), (0, 0), (SIZE, SIZE))
    y, x = np.mgrid[:SIZE, :SIZE]
    ranks = random_numbers.pixel_ranks(x, y, 0)
    drawn = random_numbers.sequence_values(ranks.ravel(), ["t"])[:, 0]
    arranged = np.empty_like(drawn)
    arranged[arranged_plan.make(SceneUse(True, False, 0, False, False), region, 1, 0).film] = drawn
    figure, axes = _row(4)
    curves = {"Cycles": drawn, "arranged": arranged, "white": np.random.default_rng(SEED).random(SIZE**2)}
    for axis, (name, t) in zip(axes, curves.items(), strict=False):
        _image(axis, t.reshape(SIZE, SIZE)[:SHOWN, :SHOWN], f"{name}: times", 1)
    for name, t in curves.items():
        spectra = [mode_periodogram(t.reshape(SIZE, SIZE, 1, 1), (mode,)) for mode in range(1, 5)]
        mean = np.mean([spectrum.radial_mean for spectrum in spectra], axis=0)
        axes[3].plot(spectra[0].radius / SIZE, mean, label=name, color=_GREYS[name])
    axes[3].set(title="error, radial mean", xlabel="cycles a pixel", ylim=(0, 2.4), box_aspect=1)
    axes[3].legend(frameon=False, loc="upper left")
    return figure


FIGURES: dict[str, Callable[[], Figure]] = {
    draw.__name__: draw for draw in (best_candidate, rooks, times, cylinders, neighbourhoods, arrangement)
}

_GREYS = {"white": "0.7", "scanning": "0.4", "Cycles": "0.4", "spectral": "0", "arranged": "0"}


@cache
def _times() -> dict[str, np.ndarray]:
    return {design: make_tile(design, SIZE, ["t"], SEED).values[..., 0] for design in DESIGNS}


def _row(columns: int, rows: int = 1) -> tuple[Figure, np.ndarray]:
    figure = Figure(figsize=(2.6 * columns, 2.8 * rows), layout="constrained")
    return figure, figure.subplots(rows, columns)


def _image(axis: Axes, pixels: np.ndarray, title: str, white: float) -> None:
    axis.imshow(pixels, origin="lower", cmap="gray", vmin=0, vmax=white, interpolation="nearest")
    axis.set(title=title, xticks=[], yticks=[])


def main() -> int:
    """Draw all figures and print their paths."""
    parser = argparse.ArgumentParser(prog="python -m bench.figures", description="Draw the figures of docs/.")
    parser.add_argument("--out", type=Path, required=True, metavar="FOLDER", help="receives the PNG files")
    folder = parser.parse_args().out
    folder.mkdir(parents=True, exist_ok=True)
    for name, draw in FIGURES.items():
        path = folder / f"{name}.png"
        with written_whole(path) as temporary:
            draw().savefig(temporary, dpi=100, bbox_inches="tight")
        print(path)
    return 0


if __name__ == "__main__":
    sys.exit(main())
