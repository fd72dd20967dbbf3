# SPDX-License-Identifier: GPL-3.0-or-later
"""Files are written whole or not at all, and what killed runs leave is cleared."""

import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from generator import cli, load_tile
from generator.atomic_file import FOREIGN_AGE, NotWritten, _temporary_name, is_running, would_replace, written_whole

ROOT = Path(__file__).parents[2]
POSIX = pytest.mark.skipif(os.name != "posix", reason="links, permissions and signals of POSIX")


def write(path, text="new", check=None):
    with written_whole(path, check) as temporary:
        temporary.write_text(text)


def names(folder):
    return sorted(entry.name for entry in folder.iterdir())


@pytest.fixture
def old(tmp_path):
    path = tmp_path / "a.json"
    path.write_text("old")
    return path


def test_a_file_appears_whole_with_the_same_ending_in_between(tmp_path):
    with written_whole(tmp_path / "a.exr") as temporary:
        assert temporary.suffix == ".exr" and temporary.parent == tmp_path
        assert f"-{os.getpid()}-" in temporary.name
        temporary.write_text("new")
        assert not (tmp_path / "a.exr").exists()
    assert names(tmp_path) == ["a.exr"] and (tmp_path / "a.exr").read_text() == "new"


@pytest.mark.parametrize("error", [KeyboardInterrupt, RuntimeError, OSError(28, "No space left on device")])
def test_the_old_file_stays_on_any_error(old, error):
    with pytest.raises((KeyboardInterrupt, RuntimeError, NotWritten)) as caught, written_whole(old) as temporary:
        temporary.write_text("half of the n")
        raise error
    assert old.read_text() == "old" and names(old.parent) == ["a.json"]
    if isinstance(error, OSError):
        assert str(caught.value) == f"{old}: not written (No space left on device)"


def test_the_old_file_stays_if_the_new_one_is_empty_gone_or_reads_back_otherwise(old):
    def refuse(path):
        raise ValueError(f"{path}: other pixels")

    with pytest.raises(NotWritten, match=r"a\.json: not written \(read back.*: other pixels\)$"):
        write(old, check=refuse)
    with pytest.raises(NotWritten, match="empty"):
        write(old, "")
    with pytest.raises(NotWritten, match="No such file"), written_whole(old) as temporary:
        temporary.unlink()
    assert old.read_text() == "old" and names(old.parent) == ["a.json"]


@POSIX
def test_nothing_is_written_through_a_link(tmp_path):
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    (elsewhere / "a").write_text("precious")
    for target in ("elsewhere/a", "nowhere"):
        link = tmp_path / "link"
        link.symlink_to(target)
        write(link)
        assert not link.is_symlink() and link.read_text() == "new"
        link.unlink()
    assert (elsewhere / "a").read_text() == "precious" and names(elsewhere) == ["a"]
    # A temporary that gives way to a link is not renamed either.
    with pytest.raises(NotWritten), written_whole(tmp_path / "b") as temporary:
        temporary.unlink()
        temporary.symlink_to(elsewhere / "a")
    assert names(tmp_path) == ["elsewhere"]


@POSIX
def test_permissions_are_those_of_the_old_file_or_the_usual_ones(old):
    old.chmod(0o640)
    write(old)
    write(old.with_name("b"))
    umask = os.umask(0)
    os.umask(umask)
    assert old.stat().st_mode & 0o777 == 0o640
    assert old.with_name("b").stat().st_mode & 0o777 == 0o666 & ~umask


@POSIX
def test_what_is_no_file_is_refused_before_anything_is_done(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "folder").mkdir()
    (tmp_path / "to_folder").symlink_to("folder")
    bad = ["pipe", "folder", "to_folder", "none/a", "folder/", "x" * 300, "pipe/a", "a\0b"]
    before = names(tmp_path)
    for path in [
        *(f"{tmp_path}/{name}" for name in bad),
        "",
        "/dev/null",
        "/dev/stdout",
        "/dev/fd/1",
        "/proc/self/mem",
    ]:
        with pytest.raises((OSError, ValueError)) as caught:
            write(path)
        message = str(caught.value)
        assert len(message) <= 180 and message.isprintable(), path
    assert names(tmp_path) == before


def ended_process():
    """The number of a process that is no more."""
    with subprocess.Popen([sys.executable, "-c", ""]) as process:
        process.wait()
    return process.pid


def test_what_a_killed_run_left_is_cleared_and_nothing_else(tmp_path):
    own = _temporary_name(".npz")
    ours = f"-{os.getpid()}-"
    left = own.replace(ours, f"-{ended_process()}-")
    reused = own  # of an earlier process that had our number
    running = own.replace(ours, f"-{os.getppid()}-")
    machine = own.split("-")[1]
    foreign, old_foreign = (own.replace(machine, other) for other in ("00000001", "00000002"))
    others = [".spectral_tiles-notes.txt", ".a.x.npz", "a.npz", f"{own}.bak", left.replace(".npz", ".~npz.x")]
    for name in (left, reused, running, foreign, old_foreign, *others):
        (tmp_path / name).write_text("half")
    days_ago = time.time() - 2 * FOREIGN_AGE
    os.utime(tmp_path / old_foreign, (days_ago, days_ago))
    with written_whole(tmp_path / "b") as temporary:
        temporary.write_text("new")
        write(tmp_path / "c")  # which leaves the other one's temporary alone
    assert names(tmp_path) == sorted([running, foreign, "b", "c", *others])


def test_running_processes_are_told_from_ended_ones():
    assert is_running(os.getpid()) and is_running(os.getppid())
    assert not is_running(ended_process()) and not is_running(2**40)


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="the table of processes is Linux's")
def test_a_killed_process_that_nobody_has_asked_after_does_not_run(tmp_path):
    with subprocess.Popen(["sleep", "60"]) as process:
        assert is_running(process.pid)
        left = tmp_path / _temporary_name(".npz").replace(f"-{os.getpid()}-", f"-{process.pid}-")
        left.write_text("half")
        process.kill()
        os.waitid(os.P_PID, process.pid, os.WEXITED | os.WNOWAIT)  # ended, but still in the table
        write(tmp_path / "a")
        assert names(tmp_path) == ["a"] and not is_running(process.pid)


@POSIX
def test_what_a_new_file_would_replace_is_told_through_links(tmp_path):
    (tmp_path / "folder").mkdir()
    (tmp_path / "folder/a").write_text("precious")
    for link, target in (("first", "second"), ("second", "folder/a"), ("other", "folder"), ("round", "round")):
        (tmp_path / link).symlink_to(target)
    path = {name: tmp_path / name for name in ("first", "second", "folder/a", "other/a", "round", "b")}
    for new in ("first", "second", "folder/a", "other/a"):
        assert would_replace(path[new], None, "", path["b"], path["first"])
    # What is read through no link stays, if the new file takes the link's place.
    assert not would_replace(path["first"], path["folder/a"]) and not would_replace(path["b"], *list(path.values())[:5])
    assert would_replace(path["round"], path["round"]) and not would_replace(None, path["b"])


def test_of_several_files_none_is_replaced_unless_all_can_be(old):
    (old.parent / "b").mkdir()
    with pytest.raises(OSError, match="b: expected a file"), written_whole(old) as temporary:
        temporary.write_text("new")
        write(old.parent / "b")
    with pytest.raises(NotWritten, match=r"c: not written \(its writer left"), written_whole(old) as temporary:
        temporary.write_text("new")
        write(old.parent / "c", "")
    assert old.read_text() == "old" and names(old.parent) == ["a.json", "b"]


LIMITED = """
import resource, sys
resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv[1]), resource.RLIM_INFINITY))
from generator.cli import main
sys.exit(main(sys.argv[2:]))
"""


def limited(folder, limit, *arguments):
    """Run the command line where no file may be longer than `limit` bytes, as on a full disk."""
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    command = [sys.executable, "-c", LIMITED, str(limit), *arguments]
    return subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, timeout=60)


@POSIX
def test_a_full_disk_keeps_the_old_files_and_ends_with_code_1(tmp_path):
    make = ["make", "--method", "white", "--size", "16"]
    assert cli.main([*make, "--out", str(tmp_path / "tile.npz")]) == 0
    for name in ("a.npz", "a.exr", "a.md", "a.json"):
        (tmp_path / name).write_text("old")
    for limit, arguments in [
        (1000, [*make, "--out", "a.npz"]),
        (1000, [*make, "--out", "a.exr"]),
        (100, ["compare", "tile.npz", "--functions", "2", "--out", "a.md"]),
        (100, ["info", "tile.npz", "--json", "a.json"]),
    ]:
        ended = limited(tmp_path, limit, *arguments)
        assert ended.returncode == 1, ended.stderr
        assert len(ended.stderr.splitlines()) == 1 and "File too large" in ended.stderr
    assert names(tmp_path) == ["a.exr", "a.json", "a.md", "a.npz", "tile.npz"]
    assert all(path.read_text() == "old" for path in tmp_path.glob("a.*"))


@POSIX
def test_full_standard_output_is_code_1_and_one_line(tmp_path):
    assert cli.main(["make", "--method", "white", "--size", "4", "--out", str(tmp_path / "a.npz")]) == 0
    with open("/dev/full", "w") as full:
        command = [sys.executable, "-m", "generator", "info", str(tmp_path / "a.npz")]
        ended = subprocess.run(command, cwd=ROOT, stdout=full, stderr=subprocess.PIPE, text=True, timeout=60)
    assert ended.returncode == 1
    assert ended.stderr == "generator: standard output: not written (No space left on device)\n"


MAKING = """
import sys
from generator.cli import main
print("ready", flush=True)
while True:
    assert main(["make", "--method", "white", "--size", "96", "--seed", "2", *sys.argv[1:]]) == 0
"""


@POSIX
@pytest.mark.parametrize(("ending", "kills"), [("npz", 6), ("exr", 6), pytest.param("npz", 60, marks=pytest.mark.fuzz)])
def test_killed_at_any_moment_make_leaves_a_whole_file(tmp_path, ending, kills):
    moment = random.Random(len(ending) + kills)
    path = tmp_path / f"a.{ending}"
    assert cli.main(["make", "--method", "white", "--size", "96", "--seed", "1", "--out", str(path)]) == 0
    old = load_tile(path).values
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    new = None
    for _ in range(kills):
        command = [sys.executable, "-c", MAKING, "--out", str(path)]
        with subprocess.Popen(command, env=environment, stdout=subprocess.PIPE) as process:
            process.stdout.readline()
            time.sleep(moment.uniform(0, 0.15))
            process.send_signal(signal.SIGKILL)
        values = load_tile(path).values
        if not np.array_equal(values, old):
            new = values if new is None else new
            assert np.array_equal(values, new)
    assert cli.main(["make", "--method", "white", "--size", "96", "--seed", "1", "--out", str(path)]) == 0
    assert np.array_equal(load_tile(path).values, old)
    assert names(tmp_path) == [path.name]
