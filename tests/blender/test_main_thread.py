# SPDX-License-Identifier: GPL-3.0-or-later
"""Calls out of a render's thread; the test is the main thread, as which it serves them."""

import threading
import time
import weakref
from types import SimpleNamespace

import pytest

pytest.importorskip("bpy")

from addon.blender import main_thread

GOING_ON = SimpleNamespace(test_break=lambda: False)
CANCELLED = SimpleNamespace(test_break=lambda: True)


def in_thread(function, engine, serve):
    """Threads that called the function, and what its caller got to see of its errors."""
    callers, errors = [], []

    def called():
        callers.append(threading.current_thread())
        function()

    def render():
        try:
            main_thread.run(called, engine)
        except ValueError as error:
            errors.append(error)

    thread = threading.Thread(target=render)
    thread.start()
    end = time.monotonic() + 10.0
    while thread.is_alive() and time.monotonic() < end:
        if serve:
            main_thread._serve()
    thread.join(1.0)
    assert not thread.is_alive()
    return callers, errors


def test_call_is_made_by_the_main_thread():
    callers, errors = in_thread(lambda: None, GOING_ON, serve=True)
    assert callers == [threading.main_thread()]
    assert not errors


def test_caller_gets_the_error():
    def fail():
        raise ValueError

    _, errors = in_thread(fail, GOING_ON, serve=True)
    assert len(errors) == 1


def test_cancelled_render_does_not_wait_for_a_busy_main_thread():
    callers, _ = in_thread(lambda: None, CANCELLED, serve=False)
    assert len(callers) == 1
    assert callers != [threading.main_thread()]
    main_thread._serve()  # not called twice
    assert len(callers) == 1


def test_main_thread_calls_at_once():
    callers = []
    main_thread.run(lambda: callers.append(threading.current_thread()), GOING_ON)
    assert callers == [threading.main_thread()]


def test_main_thread_tells_while_it_is_wanted():
    told = []
    main_thread._serve()
    with main_thread.telling(lambda: told.append(threading.current_thread())):
        main_thread._serve()
    main_thread._serve()
    assert told == [threading.main_thread()]


class Render:
    """What must be gone when it is over."""

    def call(self):
        pass


@pytest.mark.parametrize(("engine", "serve"), [(GOING_ON, True), (CANCELLED, False)])
def test_a_render_that_is_over_is_not_held(engine, serve):
    """Neither by those that tell of it, nor by what it wanted and the main thread has not looked at."""
    render, left = Render(), []
    seen = weakref.ref(render)

    def job(render):
        with main_thread.telling(render.call):
            main_thread.run(render.call, engine)
            main_thread.run(lambda: None, engine)

    def work(held):
        job(held.pop())
        left.append(seen())

    thread = threading.Thread(target=work, args=([render],))
    del render
    thread.start()
    while thread.is_alive():
        if serve:
            main_thread._serve()
    main_thread._serve()
    assert left == [None]
