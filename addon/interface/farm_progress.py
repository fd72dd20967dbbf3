# SPDX-License-Identifier: GPL-3.0-or-later
"""Lines about how much is done, as Open Job Description has it, so that its runners and a farm's pattern find them.

``openjd_progress: 42`` is in percent; ``openjd_status: frame 3, 2 of 10`` tells what is rendered.
"""

import contextlib
import re

import bpy

from ..plan.patterns import generator_cli

#: The most that is told of what has no file yet, which may still fail.
RENDERED = generator_cli.ProgressBar.MADE


class Percent:
    """Lines for a farm about how much is done, each number once."""

    def __init__(self):
        self._told = -1

    def tell(self, part):
        percent = int(100 * part)
        if percent > self._told:
            self._told = percent
            with contextlib.suppress(OSError):  # whoever read it may be gone
                print(f"openjd_progress: {percent}", flush=True)


class Progress:
    """Lines for a farm about pictures that take equally long, inside a `with` block."""

    def __init__(self, pictures):
        self._pictures = pictures
        self._begun = 0
        self._samples = 0
        self._percent = Percent()

    def __enter__(self):
        bpy.app.handlers.render_stats.append(self._read)
        return self

    def __exit__(self, *exception):
        bpy.app.handlers.render_stats.remove(self._read)
        if exception[0] is None:
            self._percent.tell(1.0)

    def begin(self, name, samples):
        """Start the next picture, of so many samples a pixel."""
        self._begun += 1
        self._samples = samples
        print(f"openjd_status: {name}, {self._begun} of {self._pictures}", flush=True)
        self._tell(0.0)

    def _read(self, stats, *_):
        """Read what the engine says of itself: Cycles of one call, a method that calls it many times of all."""
        if match := re.search(r"Sampling by noise, (\d+)%", stats):
            self._tell(int(match[1]) / 100.0)
        match = re.search(r"(?:Rendered (\d+)/(\d+) Tiles, )?(Sample|Sub-Frame) (\d+)/(\d+)", stats)
        if match and (match[3] != "Sample" or int(match[5]) == self._samples):
            done, tiles = int(match[1] or 0), int(match[2] or 1)
            self._tell(min(1.0, (done + int(match[4]) / int(match[5])) / tiles))

    def _tell(self, part):
        self._percent.tell(min((self._begun - 1 + part) / self._pictures, RENDERED))
