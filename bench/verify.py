# SPDX-License-Identifier: GPL-3.0-or-later
"""``python -m bench verify``: whether the figures that README and docs/ tell still hold.

Each is an entry of ``docs/measurements.toml``: what it is, the number that is told, the command it came from and the
state of the project then, and a quick form of that command with the interval its figure must lie in.  Documents quote a
number after a mark, ``<!-- figure: NAME -->.75``; `quote` puts them there, so that a figure is changed in one place.
"""

import re
import shlex
import subprocess
import sys
import time
import tomllib
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

from bench.scene_files import ROOT
from bench.table import table
from generator.atomic_file import written_whole

FIGURES = ROOT / "docs" / "measurements.toml"

#: What is told of a figure that nobody has measured yet.
UNKNOWN = "?"

_QUOTED = re.compile(r"(<!-- figure: (\w+) -->)([\d.,]+|\?)?")


@dataclass(frozen=True)
class Figure:
    """A number that documents tell.

    Attributes
    ----------
    name : str
    says : str
        What it is, in words.
    told : str
        The number as documents tell it, `UNKNOWN` before it was measured.
    command, state : str
        What it came from, and when.
    quick : str
        A command of minutes, after ``python -m``.
    find : str
        Pattern of the figure in that command's output, lines by themselves; its first group is the number.
    holds : tuple of float
        Least and most of the quick figure with which the told one is believed.
    """

    name: str
    says: str
    told: str
    command: str
    state: str
    quick: str
    find: str
    holds: tuple[float, float]


def figures(path: Path = FIGURES) -> list[Figure]:
    """Return all figures; raises TypeError where an entry has not exactly what `Figure` has."""
    entries = tomllib.loads(path.read_text(encoding="utf-8"))
    return [Figure(name, **entry | {"holds": tuple(entry["holds"])}) for name, entry in entries.items()]


def documents() -> list[Path]:
    """Return the files that may quote figures."""
    return [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]


def quotes(paths: Iterable[Path]) -> list[tuple[Path, str, str]]:
    """Return file, figure's name and number of each quotation."""
    return [
        (path, name, number) for path in paths for _, name, number in _QUOTED.findall(path.read_text(encoding="utf-8"))
    ]


def misquoted(known: Iterable[Figure], paths: Iterable[Path]) -> list[str]:
    """Return what is wrong with the quotations, a line each: unknown names, and numbers that are not those told."""
    told = {figure.name: figure.told for figure in known}
    return [
        f"{path.name} tells {name} as {number or 'nothing'}, not {told.get(name, 'known')}"
        for path, name, number in quotes(paths)
        if told.get(name) != number
    ]


def quote(known: Iterable[Figure], paths: Iterable[Path]) -> None:
    """Put the numbers told after their marks."""
    told = {figure.name: figure.told for figure in known}
    for path in paths:
        text = path.read_text(encoding="utf-8")
        text = _QUOTED.sub(lambda found: found[1] + told.get(found[2], found[3]), text)
        with written_whole(path) as temporary:
            temporary.write_text(text, encoding="utf-8")


def report(names: Iterable[str], say: Callable[[str], None]) -> str:
    """Measure anew, quickly, and return a table of what holds.

    Parameters
    ----------
    names : iterable of str
        Of figures; all if empty.
    say : callable
        Told of each command.

    Raises
    ------
    ValueError
        If there is no such figure, or some no longer hold; the message is the table.
    """
    known = figures()
    if unknown := set(names) - {figure.name for figure in known}:
        raise ValueError(f"no figure {', '.join(sorted(unknown))}; there are {', '.join(f.name for f in known)}")
    chosen = [figure for figure in known if not names or figure.name in names]
    outputs: dict[str, str] = {}
    rows, failed = [], misquoted(known, documents())
    for figure in chosen:
        if figure.quick not in outputs:
            say(figure.quick)
            outputs[figure.quick] = _output(figure.quick)
        found = re.search(figure.find, outputs[figure.quick], flags=re.M)
        value = float(found[1]) if found else None
        least, most = figure.holds
        holds = value is not None and least <= value <= most
        if figure.told == UNKNOWN:
            failed.append(f"{figure.name} was never measured: {figure.command}")
        elif not holds:
            failed.append(f"{figure.name} does not hold: {figure.says}")
        shown = "not found" if value is None else f"{value:g}"
        rows.append([figure.name, figure.told, shown, f"{least:g} to {most:g}", "yes" if holds else "NO"])
    made = table(["", "told", "now, quickly", "holds from", "holds"], rows)
    if failed:
        raise ValueError("\n".join((made, *failed)))
    return made


def _output(quick: str) -> str:
    begun = time.monotonic()
    done = subprocess.run(
        [sys.executable, "-m", *shlex.split(quick)],
        cwd=ROOT,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    return f"{done.stdout}\nexit code: {done.returncode}\nseconds: {time.monotonic() - begun:.1f}\n"
