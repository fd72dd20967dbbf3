# SPDX-License-Identifier: GPL-3.0-or-later
"""The figures of real files as tables: medians and worst over all files, and each file, worst first."""

import statistics
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from bench.document import Heading, Part, Table
from bench.metrics import SIGMAS
from bench.real_figures import BETTER
from bench.real_renders import DENOISED, EVEN, NATIVE, OURS, RAW, THRESHOLD

#: Mode and index of the Gaussian of each measure of error.
MEASURES = [(mode, index) for mode in (RAW, DENOISED) for index in range(len(SIGMAS))]

#: A ratio above this is named as worse than Cycles.
WORSE = 1.0


@dataclass(frozen=True)
class Ratio:
    """Ours over native Cycles' in one file at one setting.

    Attributes
    ----------
    value : float
    file, setting : str
    beyond : bool
        Whether it is an estimate beyond what was measured.
    spread : float or None
        Standard error, if known.
    """

    value: float
    file: str
    setting: str
    beyond: bool = False
    spread: float | None = None

    def __str__(self) -> str:
        spread = "" if self.spread is None else f"±{self.spread:.2f}"
        return f"{'~' if self.beyond else ''}{self.value:.2f}{spread}"


@dataclass(frozen=True)
class Files:
    """Figures of files, by name, as `bench.real_figures.file_figures` returns them."""

    figures: dict[str, dict]

    def settings(self, rule: str = "") -> list[str]:
        """Return the settings that were measured, even samples first, of one rule if it is given."""
        found = {
            setting for each in self.figures.values() for modes in each["measured"].values()
            for settings in modes.values() for setting in settings if setting.startswith(rule)
        }  # fmt: skip
        return sorted(found, key=_order)

    def ratios(self, kind: str, mode: str, index: int, setting: str, way: str = BETTER) -> list[Ratio]:
        """Return what is known of all files at one setting.

        Parameters
        ----------
        kind : str
            ``same_settings`` (errors), ``time_to_error`` or ``equal_time``.
        mode : str
        index : int
            In `SIGMAS`.
        setting : str
        way : str
            Of native Cycles, for ``time_to_error``.
        """
        found = []
        for name, figures in self.figures.items():
            known = figures[kind].get(mode, {}).get(setting)
            if known is None:
                continue
            if kind == "same_settings":
                one = known["errors"][index]
                one = None if one is None else {"value": one, "spread": known["spreads"][index]}
            else:
                one = known[index]
                if kind == "time_to_error":
                    one = (one or {}).get(way)
            if one is not None:
                found.append(Ratio(one["value"], name, setting, one.get("beyond", False), one.get("spread")))
        return found

    def costs(self, cost: str, mode: str, setting: str) -> list[Ratio]:
        """Return ``processor``, ``wall`` or ``bytes_per_pixel`` of all files at the same settings."""
        found = []
        for name, figures in self.figures.items():
            known = figures["same_settings"].get(mode, {}).get(setting)
            if known is not None:
                found.append(Ratio(known[cost], name, setting))
        return found


@dataclass(frozen=True)
class Told:
    """What measurements tell, in the order in which it is read.

    Attributes
    ----------
    summary : str
        Sentences, a line each.
    time : list of Part
        Time to equal error.
    tables : list of Part
        All else.
    how : str
        How it was measured.
    """

    summary: str
    time: list[Part]
    tables: list[Part]
    how: str


def told(figures: dict[str, dict], how: str) -> Told:
    """Return all that figures tell; of Cycles alone if ours was not measured."""
    files = Files(figures)
    if not any(OURS in each["measured"] for each in figures.values()):
        return Told("Cycles alone.", [], [_native_table(files)], how)
    better, *ways = (_overview(files, "time_to_error", caption, way) for caption, way in _WAYS)
    time = [
        Heading("Time to equal error", TIME_TEXT),
        better,
        *(_by_file(files, "time_to_error", *measure) for measure in MAIN),
    ]
    tables = [
        Heading("All figures", "Ours over Cycles': below 1 is better."),
        _goals_table(files),
        *_worse(files),
        *ways,
        *(_by_file(files, "time_to_error", *measure) for measure in _SHOWN if measure not in MAIN),
        Heading("Error at the same settings", SAME_SETTINGS_TEXT),
        _overview(files, "same_settings", "All files, median / worst"),
        *(_by_file(files, "same_settings", *measure) for measure in _SHOWN),
        Heading("Error in the same time", SAME_TIME_TEXT),
        _overview(files, "equal_time", "All files, median / worst"),
        *(_by_file(files, "equal_time", *measure) for measure in _SHOWN),
        Heading("Cost at the same settings", "Ours over Cycles'; memory as the difference in bytes a pixel."),
        _costs_overview(files),
        *(_costs_by_file(files, mode) for mode in (RAW, DENOISED)),
        _native_table(files),
    ]
    return Told(headline(files), time, tables, how)


TIME_TEXT = (
    "Processor time of ours, by its better way (even samples or noise threshold), to the error that Cycles leaves at "
    "each setting, over Cycles' time to it. Between measured settings time and error are interpolated in their "
    "logarithms; ~ marks what lies beyond them; inf: not reached within four times the longest render. Errors are "
    "taken after a Gaussian of sigma pixels, 0 for single pixels: 1 and 2 stand for an eye at some distance."
)

SAME_SETTINGS_TEXT = (
    "Mean square error of ours over Cycles', with the standard error that the errors in squares of the picture tell."
)

SAME_TIME_TEXT = (
    "Ours at each setting over the least that Cycles leaves in the same processor time. Where loading or the denoiser "
    "takes most of it, a little more time is many more samples: small pictures then tell little here."
)

_WAYS = (
    ("Time to equal error, Cycles by its better way for each file, median / worst", BETTER),
    ("Time to equal error, Cycles by even samples only, median / worst", EVEN),
    ("Time to equal error, Cycles by noise thresholds only, median / worst", THRESHOLD),
)

_KINDS = {
    "time_to_error": "Time to equal error",
    "same_settings": "Error at the same settings",
    "equal_time": "Error in the same time",
}

#: Measures that are told first, and all whose figures are shown for each file.
MAIN = ((DENOISED, 0), (RAW, 1))
_SHOWN = (*MAIN, (RAW, 0))

#: Settings at which times to equal error are judged.
_SAMPLES, _THRESHOLDS = ("even 16", "even 64"), ("threshold 0.1", "threshold 0.03")

#: What the issues ask for: a caption, the kind, measures, and settings, all if none is named.
_GOALS: Sequence[tuple[str, str, Sequence[tuple[str, int]], Sequence[str]]] = (
    ("time to equal error, raw, sigma 1, 16 and 64 samples", "time_to_error", [(RAW, 1)], _SAMPLES),
    ("time to equal error, raw, sigma 0, 16 and 64 samples", "time_to_error", [(RAW, 0)], _SAMPLES),
    ("time to equal error, denoised, sigma 0, thresholds .1 and .03", "time_to_error", [(DENOISED, 0)], _THRESHOLDS),
    ("error at 1 sample, all sigmas, raw and denoised", "same_settings", MEASURES, ["even 1"]),
    ("error at 4 samples, all sigmas, raw and denoised", "same_settings", MEASURES, ["even 4"]),
    ("error at the same samples, all sigmas, raw", "same_settings", MEASURES[:3], ["even 1", "even 4", *_SAMPLES]),
    ("error at the same samples, all sigmas, denoised", "same_settings", MEASURES[3:], ["even 1", "even 4", *_SAMPLES]),
    ("error in the same time, all settings and sigmas", "equal_time", MEASURES, ()),
)


def headline(files: Files) -> str:
    """Return what artists want to know first, a sentence a line."""
    lines = []
    for mode, index, setting in ((DENOISED, 0, "threshold 0.1"), (RAW, 1, "even 64"), (RAW, 1, "even 16")):
        if found := files.ratios("time_to_error", mode, index, setting):
            worst = max(found, key=lambda each: each.value)
            at = in_words(setting).replace("threshold", "a noise threshold of")
            lines.append(
                f"Spectral Tiles takes {_median(found):.2f} of Cycles' processor time to a picture as good as Cycles' "
                f"at {at}, {mode} (median of {len(found)} files; worst {worst} in {worst.file})."
            )
    return "\n".join(lines)


def _goals_table(files: Files) -> Table:
    rows = []
    for caption, kind, measures, settings in _GOALS:
        pooled = [
            one
            for measure in measures
            for setting in settings or files.settings()
            for one in files.ratios(kind, *measure, setting)
        ]
        rows += _goal(caption, pooled)
    for cost, caption in (("processor", "processor time"), ("wall", "wall time")):
        for settings, where in ((files.settings()[:1], "at the first setting"), (files.settings(), "at all settings")):
            pooled = [
                one for mode in (RAW, DENOISED) for setting in settings for one in files.costs(cost, mode, setting)
            ]
            rows += _goal(f"{caption} {where}", pooled)
    caption = "Figures to reach, ours over Cycles', at those settings that were measured"
    return Table(caption, ["", "median", "worst", "where"], rows)


def _goal(caption: str, pooled: list[Ratio]) -> list[list[str]]:
    """Return a row, none if nothing was measured."""
    if not pooled:
        return []
    worst = max(pooled, key=lambda each: each.value)
    return [[caption, f"{_median(pooled):.2f}", str(worst), f"{worst.file}, {in_words(worst.setting)}"]]


def _worse(files: Files) -> list[Part]:
    """Return where ours is worse, the worst first."""
    found = []
    # At a threshold more error may be in less time, as far as the threshold allows: only time to equal error counts.
    kinds = (("time_to_error", "time to equal error", ""), ("same_settings", "error at the same samples", EVEN))
    for kind, caption, rule in kinds:
        for mode, index in MEASURES:
            for setting in files.settings(rule):
                ratios = files.ratios(kind, mode, index, setting)
                found += [(one, f"{caption}, {mode}, sigma {SIGMAS[index]}") for one in ratios if one.value > WORSE]
    names = sorted({one.file for one, _ in found})
    rows = []
    for name in names:
        of_file = [(one, what) for one, what in found if one.file == name]
        one, what = max(of_file, key=lambda each: each[0].value)
        rows.append((one.value, [name, str(one), f"{what}, {in_words(one.setting)}", str(len(of_file))]))
    rows = [row for _, row in sorted(rows, key=lambda each: -each[0])]
    if not rows:
        return [Heading("Where ours is worse", "Nowhere.")]
    caption = f"Files with figures above {WORSE:g}, {len(rows)} of {len(files.figures)}"
    return [Heading("Where ours is worse"), Table(caption, ["", "worst", "of what", "figures"], rows)]


def _overview(files: Files, kind: str, caption: str, way: str = BETTER) -> Table:
    settings = files.settings()
    rows = []
    for mode, index in MEASURES:
        cells = [_median_and_worst(files.ratios(kind, mode, index, setting, way)) for setting in settings]
        rows.append([f"{mode}, sigma {SIGMAS[index]}", *cells])
    return Table(caption, _header(settings), rows)


def _by_file(files: Files, kind: str, mode: str, index: int) -> Table:
    columns = {setting: files.ratios(kind, mode, index, setting) for setting in files.settings()}
    return _table_by_file(f"{_KINDS[kind]}: each file, {mode}, sigma {SIGMAS[index]}, worst first", columns)


def _table_by_file(caption: str, columns: dict[str, list[Ratio]]) -> Table:
    names = {one.file for column in columns.values() for one in column}
    rows = []
    for name in sorted(names):
        cells = [next((one for one in column if one.file == name), None) for column in columns.values()]
        worst = max(one.value for one in cells if one is not None)
        rows.append((worst, [name, *("-" if one is None else str(one) for one in cells)]))
    return Table(caption, _header(columns), [row for _, row in sorted(rows, key=lambda each: -each[0])])


def _costs_overview(files: Files) -> Table:
    rows = []
    for cost, caption in (("processor", "processor time"), ("wall", "wall time"), ("bytes_per_pixel", "memory")):
        digits = 0 if cost == "bytes_per_pixel" else 2
        for mode in (RAW, DENOISED):
            cells = [_median_and_worst(files.costs(cost, mode, setting), digits) for setting in files.settings()]
            rows.append([f"{caption}, {mode}", *cells])
    return Table("All files, median / worst", _header(files.settings()), rows)


def _costs_by_file(files: Files, mode: str) -> Table:
    columns = {setting: files.costs("processor", mode, setting) for setting in files.settings()}
    return _table_by_file(f"Processor time: each file, {mode}, worst first", columns)


def _native_table(files: Files) -> Table:
    """Return what Cycles alone takes and leaves."""
    settings = files.settings()
    rows = []
    for name, figures in files.figures.items():
        for mode in (RAW, DENOISED):
            known = figures["measured"].get(NATIVE, {}).get(mode, {})
            cells = []
            for setting in settings:
                one = known.get(setting)
                cells.append(f"{one['processor']:.2f} s {one['errors'][0]:.1e}" if one else "-")
            rows.append([f"{name}, {mode}", *cells, f"{figures['reference_noise'][0]:.1e}"])
    caption = "Cycles alone: processor seconds and mean square error at sigma 0; what noise was taken off the reference"
    return Table(caption, [*_header(settings), "reference"], rows)


def _median(found: Sequence[Ratio]) -> float:
    return statistics.median(one.value for one in found)


def _median_and_worst(found: Sequence[Ratio], digits: int = 2) -> str:
    if not found:
        return "-"
    return f"{_median(found):.{digits}f} / {max(one.value for one in found):.{digits}f}"


def in_words(setting: str) -> str:
    """Return a setting as readers know it."""
    rule, value = setting.split()
    if rule == THRESHOLD:
        return f"threshold {value}"
    return f"{value} sample{'' if value == '1' else 's'}"


def _header(settings: Iterable[str]) -> list[str]:
    return ["", *map(in_words, settings)]


def _order(setting: str) -> tuple[bool, float]:
    """Sort even samples before thresholds, and both from quick to long."""
    rule, value = setting.split()
    return rule == THRESHOLD, float(value) if rule == EVEN else -float(value)
