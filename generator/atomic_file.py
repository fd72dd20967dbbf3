# SPDX-License-Identifier: GPL-3.0-or-later
"""Files that appear whole or not at all, whoever writes them.

As git writes its files: under a temporary name in the same folder, flushed to the disk, looked at, and only then
renamed to the name that was asked for. Until that moment the old file is untouched, so a full disk, an error or a kill
leaves it as it was. Nothing is written through a symbolic link: the link gives way to the file, and what it pointed to
stays.

The temporary's name tells the machine and the process that writes it. A killed process leaves it behind; the next one
that writes into the folder sees that the process is gone and removes it.
"""

import contextlib
import errno
import os
import platform
import re
import secrets
import shutil
import stat
import sys
import threading
import time
import zlib
from pathlib import Path

from .messages import about

FOREIGN_AGE = 24 * 3600.0
"""Seconds after which temporaries of other machines, whose processes cannot be asked for, count as left behind."""

_PREFIX = ".spectral_tiles-"
_NAME = re.compile(re.escape(_PREFIX) + r"([0-9a-f]{8})-([1-9][0-9]{0,9})-[0-9a-f]{8}(\.[^.]{1,15})?")

_MOST_LINKS = 40  # as Linux follows

_being_written = {}
"""Temporaries of this process, paths by their names."""

_making = threading.RLock()
"""Held while a temporary is made, and from `abandon` on by whoever ends the process, so that nobody makes another."""


class NotWritten(OSError):
    """A file could not be written; what was there before is as it was."""


def check_writable(path):
    """Say whether a file can be written, as far as can be told before it is.

    Parameters
    ----------
    path : str or Path

    Returns
    -------
    Path
        The same, from the root, so that a later change of the current folder does not matter. Links are not resolved.

    Raises
    ------
    OSError
        With a message of one line: there is no such folder, it cannot be written to, the name is too long or ends in a
        slash, a folder, device or pipe has it, or a file that may only be read.
    ValueError
        If there is a zero character in the name.
    """
    text = os.fspath(path)
    if "\0" in text:
        raise ValueError(about(text, "expected a file name without zero characters"))
    if not text or text.endswith(("/", os.sep)):
        raise IsADirectoryError(about(text, "expected the name of a file"))
    path = Path(text).absolute()
    if not path.parent.is_dir():
        raise FileNotFoundError(about(text, "no such folder"))
    try:
        found = os.lstat(path)
    except FileNotFoundError:
        found = None
    except OSError as error:
        raise OSError(about(text, f"cannot be written ({error.strerror})")) from error
    if found is not None:
        _check_replaceable(path, text, found)
    if not os.access(path.parent, os.W_OK | os.X_OK):
        raise PermissionError(about(text, "the folder cannot be written to"))
    return path


def _check_replaceable(path, text, found):
    """Raise an OSError unless what has the name already is a file, or a link to one or to nothing."""
    if stat.S_ISLNK(found.st_mode):
        if os.readlink(path).startswith("/proc/"):  # such as /dev/stdout
            raise OSError(about(text, "expected a file, got a link into /proc"))
        try:
            found = os.stat(path)
        except OSError:  # it points nowhere
            return
    elif stat.S_ISREG(found.st_mode) and not os.access(path, os.W_OK):
        raise PermissionError(about(text, "the file may only be read"))
    if stat.S_ISDIR(found.st_mode):
        raise IsADirectoryError(about(text, "expected a file, got a folder"))
    if not stat.S_ISREG(found.st_mode):
        raise OSError(about(text, "expected a file, got a device or a pipe"))


@contextlib.contextmanager
def written_whole(path, check=None):
    """Give a temporary path to write to; when the block ends well, that file is at `path`, whole.

    The temporary path exists already, as an empty file beside `path`, and has the same ending, because image libraries
    choose the format by it. Write to it in any way that ends before the block does. On any error or interrupt, in the
    block or after it, the temporary is removed and the file that was at `path` stays. A new file has the usual
    permissions, one that takes another's place those of the other.

    Parameters
    ----------
    path : str or Path
    check : callable, optional
        Is given the temporary path of the finished file, to read it back; raises a ValueError or an OSError if it is
        not as it should be. That it is a file, is not empty and is on the disk is seen to in any case.

    Yields
    ------
    Path

    Raises
    ------
    NotWritten
        If the file could not be written or is not as it should be; the message is one line that begins with `path`.
        Every other OSError in the block becomes one.
    OSError, ValueError
        If nothing has been tried yet, see `check_writable`.

    Examples
    --------
    >>> with written_whole("report.json") as temporary:  # doctest: +SKIP
    ...     temporary.write_text("{}")
    """
    given, path = os.fspath(path), check_writable(path)
    clear_left_behind(path.parent)
    temporary = path.with_name(_temporary_name(path.suffix))
    try:
        with _making:
            _being_written[temporary.name] = temporary
            os.close(os.open(temporary, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o666))
        yield temporary
        _flush(temporary)
        if check is not None:
            _read_back(temporary, check)
        if path.is_file() and not path.is_symlink():
            os.chmod(temporary, stat.S_IMODE(os.stat(path).st_mode) & 0o777)
        os.replace(temporary, path)
        _flush_folder(path.parent)
    except NotWritten:  # another one in the block
        raise
    except OSError as error:
        raise NotWritten(about(given, f"not written ({_reason(error, temporary)})")) from error
    finally:
        with contextlib.suppress(OSError):
            temporary.unlink(missing_ok=True)
        _being_written.pop(temporary.name, None)


@contextlib.contextmanager
def unfinished_folder(folder):
    """Give a temporary folder inside `folder`, for writers that choose names by themselves; it is gone afterwards.

    What is whole in there can be moved to its place inside a block of `written_whole`.

    Parameters
    ----------
    folder : str or Path

    Yields
    ------
    Path

    Raises
    ------
    NotWritten
        If it cannot be made.
    """
    clear_left_behind(folder)
    temporary = Path(folder).absolute() / _temporary_name("")
    try:
        with _making:
            _being_written[temporary.name] = temporary
            temporary.mkdir()
        yield temporary
    except OSError as error:
        if error.filename is None or os.fspath(error.filename) != os.fspath(temporary):
            raise
        raise NotWritten(about(folder, f"cannot be written to ({error.strerror})")) from error
    finally:
        shutil.rmtree(temporary, ignore_errors=True)
        _being_written.pop(temporary.name, None)


def abandon():
    """Remove all temporaries of this process, which is about to end without leaving its blocks.

    Other threads that would make another one wait for its end.
    """
    _making.acquire()
    for temporary in list(_being_written.values()):
        _remove(temporary)


def _remove(temporary):
    """Remove a temporary, file or folder, without an error."""
    if temporary.is_dir() and not temporary.is_symlink():
        shutil.rmtree(temporary, ignore_errors=True)
    else:
        with contextlib.suppress(OSError):
            temporary.unlink(missing_ok=True)


def _reason(error, temporary):
    """Return what went wrong in words, without the temporary's name, which says nothing to anybody."""
    if error.strerror is None:
        return str(error) or type(error).__name__
    others = error.filename is not None and os.fspath(error.filename) != os.fspath(temporary)
    return f"{error.filename}: {error.strerror}" if others else error.strerror


def _read_back(temporary, check):
    try:
        check(temporary)
    except ValueError as error:
        said = str(error).removeprefix(f"{temporary}: ")
        raise OSError(f"read back, it is not what was written: {said}") from error


def _flush(path):
    """Wait until a file's content is on the disk; a disk that is full says so here at the latest."""
    found = os.lstat(path)
    if not stat.S_ISREG(found.st_mode) or not found.st_size:
        raise OSError("its writer left it empty")
    handle = os.open(path, os.O_RDWR | getattr(os, "O_NOFOLLOW", 0))
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def _flush_folder(folder):
    """Wait until a folder's names are on the disk, where the system lets one."""
    with contextlib.suppress(OSError):
        handle = os.open(folder, os.O_RDONLY | getattr(os, "O_DIRECTORY", 0))
        try:
            os.fsync(handle)
        finally:
            os.close(handle)


def _temporary_name(suffix):
    suffix = suffix if 1 < len(os.fsencode(suffix)) <= 16 else ""
    return f"{_PREFIX}{_machine()}-{os.getpid()}-{secrets.token_hex(4)}{suffix}"


def _machine():
    """Return a word for the machine, or the container in it, in which a process's number has its meaning."""
    parts = [platform.node()]
    with contextlib.suppress(OSError):
        parts.append(Path("/etc/machine-id").read_text(encoding="ascii", errors="replace"))
    with contextlib.suppress(OSError):
        parts.append(str(os.stat("/proc/self/ns/pid").st_ino))
    return f"{zlib.crc32(' '.join(parts).encode(errors='replace')):08x}"


def clear_left_behind(folder):
    """Remove the temporaries of this module in a folder whose writers are gone.

    Parameters
    ----------
    folder : str or Path
        What cannot be listed or removed is left alone.

    Returns
    -------
    list of str
        Names of what was removed.
    """
    removed = []
    with contextlib.suppress(OSError), os.scandir(folder) as entries:
        for entry in entries:
            match = _NAME.fullmatch(entry.name)
            with contextlib.suppress(OSError):
                if match and not entry.is_symlink() and _is_left_behind(entry, *match.groups()[:2]):
                    _remove(Path(entry.path))
                    removed.append(entry.name)
    return removed


def _is_left_behind(entry, machine, process):
    if machine != _machine():
        return time.time() - entry.stat(follow_symlinks=False).st_mtime > FOREIGN_AGE
    if int(process) == os.getpid():  # that of an earlier process with the same number, as in containers, is not ours
        return entry.name not in _being_written
    return not is_running(int(process))


def is_running(process):
    """Return whether there is a process of this number on this machine."""
    if sys.platform == "win32":  # where os.kill with signal 0 would end it
        from ctypes import windll

        handle = windll.kernel32.OpenProcess(0x00101000, False, process)  # to wait for it and to ask about it
        if not handle:
            return windll.kernel32.GetLastError() == 5  # it is there, but somebody else's
        waited = windll.kernel32.WaitForSingleObject(handle, 0)
        windll.kernel32.CloseHandle(handle)
        return waited == 0x102  # it has not ended
    try:
        os.kill(process, 0)
    except (ProcessLookupError, OverflowError):
        return False
    except OSError as error:
        return error.errno == errno.EPERM
    # One that has ended keeps its number until whoever started it asks how: Z in Linux's table (proc(5)).
    with contextlib.suppress(OSError):
        return Path(f"/proc/{process}/stat").read_bytes().rpartition(b")")[2].split()[0] not in (b"Z", b"X")
    return True


def would_replace(path, *others):
    """Return whether a new file at `path` would take the place of one of others, or of a link that leads to it.

    Parameters
    ----------
    path : str or Path or None
    *others : str or Path or None
        None and an empty name are no file.
    """
    place = path and _place(path)
    return bool(place) and any(place in _way(other) for other in others if other)


def _way(path):
    """Yield the places of the links that lead to a file, and that of the file."""
    for _ in range(_MOST_LINKS):
        place = _place(path)
        yield place
        if not os.path.islink(place):
            return
        path = os.path.join(os.path.dirname(place), os.readlink(place))


def _place(path):
    """Return where a file of this name is put: folders may be links, but a link itself gives way to it."""
    folder, name = os.path.split(os.path.abspath(path))
    return os.path.join(os.path.realpath(folder), name)
