# SPDX-License-Identifier: GPL-3.0-or-later
"""The parts of README and docs/ that commands write: what stands between two marks, and pictures."""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from bench.document import Table
from bench.scene_files import ROOT
from generator.atomic_file import written_whole


def write_table(command: str, made: Table) -> None:
    """Renew the table of measurements.md that stands between the marks of a command; raises as `renew`."""
    renew(ROOT / "docs" / "measurements.md", command, f"{made.caption}:\n\n{made.markdown()}")


def renew(page: Path, command: str, text: str) -> None:
    """Renew what stands between the marks of a command in a Markdown file.

    Raises
    ------
    ValueError
        If it has no such marks.
    """
    start, end = f"<!-- python -m bench {command} --docs -->", f"<!-- end of {command} -->"
    before, found, rest = page.read_text(encoding="utf-8").partition(start)
    _, closed, after = rest.partition(end)
    if not (found and closed):
        raise ValueError(f"{page.name} has no marks {start} and {end}")
    with written_whole(page) as temporary:
        temporary.write_text(f"{before}{start}\n{text}\n{end}{after}", encoding="utf-8")


def write_picture(name: str, pixels: np.ndarray) -> None:
    """Write RGB in [0, 1], rows from the top, as a picture of the documentation."""
    # Read back: of a full disk the writer of JPEG says nothing.
    with written_whole(ROOT / "docs" / f"{name}.jpg", plt.imread) as temporary:
        plt.imsave(temporary, np.ascontiguousarray(pixels), pil_kwargs={"quality": 88})
