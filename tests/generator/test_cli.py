"""The command line: what it writes, and how it refuses."""

import _thread
import json
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from generator import cli, exr, load_tile


def make(path, *options):
    return cli.main(["make", "--size", "8", "--method", "white", "--out", str(path), *options])


def test_make_is_deterministic(tmp_path):
    for name in ("a.npz", "b.npz"):
        assert make(tmp_path / name, "--dims", "t,film.x", "--samples", "2", "--seed", "7") == 0
    a, b = load_tile(tmp_path / "a.npz"), load_tile(tmp_path / "b.npz")
    assert a.values.shape == (8, 8, 2, 2) and a.dims == ("t", "film.x")
    assert np.array_equal(a.values, b.values)
    assert a.metadata["method"] == "white" and a.metadata["seed"] == 7


def test_info_and_test_print_what_the_tile_holds(tmp_path, capsys):
    make(tmp_path / "a.npz")
    assert cli.main(["info", str(tmp_path / "a.npz")]) == 0
    assert "8 x 8 pixels, 1 sample(s), dimensions t, lens.u" in capsys.readouterr().out
    assert cli.main(["test", str(tmp_path / "a.npz"), "--functions", "4"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in lines[1:]] == ["t", "lens", "light", "t+lens", "t+light", "lens+light", "all"]


@pytest.mark.parametrize(
    "arguments",
    [
        ["make", "--size", "0", "--out", "a.npz"],
        ["make", "--size", "x", "--out", "a.npz"],
        ["make", "--dims", "t,speed", "--out", "a.npz"],
        ["make", "--samples", "-1", "--out", "a.npz"],
        ["make", "--seed", "-1", "--out", "a.npz"],
        ["make", "--method", "magic", "--out", "a.npz"],
        ["make", "--method", "white", "--out", "a.png"],
        ["make", "--method", "white", "--frames", "4", "--out", "a.npz"],
        ["make", "--samples", "3", "--out", "a.npz"],
        ["make", "--samples", "2", "--frames", "2", "--out", "a.npz"],
        ["make", "--weights", "t:1", "--out", "a.npz"],
        ["make", "--weights", "lens+t=1", "--out", "a.npz"],
        ["make", "--scales", "0=1", "--out", "a.npz"],
        ["make", "--method", "white", "--out", "missing/a.npz"],
        ["make", "--method", "cook", "--samples", "5", "--out", "a.npz"],
        ["make", "--method", "film-positions", "--out", "a.npz"],
        ["make", "--steps", "0", "--out", "a.npz"],
        ["make", "--candidates", "5", "--out", "a.npz"],
        ["make", "--method", "scanning", "--candidates", "5", "--out", "a.npz"],
        ["make", "--method", "joint-scanning", "--candidates", "0", "--out", "a.npz"],
        ["make", "--method", "joint-scanning", "--secondary", "5", "--out", "a.npz"],
        ["make", "--method", "film-positions", "--dims", "film.x,film.y", "--candidates", "0", "--out", "a.npz"],
        ["make", "--frames", "0", "--out", "a.npz"],
        ["make", "--dims", "", "--out", "a.npz"],
        ["make", "--dims", "t,t", "--out", "a.npz"],
        ["make", "--scales", "nan=1", "--out", "a.npz"],
        ["library", "--only", "sound-1", "--out", "library"],
        ["make"],
        ["info", "missing.npz"],
        ["test", "missing.npz"],
        ["dance"],
        [],
    ],
)
def test_bad_input_is_one_line_and_exit_code_2(arguments, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert cli.main(arguments) == 2
    assert len(capsys.readouterr().err.splitlines()) == 1
    assert not list(tmp_path.iterdir())


def npz(path, **values):
    np.savez(path, **{"dims": ["t"]} | values)


def truncated(path):
    make(path)
    path.write_bytes(path.read_bytes()[:300])


BAD_FILES = {
    "text.npz": lambda path: path.write_text("hello"),
    "truncated.npz": truncated,
    "truncated.exr": truncated,
    "object.npz": lambda path: npz(path, values=np.array([{}])),
    "nan.npz": lambda path: npz(path, values=np.full((4, 4, 1, 1), np.nan)),
    "one.npz": lambda path: npz(path, values=np.ones((4, 4, 1, 1))),
    "oblong.npz": lambda path: npz(path, values=np.zeros((4, 5, 1, 1))),
    "nameless.npz": lambda path: np.savez(path, values=np.zeros((4, 4, 1, 1))),
    "colours.exr": lambda path: exr.write(path, ("R", "G", "B"), np.zeros((4, 4, 1, 3), np.float32), "{}"),
    "truncated.npy": lambda path: path.write_bytes(b"\x93NUMPY\x01\x00"),
    "short.npy": lambda path: np.save(path, np.zeros((4, 4, 2))),
}


@pytest.mark.parametrize("name", BAD_FILES)
def test_a_bad_file_is_one_line_that_names_it(name, tmp_path, capsys):
    BAD_FILES[name](tmp_path / name)
    assert cli.main(["compare", str(tmp_path / name)]) == 2
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 1 and name in lines[0] and "expected" in lines[0]


@pytest.mark.parametrize(
    "options",
    [["--functions", "0"], ["--seed", "-1"], ["--kind", "ramp"], ["--sigmas", "-1"], ["--sigmas", "a"],
     ["--layers", "0"], ["--layers", "1,9"], ["--dims", "t"]],
)  # fmt: skip
def test_bad_options_of_a_test_are_one_line(options, tmp_path, capsys):
    np.save(tmp_path / "a.npy", np.zeros((4, 4, 5)))
    assert cli.main(["compare", str(tmp_path / "a.npy"), *options]) == 2
    assert len(capsys.readouterr().err.splitlines()) == 1


def test_arrays_of_others_are_compared_by_the_names_given(tmp_path):
    make(tmp_path / "a.npz", "--dims", "t,lens.u,lens.v")
    np.save(tmp_path / "b.npy", load_tile(tmp_path / "a.npz").values[:, :, 0])
    arguments = ["compare", f"A={tmp_path / 'a.npz'}", f"B={tmp_path / 'b.npy'}", "--dims", "t,lens.u,lens.v"]
    assert cli.main([*arguments, "--functions", "10", "--out", str(tmp_path / "table.md")]) == 0
    header, _, *rows = (tmp_path / "table.md").read_text().splitlines()[2:]
    assert header == "| sigma 1 / 2 / 4 | A | B |" and len(rows) == 3
    assert all(row.split("|")[2] == row.split("|")[3] for row in rows)


def test_single_layers_are_tested(tmp_path, capsys):
    make(tmp_path / "a.npz", "--dims", "t", "--samples", "4")
    arguments = ["test", str(tmp_path / "a.npz"), "--functions", "10", "--sigmas", "0,3"]
    assert cli.main([*arguments, "--layers", "1,2"]) == 0
    assert capsys.readouterr().out.split()[:4] == ["sigma", "0", "sigma", "3"]


def test_summaries(tmp_path, capsys):
    made, bad = tmp_path / "a.npz", tmp_path / "bad.npz"
    make(made, "--dims", "t,lens.u")
    assert cli.main(["info", str(made), "--json", str(tmp_path / "info.json")]) == 0
    told = json.loads((tmp_path / "info.json").read_text())
    assert told["dims"] == ["t", "lens.u"] and told["metadata"]["format_version"] == 1 and told["command"] == "info"
    bad.write_text("hello")
    capsys.readouterr()
    assert cli.main(["info", str(bad), "--json", "-"]) == 2
    assert "bad.npz" in json.loads(capsys.readouterr().out)["error"]
    assert cli.main(["info", str(made), "--json", str(tmp_path / "none" / "a.json")]) == 2


def test_an_interrupt_says_what_was_reached_and_leaves_no_file(tmp_path, monkeypatch, capsys):
    def interrupted(method, size, dims, seed, samples, progress, **parameters):
        progress(3, 10)
        raise KeyboardInterrupt

    monkeypatch.setattr(cli, "make_tile", interrupted)
    assert make(tmp_path / "a.npz") == 130
    assert "30 % (3 of 10 steps)" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_a_long_run_can_be_interrupted(tmp_path, monkeypatch, capsys):
    """What Ctrl-C does, in the middle of the optimiser."""

    class Interrupting(cli.ProgressBar):
        def __call__(self, done, total):
            super().__call__(done, total)
            if done == 3:
                _thread.interrupt_main()

    monkeypatch.setattr(cli, "ProgressBar", Interrupting)
    # A shell's background job ignores interrupts, and so would the optimiser.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        assert cli.main(["make", "--size", "8", "--steps", "1000000", "--out", str(tmp_path / "a.npz")]) == 130
    finally:
        signal.signal(signal.SIGINT, before)
    assert "of 1000060 steps) after" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_a_task_that_is_cancelled_is_interrupted(tmp_path):
    """SIGTERM to the program, as farms send it."""
    line = [sys.executable, "-m", "generator", "make", "--steps", "1000000", "--out", str(tmp_path / "a.npz")]
    with subprocess.Popen(line, cwd=Path(__file__).parents[2], stderr=subprocess.PIPE, text=True) as process:
        time.sleep(2.0)  # by now it optimises, which would take minutes
        process.terminate()
        _, errors = process.communicate(timeout=20)
    assert process.returncode == 130
    assert len(errors.strip().splitlines()) == 1 and "interrupted at" in errors
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("place", ["_parser", "write_summary"])
def test_an_interrupt_before_or_after_a_command_is_one_line(tmp_path, monkeypatch, capsys, place):
    def interrupted(*arguments):
        raise KeyboardInterrupt

    monkeypatch.setattr(cli, place, interrupted)
    assert make(tmp_path / "a.npz") == 130
    assert capsys.readouterr().err.splitlines() == ["generator: interrupted, nothing half done is left"]
