# SPDX-License-Identifier: GPL-3.0-or-later
"""The parts of README that commands write: tables between two marks, and pictures in docs/."""

import matplotlib.pyplot as plt
import numpy as np

from bench.document import Table
from bench.scene_files import ROOT


def write_table(command: str, made: Table) -> None:
    """Renew the table that stands between the marks of a command.

    Raises
    ------
    ValueError
        If README has no such marks.
    """
    readme = ROOT / "README.md"
    start, end = f"<!-- python -m bench {command} --readme -->", f"<!-- end of {command} -->"
    before, found, rest = readme.read_text(encoding="utf-8").partition(start)
    _, closed, after = rest.partition(end)
    if not (found and closed):
        raise ValueError(f"README.md has no marks {start} and {end}")
    readme.write_text(f"{before}{start}\n{made.caption}:\n\n{made.markdown()}\n{end}{after}", encoding="utf-8")


def write_picture(name: str, pixels: np.ndarray) -> None:
    """Write RGB in [0, 1], rows from the top, as a picture of the documentation."""
    plt.imsave(ROOT / "docs" / f"{name}.jpg", np.ascontiguousarray(pixels), pil_kwargs={"quality": 88})
