# SPDX-License-Identifier: GPL-3.0-or-later
"""Messages of one line: whatever a file or a user has put into them, they stay short and printable."""

LONGEST = 180
"""Characters of a message, at most; 200 with the name of the program that says it."""

_GAP = " ... "


def _printable(text):
    """Return `text` with every run of white space as one space and every other unprintable character escaped."""
    return "".join(c if c.isprintable() else ascii(c)[1:-1] for c in " ".join(text.split()))


def one_line(text, longest=LONGEST):
    """Return `text` as one printable line.

    Parameters
    ----------
    text : object
        Anything that `str` takes.
    longest : int
        Characters that are kept, at least 10. Of a longer text the beginning and the end are, with dots between.

    Returns
    -------
    str
    """
    text = str(text)
    if len(text) > 4 * longest:  # cleaning megabytes would take its time, too
        text = text[: 2 * longest] + text[-2 * longest :]
        line = _printable(text).ljust(longest + 1, ".")
    else:
        line = _printable(text)
    if len(line) <= longest:
        return line
    head = (longest - len(_GAP)) // 2
    return line[:head] + _GAP + line[len(line) - (longest - len(_GAP) - head) :]


def quoted(value, longest=40):
    """Return ``repr(value)``, or the beginning and the end of it, as a part of a message."""
    if isinstance(value, str | bytes) and len(value) > 4 * longest:
        value = value[: 2 * longest] + value[-2 * longest :]
    return one_line(repr(value), longest)


def about(path, reason):
    """Return ``path: reason`` as one line of at most `LONGEST` characters; the path is shortened first."""
    reason = one_line(reason, LONGEST - 42)
    return f"{one_line(path, LONGEST - 2 - len(reason))}: {reason}"
