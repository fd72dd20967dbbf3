# SPDX-License-Identifier: GPL-3.0-or-later
"""Real files at real settings: ours against native Cycles, each render in a fresh process, at equal error and time."""

import json
import os
import platform
from collections.abc import Callable, Sequence
from datetime import date
from pathlib import Path

from bench import real_page
from bench.document import Part
from bench.jobs import blender_version, engine_state
from bench.real_measuring import Effort, Outcome, measure
from bench.real_renders import blend_files
from bench.real_tables import told
from generator.atomic_file import written_whole


def report(
    folder: Path,
    names: Sequence[str],
    effort: Effort,
    json_file: Path | None = None,
    page: Path | None = None,
    experiments: Callable[[Path], Sequence[Part]] = lambda folder: (),
) -> str:
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
    experiments : callable
        From a folder for their pictures to further parts of the page.

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
        with written_whole(json_file) as temporary:
            temporary.write_text(json.dumps({"width": effort.width, "ours": engine_state(), **known}, indent=1))
    if not outcome.figures:
        raise ValueError("\n".join(["no file could be measured", *notes]))
    found = told(outcome.figures, "\n".join([_about(outcome, effort), *notes]))
    parts = [found.summary, *found.time, *found.tables, found.how]
    if page:
        parts.append(f"Page: {real_page.write(page, files, outcome, effort, found, experiments)}")
    return "\n\n".join(map(str, parts))


def _about(outcome: Outcome, effort: Effort) -> str:
    state = "Cycles alone" if effort.native_only else f"state {engine_state()} of ours"
    return (
        f"Blender {blender_version()}, {date.today():%d %B %Y}, {os.cpu_count()} threads: {_processor()}.\n"
        f"Files: {len(outcome.figures)}, {effort.width} px wide; seeds: {effort.seeds}; each timed {effort.repeats}x; "
        f"{state}; nothing is tuned to a file. Errors: mean squares of luminance from 0 to 4, after a Gaussian of "
        "sigma pixels, without the reference's noise. Times: the processor's, of the render alone."
    )


def _processor() -> str:
    """Return the processor's name, where the system tells it."""
    info = Path("/proc/cpuinfo")
    lines = info.read_text().splitlines() if info.is_file() else []
    names = (line.partition(":")[2].strip() for line in lines if line.startswith("model name"))
    return next(names, platform.processor() or platform.machine())
