# SPDX-License-Identifier: GPL-3.0-or-later
"""Where Spectral Tiles came out worse than Cycles: measured again with other seeds, and why it is."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from bench.document import Heading, Part, Table
from bench.jobs import AUTOMATIC, TILES, Settings, render
from bench.metrics import SIGMAS, Ratio, ratio
from bench.scene_results import COLUMN, Results, measured
from bench.table import Progress

#: How many times the report's seeds look again, and how many at least. These are other seeds: those that raised the
#: doubt were chosen for being bad.
_MORE, _LEAST = 2, 8


@dataclass(frozen=True)
class Doubt:
    """A scene and number of samples where Cycles came out better, measured again.

    Attributes
    ----------
    name : str
        The scene.
    samples : int
        Samples a pixel.
    seeds : int
        How many looked again.
    again : list of Ratio
        Our error over Cycles' at each of `metrics.SIGMAS`.
    raw : list of Ratio
        The same without control variates.
    """

    name: str
    samples: int
    seeds: int
    again: Sequence[Ratio]
    raw: Sequence[Ratio]

    @property
    def is_confirmed(self) -> bool:
        """Whether the other seeds say so too."""
        return is_worse(self.again[COLUMN])

    @property
    def reason(self) -> str:
        """Say why, as far as the figures tell."""
        if not self.is_confirmed:
            return "chance: other seeds do not confirm it"
        if not is_worse(self.raw[COLUMN]):
            return "control variates: without them it is level, so they add more noise here than they take out"
        if is_worse(self.raw[SIGMAS.index(0)]):
            return "single pixels err more as well, which an arrangement of samples should not cause"
        return (
            "single pixels err no more, but neighbours err more alike: the noise comes from random numbers that the "
            "arrangement does not look at, and whose order by Cycles it gives up"
        )


def is_worse(found: Ratio) -> bool:
    """Tell whether a ratio is above 1 by more than two standard errors."""
    return found.value - 2 * found.spread > 1


def doubtful(found: Sequence[Results]) -> list[tuple[Results, int]]:
    """Return the scenes and numbers of samples where Cycles is better by more than two standard errors."""
    return [
        (one, samples)
        for one in found
        for engine, samples in one.errors
        if engine == TILES and is_worse(one.over(AUTOMATIC, samples))
    ]


def looked_at_again(
    found: Sequence[Results], settings: Settings, seeds: Sequence[int], progress: Progress
) -> list[Doubt]:
    """Return what other seeds say of all that is doubtful.

    Parameters
    ----------
    found : sequence of Results
    settings : Settings
        Size and bounces of the report.
    seeds : sequence of int
        Of the report; those after them look again.
    progress : Progress
        Told of each doubt.
    """
    others = range(max(seeds) + 1, max(seeds) + 1 + max(_MORE * len(seeds), _LEAST))
    doubts = []
    for one, samples in doubtful(found):
        progress.say(f"{one.scene.name}: {samples} a pixel again, {len(others)} other seeds")
        ours = replace(settings, engine=TILES, samples=samples)
        wanted = (replace(settings, samples=samples), ours, replace(ours, raw=True))
        render(one.scene, [(each, others) for each in wanted])
        native, again, raw = (measured(one.scene, each, others, one.truth) for each in wanted)
        doubts.append(
            Doubt(
                one.scene.name,
                samples,
                len(others),
                [ratio(again[:, i], native[:, i]) for i in range(len(SIGMAS))],
                [ratio(raw[:, i], native[:, i]) for i in range(len(SIGMAS))],
            )
        )
    return doubts


def parts(doubts: Sequence[Doubt]) -> list[Part]:
    """Return the section that shows them."""
    title = "Is Cycles better anywhere?"
    if not doubts:
        return [Heading(title, "By more than two standard errors nowhere.")]
    text = [
        "Each scene and number of samples marked above was measured again with seeds that were not looked at before.",
        *(f"{doubt.name}, {doubt.samples} spp: {doubt.reason}." for doubt in doubts),
    ]
    header = ["over Cycles", "other seeds", *(f"sigma {sigma}" for sigma in SIGMAS)]
    header += [f"without control variates, sigma {sigma}" for sigma in SIGMAS[:2]]
    rows = [
        [f"{doubt.name}, {doubt.samples} spp", str(doubt.seeds), *map(str, doubt.again), *map(str, doubt.raw[:2])]
        for doubt in doubts
    ]
    caption = "Mean square error after Gaussians over Cycles' at equal samples ± standard error, other seeds"
    return [Heading(title, "\n".join(text)), Table(caption, header, rows)]
