# SPDX-License-Identifier: GPL-3.0-or-later
"""Printing: progress lines and aligned tables."""

import sys
import time
from collections.abc import Sequence

#: Characters of the progress bar.
_BAR = 20


class Progress:
    """Progress lines on the error stream, with a bar and the time gone by, so that output stays a clean table.

    Parameters
    ----------
    steps : int
        How many lines are to come.
    """

    def __init__(self, steps: int):
        self._steps = steps
        self._done = 0
        self._start = time.monotonic()

    def step(self, text: str) -> None:
        """Announce the next step."""
        self._done += 1
        bar = "#" * (_BAR * (self._done - 1) // self._steps)
        self.say(f"[{bar:.<{_BAR}}] {self._done}/{self._steps} {text}")

    def say(self, text: str) -> None:
        """Print a line that is no step."""
        print(f"{time.monotonic() - self._start:6.0f} s  {text}", file=sys.stderr, flush=True)


def table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return an aligned table: the first column to the left, the others to the right."""
    widths = [max(len(cell) for cell in column) for column in zip(header, *rows, strict=True)]

    def line(cells: Sequence[str]) -> str:
        first, *others = (
            cell.ljust(w) if i == 0 else cell.rjust(w) for i, (cell, w) in enumerate(zip(cells, widths, strict=True))
        )
        return "  ".join((first, *others)).rstrip()

    return "\n".join((line(header), line(["-" * width for width in widths]), *(line(row) for row in rows)))
