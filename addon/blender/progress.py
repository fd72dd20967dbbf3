# SPDX-License-Identifier: GPL-3.0-or-later
"""How far a render of many sub-renders is, and how long the rest of it takes."""

import time

# Seconds that a sub-render takes at least: 1.8 to 2.6 ms were measured in a scene of a few objects at 32 x 32 pixels.
LEAST = 0.002


class Progress:
    """Tells the user how far an engine's sub-renders are.

    Parameters
    ----------
    engine : bpy.types.RenderEngine
    count : int
        Sub-renders of the picture.

    Attributes
    ----------
    pace : float or None
        Seconds that a sub-render took in this process's last picture; None before the first.
    """

    pace = None

    def __init__(self, engine, count):
        self.done = 0
        self._engine = engine
        self._count = count
        self._told = self._loaded = time.monotonic()

    def expect(self, count):
        """So many more are to come."""
        self._count = self.done + count

    def step(self):
        """Another one is done; return what to tell the user, if it is time to, or None."""
        self.done += 1
        now = time.monotonic()
        self._engine.update_progress(self.done / self._count)
        if self.done == 1:
            self._loaded = now  # the first one also brings the scene into Cycles
            return None
        Progress.pace = (now - self._loaded) / (self.done - 1)
        if now < self._told + 1.0:
            return None
        self._told = now
        left = duration((self._count - self.done) * Progress.pace)
        line = f"Sub-render {self.done} of {self._count}, about {left} left"
        self._engine.update_stats("", line)
        return line


def duration(seconds):
    """A duration in words, to two units at most, such as "1 min 5 s"."""
    minutes, seconds = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    if hours:
        return f"{hours} h {minutes} min"
    return f"{minutes} min {seconds} s" if minutes else f"{seconds} s"
