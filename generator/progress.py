"""A progress bar with an estimate of the time left."""

import time


class ProgressBar:
    """Writes one line that overwrites itself; calling the object moves the bar.

    Parameters
    ----------
    stream : text file
        Where to write; nothing is written unless it is a terminal.
    interval : float
        Seconds between two updates.
    tell : callable, optional
        Is given the part that is done, 0 to 1, at every call.
    """

    WIDTH = 30

    def __init__(self, stream, interval=0.2, tell=None):
        self.stream = stream
        self.interval = interval
        self.tell = tell
        self.done, self.total = 0, 1
        self._start = self._shown = time.monotonic()

    def __call__(self, done, total):
        """Record that `done` of `total` steps are made."""
        self.done, self.total = done, total
        if self.tell is not None:
            self.tell(done / total)
        now = time.monotonic()
        if self.stream.isatty() and (now - self._shown >= self.interval or done == total):
            self._shown = now
            filled = self.WIDTH * done // total
            left = (now - self._start) * (total - done) / max(done, 1)
            bar = "#" * filled + "-" * (self.WIDTH - filled)
            self.stream.write(f"\r[{bar}] {100 * done // total:3d} %, {left:.0f} s left ")
            self.stream.write("\n" if done == total else "")
            self.stream.flush()

    def reached(self):
        """Say how far it got, such as ``at 45 % (900 of 2000 steps) after 12 s``."""
        elapsed = time.monotonic() - self._start
        return f"at {100 * self.done // self.total} % ({self.done} of {self.total} steps) after {elapsed:.0f} s"
