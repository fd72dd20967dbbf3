# SPDX-License-Identifier: GPL-3.0-or-later
"""Ctrl-C on the command line, and what it must not leave behind.

While Cycles renders no Python runs in the main thread, so neither would Python's handler of signals; and where one runs
inside the engine, an exception would go through Blender, which does not survive it.  So a thread waits for the signal,
and ends the process.
"""

import contextlib
import os
import shutil
import signal
import sys
import threading

import bpy

#: Sent by Ctrl-C, and by farms that cancel a task.
SIGNALS = (signal.SIGINT, signal.SIGTERM)


@contextlib.contextmanager
def ends_with(finish):
    """Inside a `with` block of the main thread, Ctrl-C ends the process at once.

    Parameters
    ----------
    finish : callable
        Called in the end, in another thread, also to remove what is unfinished; returns the exit code, or None if the
        block is ending by itself.
    """
    told, tell = os.pipe()
    os.set_blocking(tell, False)
    before = {number: signal.signal(number, lambda *_: None) for number in SIGNALS}
    wakeup = signal.set_wakeup_fd(tell, warn_on_full_buffer=False)

    def wait():
        # At the end of the block there is nothing more to read.
        while number := os.read(told, 1):
            if number[0] in SIGNALS:
                _end(finish)

    waiting = threading.Thread(target=wait, name="Ctrl-C", daemon=True)
    waiting.start()
    try:
        yield
    finally:
        signal.set_wakeup_fd(wakeup)
        for number, handler in before.items():
            # None is a handler that Python does not know, such as Blender's.
            signal.signal(number, signal.SIG_DFL if handler is None else handler)
        os.close(tell)
        waiting.join()
        os.close(told)


def _end(finish):
    code = 1
    try:
        code = finish()
        if code is not None:
            shutil.rmtree(bpy.app.tempdir, ignore_errors=True)
            sys.stdout.flush()
            sys.stderr.flush()
    finally:
        if code is not None:
            os._exit(code)
