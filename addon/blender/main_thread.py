# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes to Blender's data, out of a render that a window runs in a thread of its own.

Each assignment to a property tells the window to redraw, through a queue that is not made for two threads: thousands of
them from a render's thread break it sooner or later, and Blender hangs.  So the main thread makes them, between its
events, and the render's thread waits for that.
"""

import concurrent.futures
import contextlib
import queue
import threading
import time

import bpy

# Seconds from one look for callers to the next if there was none, and between a caller's looks at whether it is still
# to wait.
_PAUSE = 0.02

# Seconds that the window does nothing else when callers follow each other: it redraws after each turn.
_TURN = 0.1

_calls = queue.SimpleQueue()
_is_served = False

# What a render wants done between the window's events.
_tellers = []
_telling = threading.Lock()


def run(function, engine):
    """Call a function in the main thread, and wait until it is done.

    Parameters
    ----------
    function : callable
    engine : bpy.types.RenderEngine
        If the user cancels its render, the main thread may be waiting for its end: the function is called here then.
        So it is when the extension was disabled, and nobody serves the queue.

    Raises
    ------
    Exception
        What the function raises.
    """
    if threading.current_thread() is threading.main_thread():
        function()
        return
    made = concurrent.futures.Future()
    made.call = function
    _calls.put(made)
    while not concurrent.futures.wait([made], _PAUSE).done:
        if (not _is_served or engine.test_break()) and made.cancel():
            del made.call
            function()
            return
    made.result()


@contextlib.contextmanager
def telling(tell):
    """Inside a `with` block of a render's thread, call `tell()` again and again in the main thread.

    It must not wait for anything, nor assign to properties.
    """
    with _telling:
        _tellers.append(tell)
    try:
        yield
    finally:
        with _telling:
            _tellers.remove(tell)


def _serve():
    """Timer of the main thread: run what is waiting, and what follows soon; return in how long to look again."""
    _tell()
    if _calls.empty():
        return _PAUSE
    end = time.monotonic() + _TURN
    with contextlib.suppress(queue.Empty):
        while (left := end - time.monotonic()) > 0.0:
            _answer(_calls.get(timeout=left))
    return 0.0


def _tell():
    """Tell for all, and hold nothing of a render then: Cycles frees its session only if nobody else has the engine."""
    with _telling:
        for tell in _tellers:
            tell()


def _answer(made):
    """Call a function for its caller, unless that has done so itself."""
    if made.set_running_or_notify_cancel():
        try:
            made.call()
        except Exception as error:
            made.set_exception(error)
        else:
            del made.call
            made.set_result(None)


def register():
    global _is_served
    _is_served = True
    bpy.app.timers.register(_serve, persistent=True)


def unregister():
    global _is_served
    _is_served = False
    bpy.app.timers.unregister(_serve)
