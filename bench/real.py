# SPDX-License-Identifier: GPL-3.0-or-later
"""Real files at real settings: ours against native Cycles, each render in a fresh process, at equal error and time."""

import json
from collections.abc import Sequence
from pathlib import Path

from bench import real_page
from bench.jobs import engine_state
from bench.real_measuring import Effort, Outcome, measure
from bench.real_renders import blend_files
from bench.real_tables import parts


def report(folder: Path, names: Sequence[str], effort: Effort, json_file: Path | None, page: Path | None) -> str:
    """Measure the .blend files of a folder and return the tables.

    Parameters
    ----------
    folder : Path
    names : sequence of str
        Of files in it, all if empty.
    effort : Effort
    json_file : Path or None
        Receives all figures.
    page : Path or None
        Folder of a page with crops.

    Raises
    ------
    ValueError
        There are no such files, or none of them could be measured.
    """
    files = blend_files(folder, names)
    outcome = measure(files, effort)
    notes = [f"Left out: {name}: {reason}" for name, reason in outcome.left_out.items()]
    notes += [f"Fault: {fault}" for fault in outcome.faults]
    if json_file:
        json_file.parent.mkdir(parents=True, exist_ok=True)
        known = {"files": outcome.figures, "left_out": outcome.left_out, "faults": outcome.faults}
        json_file.write_text(json.dumps({"width": effort.width, "ours": engine_state(), **known}, indent=1))
    if not outcome.figures:
        raise ValueError("\n".join(["no file could be measured", *notes]))
    made = parts(outcome.figures)
    about = _about(outcome, effort)
    if page:
        notes.append(f"Page: {real_page.write(page, files, outcome, effort, about, made)}")
    return "\n\n".join([about, *map(str, made), *notes])


def _about(outcome: Outcome, effort: Effort) -> str:
    state = "Cycles alone" if effort.native_only else f"state {engine_state()} of ours"
    return (
        f"{len(outcome.figures)} files, {effort.width} px wide, {effort.seeds} seeds, timed {effort.repeats} times, "
        f"{state}. Errors: mean squares of luminance from 0 to 4, after a Gaussian of sigma pixels, without the "
        "reference's noise. Times: the processor's, of the render alone."
    )
