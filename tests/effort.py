# SPDX-License-Identifier: GPL-3.0-or-later
"""What a piece of work takes."""

import contextlib
import time
from pathlib import Path

_STATUS, _RESET = Path("/proc/self/status"), Path("/proc/self/clear_refs")


def _bytes(name):
    lines = dict(line.split(":", 1) for line in _STATUS.read_text().splitlines())
    return int(lines[name].split()[0]) * 1024


@contextlib.contextmanager
def within(seconds, memory):
    """Fail if the block takes more of the processor's seconds, or of memory in bytes where Linux tells that.

    Not seconds of the clock, since other tests run beside this one.
    """
    begun = time.process_time()
    measured = _RESET.exists()
    if measured:
        _RESET.write_text("5")  # the most so far is what there is now (proc(5))
        before = _bytes("VmRSS")
    yield
    taken = time.process_time() - begun
    assert taken < seconds, f"{taken:.1f} s"
    grown = _bytes("VmHWM") - before if measured else 0
    assert grown < memory, f"{grown / 1e6:.0f} MB"
