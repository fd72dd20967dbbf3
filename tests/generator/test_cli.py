"""The command line: what it writes, and how it refuses."""

import numpy as np
import pytest

from generator import cli, load_tile


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


def test_an_interrupt_says_what_was_reached_and_leaves_no_file(tmp_path, monkeypatch, capsys):
    def interrupted(method, size, dims, seed, samples, progress, **parameters):
        progress(3, 10)
        raise KeyboardInterrupt

    monkeypatch.setattr(cli, "make_tile", interrupted)
    assert make(tmp_path / "a.npz") == 130
    assert "30 % (3 of 10 steps)" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())
