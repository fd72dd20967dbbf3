"""A progress bar with an estimate of the time left."""

import time


def part_of(progress, index, count):
    """Return what reports the progress of one of `count` equal parts as that of the whole; None if `progress` is."""
    return progress and (lambda done, total: progress(index * total + done, count * total))


class ProgressBar:
    """Writes one line that overwrites itself; calling the object moves the bar.

    Where the stream is no terminal, as on a farm, it writes a line of its own every `PATIENCE` seconds instead, unless
    somebody else is told.

    Parameters
    ----------
    stream : text file
    interval : float
        Seconds between two updates in a terminal.
    tell : callable, optional
        Is given the part that is done, 0 to 1, at every call; 1 only when nothing can fail any more.
    """

    WIDTH = 30
    MADE = 0.99  # the most that is told before there is a file
    PATIENCE = 10.0

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
            self.tell(min(done / total, self.MADE))
        now = time.monotonic()
        if not self.stream.isatty():
            if self.tell is None and now - self._shown >= self.PATIENCE:
                self._shown = now
                self.stream.write(f"generator: {self.reached()}\n")
                self.stream.flush()
            return
        if now - self._shown >= self.interval or done == total:
            self._shown = now
            filled = self.WIDTH * done // total
            left = (now - self._start) * (total - done) / max(done, 1)
            bar = "#" * filled + "-" * (self.WIDTH - filled)
            self.stream.write(f"\r[{bar}] {100 * done // total:3d} %, {left:.0f} s left ")
            self.stream.write("\n" if done == total else "")
            self.stream.flush()

    def finish(self):
        """Record that what was made is in its file."""
        if self.tell is not None and self.done:
            self.tell(1.0)

    def reached(self):
        """Say how far it got, such as ``at 45 % (900 of 2000 steps) after 12 s``."""
        elapsed = time.monotonic() - self._start
        return f"at {100 * self.done // self.total} % ({self.done} of {self.total} steps) after {elapsed:.0f} s"
