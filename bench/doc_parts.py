# SPDX-License-Identifier: GPL-3.0-or-later
"""The parts of docs/ that commands write: tables between two marks in measurements.md, and pictures."""

import matplotlib.pyplot as plt
import numpy as np

from bench.document import Table
from bench.scene_files import ROOT


def write_table(command: str, made: Table) -> None:
    """Renew the table that stands between the marks of a command.

    Raises
    ------
    ValueError
        If it has no such marks.
    """
    page = ROOT / "docs" / "measurements.md"
    start, end = f"<!-- python -m bench {command} --docs -->", f"<!-- end of {command} -->"
    before, found, rest = page.read_text(encoding="utf-8").partition(start)
    _, closed, after = rest.partition(end)
    if not (found and closed):
        raise ValueError(f"{page.name} has no marks {start} and {end}")
    page.write_text(f"{before}{start}\n{made.caption}:\n\n{made.markdown()}\n{end}{after}", encoding="utf-8")


def write_picture(name: str, pixels: np.ndarray) -> None:
    """Write RGB in [0, 1], rows from the top, as a picture of the documentation."""
    plt.imsave(ROOT / "docs" / f"{name}.jpg", np.ascontiguousarray(pixels), pil_kwargs={"quality": 88})
