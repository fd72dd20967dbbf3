# SPDX-License-Identifier: GPL-3.0-or-later
"""How far a render of many calls of Cycles is, and how long the rest of it takes."""

import time


class Progress:
    """Tells the user how far an engine's calls of Cycles are.

    Parameters
    ----------
    engine : bpy.types.RenderEngine
    count : int
        Calls that the picture takes.
    then : str
        What takes time after all of them, if anything does.

    Attributes
    ----------
    line : str
        What to show beside the picture so far.
    """

    def __init__(self, engine, count, then=""):
        self._done, self.line = 0, ""
        self._engine, self._count, self._then = engine, count, then
        self._shown = self._loaded = time.monotonic()

    def step(self):
        """Another one is done."""
        self._done += 1
        now = time.monotonic()
        self.line = f"Sub-Frame {self._done}/{self._count}"
        if self._done == 1:
            self._loaded = now  # the first one also loads Cycles' kernels
        elif self._done < self._count:
            pace = (now - self._loaded) / (self._done - 1)
            self.line += f", about {duration((self._count - self._done) * pace)} left"
            self.line += f", then {self._then}" if self._then else ""
        self.tell()
        self._engine.update_stats("", self.line)

    def tell(self):
        """Tell how much of all calls is done, in whose place Cycles tells of its own one only."""
        self._engine.update_progress(self._done / self._count)

    def is_due(self):
        """Whether it is time to show the picture so far, which this is taken for."""
        now = time.monotonic()
        if now < self._shown + 1.0:
            return False
        self._shown = now
        return True


def duration(seconds):
    """A duration in words, to two units at most, such as "1 min 5 s"."""
    minutes, seconds = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    if hours:
        return f"{hours} h {minutes} min"
    return f"{minutes} min {seconds} s" if minutes else f"{seconds} s"
