# SPDX-License-Identifier: GPL-3.0-or-later
import json
import subprocess
import sys
from dataclasses import replace
from types import SimpleNamespace

import matplotlib.pyplot as plt
import numpy as np
import pytest

from bench import demo, doc_parts, real, real_renders
from bench.document import Heading
from bench.equal_error import Curve
from bench.equal_time import samples_in, threshold_in, value_in_time
from bench.jobs import engine_state
from bench.real_figures import Measured, error_maps, file_figures, noise_of, ratio, seen, spread
from bench.real_measuring import Effort, measure
from bench.real_page import spot
from bench.real_renders import (
    DENOISED,
    EVEN,
    NATIVE,
    OURS,
    RAW,
    REFERENCE,
    THRESHOLD,
    NoSwitch,
    Render,
    blend_files,
    cached,
)
from bench.real_tables import told
from bench.table import table

NOISE = (1e-3, 1e-4, 1e-5)
SMALL = Effort(width=8, samples=(1, 4), thresholds=(0.1,), reference_samples=16)


def test_error_is_free_of_the_references_noise():
    noise = np.random.default_rng(1).normal(size=(3, 256, 256)) * np.array((0.1, 0.2, 0.2))[:, None, None]
    picture, *halves = 1.0 + noise
    unfiltered, filtered, _ = (error.mean() for error in error_maps(picture, halves))
    assert unfiltered == pytest.approx(0.01, rel=0.05)
    assert noise_of(halves)[0] == pytest.approx(0.04, rel=0.05)
    assert filtered == pytest.approx(0.01 / (4 * np.pi), rel=0.15)  # what a Gaussian of one pixel leaves of white noise


def test_a_firefly_counts_as_bright_and_what_is_no_number_as_black():
    pixels = np.full((2, 2, 3), 0.5, np.float32)
    pixels[0, 0], pixels[1, 1] = 1e6, np.nan
    assert seen(pixels) == pytest.approx(np.array([[4.0, 0.5], [0.5, 0.0]]))


def test_time_to_equal_error_of_a_known_curve():
    times = np.array([1.0, 4.0, 16.0])
    curve = Curve(times, 0.1 / times)
    assert curve.time_to(0.1 / 7.0).value == pytest.approx(7.0)
    assert not curve.time_to(0.1 / 16.0).beyond
    assert curve.error_at(5.0).value == pytest.approx(0.02)
    quickest = curve.time_to(0.5)  # nothing quicker was measured
    assert (quickest.value, quickest.beyond) == (pytest.approx(1.0), False)
    farther = curve.time_to(0.1 / 40.0)
    assert farther.value == pytest.approx(40.0) and farther.beyond
    assert curve.time_to(0.1 / 100.0).value == np.inf
    assert curve.error_at(0.5).value == np.inf
    assert curve.error_at(32.0).beyond


def test_a_longer_render_that_is_no_better_is_not_chosen():
    curve = Curve([8.0, 1.0, 2.0, 4.0], [0.02, 0.1, 0.2, 0.05])
    assert [time for time, _ in curve.points] == [1.0, 4.0, 8.0]
    assert Curve([1.0, 2.0], [0.1, -1e-9]).points == [(1.0, 0.1)]
    assert Curve([], []).time_to(0.1).value == np.inf


def test_ratio_where_nothing_is_left_to_chance():
    assert ratio(0.0, 0.0) is None
    assert ratio(1e-3, 0.0) == np.inf
    assert ratio(-1e-12, 1e-3) == 0.0


def test_spread_of_a_ratio_is_that_of_repeated_renders():
    random = np.random.default_rng(2)
    scene = random.uniform(0.5, 2.0, size=500)  # what there is to see differs, and counts alike in both
    ours, theirs = (scene * random.normal(1.0, 0.2, size=(400, 500)) for _ in range(2))
    ratios = ours.mean(1) / theirs.mean(1)
    assert spread(ours[0], theirs[0]) == pytest.approx(ratios.std(), rel=0.15)
    assert spread(scene, 2.0 * scene) == pytest.approx(0.0, abs=1e-12)


@pytest.fixture
def measured():
    """Errors of .1 over time; thresholds take half of even samples' time, and ours half of both."""
    found = {}
    for engine, pace in ((NATIVE, 1.0), (OURS, 0.5)):
        for mode in (RAW, DENOISED):
            for count in (1, 4, 16, 64):
                found[engine, mode, f"{EVEN} {count}"] = _measured(count * pace, 0.1 / count)
            for threshold, count in ((0.1, 32), (0.03, 128)):
                found[engine, mode, f"{THRESHOLD} {threshold}"] = _measured(count * pace / 2, 0.1 / count)
    return found


def _measured(time, error):
    return Measured(time / 2, time, 1000.0, (error, error / 10, error / 20), 0, np.full((3, 4), error))


def test_time_to_equal_error_of_a_file(measured):
    figures = file_figures(measured, 100, NOISE)
    reached = figures["time_to_error"][RAW]["even 64"][1]
    assert reached[EVEN]["value"] == pytest.approx(0.25)  # ours by thresholds, Cycles by even samples
    assert reached["better"] == {"value": pytest.approx(0.5), "beyond": False, "way": THRESHOLD}
    assert figures["time_to_error"][RAW]["even 4"][0]["better"]["value"] == pytest.approx(0.5)
    assert figures["same_settings"][DENOISED]["even 16"]["processor"] == pytest.approx(0.5)
    assert figures["same_settings"][DENOISED]["even 16"]["errors"] == pytest.approx([1.0] * 3)
    assert figures["same_settings"][RAW]["even 16"]["bytes_per_pixel"] == 0.0
    # Ours takes 32 seconds for 64 samples; by thresholds Cycles has the error of 64 samples by then.
    assert figures["equal_time"][RAW]["even 64"][0] == {"value": pytest.approx(1.0), "beyond": False, "way": THRESHOLD}
    assert figures["equal_time"][RAW]["even 4"][0]["value"] == pytest.approx(0.5)


def test_tables_name_the_worst_first(measured):
    figures = {"good": file_figures(measured, 100, NOISE)}
    slow = {
        key: replace(each, processor=each.processor * (6.0 if key[0] == OURS else 1.0))
        for key, each in measured.items()
    }
    figures["slow"] = file_figures(slow, 100, NOISE)
    found = told(figures, "")
    assert found.summary.splitlines()[-1] == (
        "Spectral Tiles takes 1.75 of Cycles' processor time to a picture as good as Cycles' at 16 samples, "
        "raw (median of 2 files; worst 3.00 in slow)."
    )
    text = "\n\n".join(map(str, found.time + found.tables))
    assert "Files with figures above 1, 1 of 2" in text
    first = text.index("Time to equal error: each file, raw, sigma 1, worst first")
    assert text.index("slow ", first) < text.index("good ", first)
    json.dumps(figures)


def test_tables_of_cycles_alone(measured):
    native = {key: each for key, each in measured.items() if key[0] == NATIVE}
    (only,) = told({"file": file_figures(native, 100, NOISE)}, "").tables
    assert only.rows[0][:2] == ["file, raw", "1.00 s 1.0e-01"]
    table(only.header, only.rows)


def test_settings_of_equal_time_are_found():
    assert samples_in([(16, 16.0), (64, 64.0), (1, 5.0)], 23.0) == 23
    assert samples_in([(4, 10.0)], 20.0) == 8
    assert samples_in([(62, 13.0), (73, 13.05)], 15.0) <= 110  # not hundreds for times that are close
    assert threshold_in([(0.1, 16.0), (0.03, 64.0)], 32.0) == pytest.approx(np.sqrt(0.1 * 0.03), rel=0.02)
    assert threshold_in([(0.1, 16.0)], 16.0) == 0.1 > threshold_in([(0.1, 16.0)], 20.0)
    asked = []

    def seconds(value):
        asked.append(value)
        return 3.0 + 1.0 / value

    found = value_in_time(THRESHOLD, [(0.1, 13.0)], 40.0, seconds, 4)
    assert seconds(found) == pytest.approx(40.0, rel=0.05) and len(asked) <= 4
    assert value_in_time(THRESHOLD, [(0.1, 13.0)], 13.2, None, 4) == 0.1


def test_page_finds_where_errors_differ():
    difference = np.zeros((200, 400))
    difference[40, 300] = -1.0
    (x, y), gain = spot(difference)
    assert (x, y) == (pytest.approx(0.75, abs=0.03), pytest.approx(0.8, abs=0.03)) and gain < 0.0


def test_pairs_take_turns_in_going_first():
    renders = Effort(samples=(1, 4), thresholds=(0.1,)).renders()
    assert [render.engine for render in renders[:4]] == [NATIVE, OURS, OURS, NATIVE]
    assert len(renders) == len(set(renders)) == 12
    assert {render.beside for render in renders if render.engine == NATIVE} == {engine_state()}
    assert {render.engine for render in Effort(native_only=True).renders()} == {NATIVE}


@pytest.fixture
def cache(tmp_path, monkeypatch):
    monkeypatch.setattr(real_renders, "CACHE", tmp_path / "cache")
    return tmp_path / "cache"


@pytest.fixture
def folder(tmp_path):
    """Files that only the worker below can read."""
    (tmp_path / "files" / "inside").mkdir(parents=True)
    for name in ("one", "inside/two"):
        (tmp_path / "files" / f"{name}.blend").write_text(name)
    return tmp_path / "files"


class Worker:
    """Stands for the process that renders: noise whose error is .1 over the samples."""

    def __init__(self, stop_after=np.inf):
        self.orders, self.stop_after = [], stop_after

    def __call__(self, command, **_):
        order = json.loads(command[-1])
        render = Render(**order["render"])
        if len(self.orders) == self.stop_after:
            raise KeyboardInterrupt
        self.orders.append(order)
        if code := self.code(order["blend"], render):
            return SimpleNamespace(returncode=code, stdout="much\nwhy not\n")
        count = render.value if render.rule != THRESHOLD else 6.0 / render.value
        noise = np.random.default_rng(len(self.orders)).normal(scale=np.sqrt(0.1 / count), size=(64, 64, 1))
        picture = self.brightness + noise * self.brightness + np.zeros(3)
        np.save(f"{order['picture']}.npy", picture.astype(np.float16))
        plt.imsave(f"{order['picture']}.png", np.clip(picture / 2.0, 0.0, 1.0))
        seconds = count * (self.slowness if render.engine == OURS else 1.0)
        result = {"wall": count, "processor": seconds, "peak": 100, "size": [64, 64]}
        with open(order["result"], "w") as file:
            json.dump(result, file)
        return SimpleNamespace(returncode=0, stdout="")

    brightness = slowness = 1.0

    def code(self, blend, render):
        return 0


def _use(worker, monkeypatch):
    monkeypatch.setattr(real_renders, "subprocess", SimpleNamespace(**{**vars(subprocess), "run": worker}))
    return worker


def test_measuring_goes_on_where_it_was_stopped(cache, folder, monkeypatch):
    files = blend_files(folder)
    assert [file.name for file in files] == ["inside/two", "one"]
    effort = replace(SMALL, native_only=True)
    stopped = _use(Worker(stop_after=3), monkeypatch)
    with pytest.raises(KeyboardInterrupt):
        measure(files, effort)
    went_on = _use(Worker(), monkeypatch)
    outcome = measure(files, effort)
    assert len(stopped.orders) == 3
    assert len(went_on.orders) == 2 * (6 + 2) - 3
    again = _use(Worker(), monkeypatch)
    assert measure(files, effort).figures == outcome.figures
    assert not again.orders
    error = outcome.figures["one"]["measured"][NATIVE][RAW]["even 4"]["errors"][0]
    assert error == pytest.approx(0.1 / 4, rel=0.15)


def test_page_shows_pictures_of_equal_time_and_experiments(cache, folder, monkeypatch):
    worker = _use(Worker(), monkeypatch)
    text = real.report(folder, ["one"], SMALL, None, folder / "page", lambda folder: [Heading("The paper")])
    page = (folder / "page" / "report.html").read_text()
    assert f"Page: {folder / 'page' / 'report.html'}" in text
    assert page.count("<img") == 2 + 4 + 3  # by no threshold Cycles is as quick as by 4 samples
    assert "Cycles, 4 samples: 4.0\xa0s" in page and "Spectral Tiles, threshold 0.1: 60.0\xa0s" in page
    order = ["of Cycles&#x27; processor time", *(f'<h2 id="{one}' for one in ("time", "pictures", "the-paper", "all-"))]
    assert [*map(page.index, order)] == sorted(map(page.index, order))
    assert {(found["render"]["rule"], found["render"]["value"]) for found in worker.orders[12 + 2 :]} == {
        (EVEN, 60), (THRESHOLD, 1.0),  # Cycles takes the same time for the same samples
    }  # fmt: skip


def test_demo_shows_cycles_in_the_same_time(cache, folder, tmp_path, monkeypatch):
    monkeypatch.setattr(demo, "ROOT", tmp_path)
    monkeypatch.setattr(doc_parts, "ROOT", tmp_path)
    (tmp_path / "docs").mkdir()
    (tmp_path / "README.md").write_text("<!-- python -m bench demo --docs -->\n<!-- end of demo -->\n")
    worker = _use(Worker(), monkeypatch)
    worker.slowness = 2.5
    (file,) = blend_files(folder, ["one"])
    text = demo.make(file, 64, 0.1, 64, tmp_path / "out", docs=True)
    rows = [line for line in text.splitlines() if ", a noise threshold of" in line or " samples everywhere " in line]
    times = {row.split(",")[0]: float(row.split()[-5]) for row in rows}
    assert times["Spectral Tiles"] == 150.0
    assert times["Cycles in the same time"] == pytest.approx(150.0, rel=0.05)
    told = (tmp_path / "README.md").read_text()
    assert "Cycles with a noise threshold of 0.04" in told or "Cycles with 150 samples everywhere" in told
    assert len(worker.orders) <= 8 and (tmp_path / "docs" / "demo.jpg").is_file()
    worker.slowness = 0.0001
    with pytest.raises(ValueError, match="No setting was found"):
        demo.make(file, 65, 0.1, 64, tmp_path / "out", docs=True)


def test_files_that_cycles_cannot_render_are_told(cache, folder, monkeypatch):
    worker = Worker()
    worker.code = lambda blend, render: 3 if blend.endswith("one.blend") else 0
    _use(worker, monkeypatch)
    text = real.report(folder, (), replace(SMALL, native_only=True), folder / "out" / "figures.json", None)
    assert "Left out: one: why not" in text
    assert list(json.loads((folder / "out" / "figures.json").read_text())["files"]) == ["inside/two"]
    worker.brightness = 0.0
    worker.code = lambda blend, render: 0
    with pytest.raises(ValueError, match="Left out: one: its picture is black"):
        real.report(folder, ["one"], replace(SMALL, native_only=True))


def test_ours_that_fails_is_a_fault_and_none_that_cannot_be_switched_on_is_measured(cache, folder, monkeypatch):
    worker = Worker()
    worker.code = lambda blend, render: 1 if render.engine == OURS and render.rule == THRESHOLD else 0
    _use(worker, monkeypatch)
    outcome = measure(blend_files(folder, ["one.blend"]), SMALL)
    assert outcome.faults == [f"one, threshold 0.1, {mode}: why not" for mode in (RAW, DENOISED)]
    assert "even 4" in outcome.figures["one"]["time_to_error"][RAW]
    worker.code = lambda blend, render: 4 if render.engine == OURS else 0
    with pytest.raises(NoSwitch, match="--native-only"):
        measure(blend_files(folder, ["inside/two"]), SMALL)


def test_a_references_samples_fit_the_time_and_what_is_there_is_used(cache, folder, monkeypatch):
    _use(Worker(), monkeypatch)
    (file,) = blend_files(folder, ["one"])
    effort = Effort(width=8, reference_seconds=100)
    assert effort.samples_of_reference(file, 0.01) == 1024
    assert effort.samples_of_reference(file, 0.3) == 256
    assert effort.samples_of_reference(file, 9.0) == 128
    for half in effort.references(512):
        real_renders.rendered(file, 8, half)
    assert effort.samples_of_reference(file, 0.09) == 512
    assert not any(render.rule == REFERENCE for render in effort.missing(file))


def test_bad_folders_and_names(tmp_path, folder):
    with pytest.raises(ValueError, match=r"no \.blend files"):
        blend_files(tmp_path / "nowhere")
    with pytest.raises(ValueError, match=r"not in .*: three"):
        blend_files(folder, ["one", "three"])


FACTORY = "import bpy, sys; s = bpy.context.scene; bpy.ops.wm.save_as_mainfile(filepath=sys.argv[1]); " \
    "bpy.data.objects.remove(s.camera); bpy.ops.wm.save_as_mainfile(filepath=sys.argv[2])"  # fmt: skip

SWITCH = """
import bpy

class Settings(bpy.types.PropertyGroup):
    enabled: bpy.props.BoolProperty()
    samples: bpy.props.IntProperty()

def render(self, depsgraph):
    ours = depsgraph.scene_eval.spectral_tiles
    if ours.enabled:
        depsgraph.scene_eval.cycles.samples = ours.samples
    native(self, depsgraph)

def register():
    global native
    import cycles
    native, cycles.CyclesRender.render = cycles.CyclesRender.render, render
    bpy.utils.register_class(Settings)
    bpy.types.Scene.spectral_tiles = bpy.props.PointerProperty(type=Settings)
"""


def test_renders_of_real_files(cache, tmp_path, monkeypatch):
    files, extension = tmp_path / "files", tmp_path / "extension"
    files.mkdir()
    (extension / "addon").mkdir(parents=True)
    (extension / "addon" / "__init__.py").write_text(SWITCH)
    monkeypatch.setattr(real_renders, "extension_copy", lambda: extension)
    paths = [str(files / f"{name}.blend") for name in ("cube", "blind")]
    subprocess.run([sys.executable, "-c", FACTORY, *paths], check=True, capture_output=True)
    effort = Effort(width=48, samples=(1,), thresholds=(), reference_samples=64, options=(("samples", "16"),))
    monkeypatch.setattr(Effort, "renders", lambda effort, every=Effort.renders: every(effort)[:3])  # saves a process
    assert "Left out: blind: it has no camera" in real.report(files, (), effort)
    cube = blend_files(files, ["cube"])[0]
    one, sixteen = (cached(cube, 48, render).pixels() for render in effort.renders()[:2])
    truth = [cached(cube, 48, half).pixels() for half in effort.references(64)]
    assert one.shape == (27, 48, 3)
    errors = [error_maps(seen(picture), [seen(half) for half in truth])[0].mean() for picture in (one, sixteen)]
    assert errors[1] < errors[0] / 4  # it is ours that took sixteen samples
