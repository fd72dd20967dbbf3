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
    """

    def __init__(self, engine, count):
        self.done = 0
        self._engine, self._count = engine, count
        self._told = self._loaded = time.monotonic()

    def step(self):
        """Another one is done; return what to show beside the picture so far, if it is time to, or None."""
        self.done += 1
        now = time.monotonic()
        line = f"Sub-Frame {self.done}/{self._count}"
        if self.done == 1:
            self._loaded = now  # the first one also loads Cycles' kernels
        elif self.done < self._count:
            pace = (now - self._loaded) / (self.done - 1)
            line += f", about {duration((self._count - self.done) * pace)} left"
        # Cycles tells of its own call only, and that it is finished; so each time what is true of all.
        self._engine.update_progress(self.done / self._count)
        self._engine.update_stats("", line)
        if now < self._told + 1.0:
            return None
        self._told = now
        return line


def duration(seconds):
    """A duration in words, to two units at most, such as "1 min 5 s"."""
    minutes, seconds = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    if hours:
        return f"{hours} h {minutes} min"
    return f"{minutes} min {seconds} s" if minutes else f"{seconds} s"
