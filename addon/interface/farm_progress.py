# SPDX-License-Identifier: GPL-3.0-or-later
"""Lines about how much is done, as Open Job Description has it, so that its runners and a farm's pattern find them.

``openjd_progress: 42`` is in percent; ``openjd_status: frame 3, 2 of 10`` tells what is rendered.
"""

from . import picture_files


class Percent:
    """Lines for a farm about how much is done, each number once."""

    def __init__(self):
        self._told = -1

    def tell(self, part):
        percent = int(100 * part)
        if percent > self._told:
            self._told = percent
            print(f"openjd_progress: {percent}", flush=True)


class Progress:
    """Lines for a farm about pictures that take equally long."""

    def __init__(self, pictures):
        self._pictures = pictures
        self._begun = 0
        self._percent = Percent()
        self._reading = picture_files.sample_progress(self._tell)

    def __enter__(self):
        self._reading.__enter__()
        return self

    def __exit__(self, *exception):
        self._reading.__exit__(*exception)
        if exception[0] is None:
            self._tell(1.0)

    def begin(self, name):
        """Start the next picture."""
        self._begun += 1
        print(f"openjd_status: {name}, {self._begun} of {self._pictures}", flush=True)
        self._tell(0.0)

    def _tell(self, part):
        self._percent.tell((self._begun - 1 + part) / self._pictures)
