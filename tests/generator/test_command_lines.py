# SPDX-License-Identifier: GPL-3.0-or-later
"""Whatever is typed ends soon, in one line where it is refused, and touches nothing else."""

import os
import random
import tracemalloc

import pytest

from generator import cli
from tests import effort

MAKE = ["make", "--method", "white", "--size", "4", "--out", "new.npz"]
TEST = ["test", "a.npz", "--functions", "2"]

BEYOND = [
    "0",
    "-1",
    "1000000000",
    "1e9",
    "9" * 5000,
    "1.5",
    "nan",
    "",
    " ",
    "x" * 100_000,
    "\x1b[31m",
    "\n",
    "٣" * 11,
]
NUMBERS = ["--size", "--samples", "--frames", "--steps", "--candidates", "--secondary"]
STRANGE = ["", ",", "=", "t=", "=1", "t=nan", "t=inf", "t=-1", "t=1e300", "lens+t=1", "\0", "t,t", "🎲", "x" * 100_000]
NO_FILES = ["", ".", "/", "..", "none/new.npz", "a\0b.npz", "x" * 300 + ".npz", "/dev/null", "/dev/stdin", "pipe.npz",
            "folder.npz", "folder/", "a.npz/b.npz", "new", "new.png", "new.npz.", ".npz/", "\n.npy"]  # fmt: skip

REFUSED = [
    *([*MAKE, option, value] for option in NUMBERS for value in BEYOND),
    *([*MAKE, "--seed", value] for value in ["4294967296", *BEYOND] if value not in ("0", "1000000000")),
    *([*TEST, "--functions", value] for value in BEYOND),
    *(["make", "--size", "4", "--steps", "2", "--out", "new.npz", "--weights", value] for value in STRANGE),
    *(["make", "--size", "4", "--steps", "2", "--out", "new.npz", "--scales", value] for value in STRANGE),
    *([*MAKE, "--dims", value] for value in STRANGE),
    *([*TEST, "--sigmas", value] for value in [*STRANGE, "-1", "1e9", ",".join("1" * 17), "1e-400,inf"]),
    *([*TEST, "--layers", value] for value in [*STRANGE, "0", "1,0", "-1,0", "0,1000000000", "9" * 5000 + ",1"]),
    *([*MAKE, "--out", value] for value in NO_FILES),
    *([command, value] for command in ("info", "test", "analyse", "plot") for value in NO_FILES),
    *(["compare", "a.npz", f"b={value}"] for value in NO_FILES),
    *(["compare", "a.npz", "--out", value] for value in ("", ".", "none/a.md", "/dev/null", "a.npz", "pipe.npz")),
    *(["info", "a.npz", "--json", value] for value in ("", ".", "none/a.json", "/dev/full", "a.npz", "pipe.npz")),
    *(["library", "--out", "new", "--only", value] for value in ("x", ",", "motion-1,x", "\0", "x" * 100_000)),
    [*MAKE, "--json", "new.npz"],
    [*MAKE, "--json", "./new.npz"],
    [*MAKE, "--size", "4096", "--samples", "2"],
    [*MAKE, "--size", "4096", "--method", "spectral"],
    [*MAKE, "--size", "128", "--method", "spectral", "--frames", "256", "--dims", "t,lens.u,lens.v,light.u,light.v"],
    [*MAKE, "--size", "64", "--method", "spectral", "--frames", "65"],
    [*MAKE, "--method", "joint-scanning", "--candidates", "10000", "--samples", "64"],
    [*MAKE, "--method", "scanning", "--secondary", "101"],
    [*MAKE, "--method", "film-positions", "--dims", "film.x,film.y", "--candidates", "10000", "--samples", "1024"],
    [*MAKE, "--method", "cook", "--samples", "2"],
    [*MAKE, "--method", "x" * 100_000],
    [*MAKE, *("x" * 1000 for _ in range(1000))],
    ["compare", *["a.npz"] * 2],
    ["compare", *(f"{index}=a.npz" for index in range(65))],
    ["x" * 3_000_000],
    ["--" + "x" * 100_000],
    ["info", "a.npz", "b.npz"],
    ["plot", "a.npz", "--out", "none/a"],
    ["library", "--out", "a.npz"],
    [],
]

GOOD = [
    MAKE,
    [*MAKE, "--json", "new.json"],
    [*MAKE, "--seed", "4294967295"],
    ["make", "--size", "1", "--steps", "1", "--out", "new.EXR"],
    ["make", "--size", "4", "--steps", "1", "--frames", "3", "--scales", "1024=1e6,0=0", "--out", "new.NPZ"],
    ["make", "--size", "4", "--steps", "1", "--weights", "all=1e6", "--out", "new.npz"],
    ["compare", "A|B=a.npz", "C=a.npz", "--functions", "2", "--out", "new.md"],
    ["compare", "\n=a.npz", "🎲=one.npz", "--functions", "2", "--sigmas", "0,1024"],
    ["test", "one.npz", "--functions", "2"],
    ["analyse", "one.npz"],
    ["analyse", "a.npz"],
    ["info", "a.npz", "--json", "-"],
    ["--help"],
    *([command, "--help"] for command in ("make", "info", "test", "compare", "analyse", "plot", "library")),
    ["--version"],
]


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A folder with a tile of four pixels a side, one of one pixel, a folder and a pipe."""
    monkeypatch.chdir(tmp_path)
    assert cli.main([*MAKE[:-1], "a.npz"]) == 0
    assert cli.main([*MAKE[:-1], "one.npz", "--size", "1", "--dims", "t,lens.u"]) == 0
    (tmp_path / "folder.npz").mkdir()
    os.mkfifo(tmp_path / "pipe.npz")
    return tmp_path


def state(folder):
    """The names in a folder and what is in its files."""
    return {entry.name: entry.read_bytes() if entry.is_file() else None for entry in folder.iterdir()}


def run(arguments, capfd):
    """Run a command line; return the exit code and what it said on standard error, both streams checked."""
    capfd.readouterr()
    with effort.within(1.0, 100e6):
        try:
            code = cli.main(arguments)
        except SystemExit as stop:
            code = stop.code
    said = capfd.readouterr()
    assert "report" not in said.err and "Traceback" not in said.err
    return code, said.err


def judge_refusal(arguments, folder, capfd):
    before = state(folder)
    code, said = run(arguments, capfd)
    assert code == 2 and said.startswith("generator: ") and said.endswith("\n")
    assert len(said) <= 201 and said[:-1].isprintable(), said
    assert state(folder) == before


def judge_all(judge, lines, folder, capfd):
    """Judge command lines and name all that fail."""
    failed = []
    for arguments in lines:
        try:
            judge(arguments, folder, capfd)
        except AssertionError as error:
            failed.append(f"{[word[:40] for word in arguments]}: {error}")
    assert not failed, "\n".join(failed)


@pytest.mark.skipif(os.name != "posix", reason="pipes and devices")
def test_refusals_are_one_line_and_touch_nothing(folder, capfd):
    assert len(REFUSED) >= 100
    judge_all(judge_refusal, REFUSED, folder, capfd)


def test_refusals_take_no_memory(folder, capfd):
    tracemalloc.start()
    for arguments in REFUSED[::10]:
        run(arguments, capfd)
    assert tracemalloc.get_traced_memory()[1] < 50e6
    tracemalloc.stop()


@pytest.mark.filterwarnings("error")
@pytest.mark.skipif(os.name != "posix", reason="pipes and devices")
def test_what_is_within_bounds_is_done_without_a_word(folder, capfd):
    before = state(folder)
    for arguments in GOOD:
        assert run(arguments, capfd) == (0, ""), arguments
    assert {name: data for name, data in state(folder).items() if not name.startswith("new")} == before


@pytest.mark.parametrize("command", ["make", "test", "compare"])
def test_the_help_tells_the_bounds(command, capfd):
    with pytest.raises(SystemExit):
        cli.main([command, "--help"])
    told = " ".join(capfd.readouterr().out.split())
    bounds = {
        "make": ["1 to 4096", "1 to 1024", "0 to 4294967295", "1 to 256", "1 to 1000000", "1 to 10000", "16777216"],
        "test": ["1 to 100000", "0 to 4294967295", "0 to 1024"],
        "compare": ["1 to 100000", "at most 64"],
    }
    assert all(bound in told for bound in bounds[command])


WORDS = [*BEYOND, *STRANGE, *NO_FILES, "a.npz", "one.npz", "1", "2", "t", "lens.u", "-", "--", "step", "white", "cook"]
OPTIONS = [*NUMBERS, "--seed", "--dims", "--method", "--weights", "--scales", "--out", "--json", "--sigmas", "--layers",
           "--functions", "--kind", "--only", "--help", "--version", "-x"]  # fmt: skip
COMMANDS = ["make", "info", "test", "compare", "analyse", "library", "", "x"]


def random_command_line(seed):
    """Return random words in an order that is likely to be understood; what is understood is done soon."""
    chance = random.Random(seed)
    words = [chance.choice(COMMANDS)]
    if words[0] == "make":
        words += ["--size", "4", "--steps", "2", "--out", "new.npz"]
    elif words[0] in ("test", "compare"):
        words += ["--functions", "2"]
    for _ in range(chance.randrange(4)):
        words += chance.choice(([chance.choice(OPTIONS), chance.choice(WORDS)], [chance.choice(WORDS)]))
    return words if words[0] != "library" else ["library", "--out", "new", "--only", chance.choice(STRANGE)]


def judge_anything(arguments, folder, capfd):
    before = state(folder)
    code, said = run(arguments, capfd)
    assert code in (0, 2)
    if code == 2:
        assert len(said) <= 201 and len(said.splitlines()) == 1, said
        assert "--json" in arguments or state(folder) == before, said
    kept = {name: before[name] for name in ("a.npz", "one.npz", "folder.npz", "pipe.npz")}
    assert kept.items() <= state(folder).items()
    for entry in set(os.listdir(folder)) - kept.keys():
        (folder / entry).unlink()


@pytest.mark.skipif(os.name != "posix", reason="pipes and devices")
@pytest.mark.parametrize("seeds", [range(200), pytest.param(range(200, 5000), marks=pytest.mark.fuzz)])
def test_random_command_lines(seeds, folder, capfd):
    judge_all(judge_anything, map(random_command_line, seeds), folder, capfd)


def test_long_work_tells_how_far_it_is_where_there_is_no_terminal(folder, capfd, monkeypatch):
    monkeypatch.setattr(cli.ProgressBar, "PATIENCE", 0.0)
    for method in ("spectral", "scanning", "joint-scanning", "cook"):
        told = []
        more = ["--size", "4", "--dims", "t,lens.u,lens.v", *(["--steps", "2"] if method == "spectral" else [])]
        assert cli.main(["make", "--method", method, *more, "--out", "new.npz"]) == 0
        lines = capfd.readouterr().err.splitlines()
        assert len(lines) > 3 and lines[-1].startswith("generator: at 100 %"), method
        assert cli.main(["make", "--method", method, *more, "--out", "new.npz"], tell=told.append) == 0
        assert told[-1] == 1 and told == sorted(told) and not capfd.readouterr().err
    assert cli.main(["test", "a.npz", "--functions", "65"]) == 0
    assert capfd.readouterr().err.splitlines()[-1].startswith("generator: at 100 %")


@pytest.mark.fuzz
def test_pictures_of_the_smallest_tile(folder, capfd):
    pytest.importorskip("matplotlib")
    assert cli.main(["plot", "one.npz", "--out", "new"]) == 0
    assert len(list(folder.glob("new-*.png"))) == 4
