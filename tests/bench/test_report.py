# SPDX-License-Identifier: GPL-3.0-or-later
from html.parser import HTMLParser

import matplotlib.pyplot as plt
import numpy as np
import pytest

from bench import crops, doc_parts, doubts, jobs, paper, report
from bench.crops import crop, write_crop
from bench.document import Heading, Pictures, Plot, Table, page
from bench.doubts import is_worse, looked_at_again
from bench.equal_quality import count_of
from bench.metrics import Ratio, flip
from bench.report import tiles_table
from bench.scene_files import SceneFile
from bench.scene_results import Effort, Results, errors_at
from bench.table import Progress
from generator.periodogram import error_periodogram


class Page(HTMLParser):
    """Counts tags, and checks that those that want an end have one."""

    def __init__(self):
        super().__init__()
        self.tags, self.open = [], []

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))
        if tag not in {"meta", "img", "br"}:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag


@pytest.fixture
def picture(tmp_path):
    path = tmp_path / "picture.png"
    plt.imsave(path, np.linspace(0, 1, 40 * 60 * 3).reshape(40, 60, 3))
    return path


def test_page_is_whole_and_holds_its_pictures(picture):
    parts = [
        Heading("Figures", "1 < 2 & so on"),
        Table("Errors", ["", "1 spp"], [["wheels", "0.9"]]),
        Pictures("Crops", [[("Cycles", picture), ("ours", picture)]]),
        Plot("Curve", picture),
    ]
    parsed = Page()
    parsed.feed(page("A <title>", "All in a line.", parts))
    assert not parsed.open
    shown = [attributes for tag, attributes in parsed.tags if tag == "img"]
    assert [attributes["alt"] for attributes in shown] == ["Crops; Cycles", "Crops; ours", "Curve"]
    assert all(attributes["src"].startswith("data:image/png;base64,") for attributes in shown)
    assert "1 &lt; 2 &amp; so on" in page("", "", parts)
    links = [attributes["href"] for tag, attributes in parsed.tags if tag == "a"]
    assert links == ["#figures"] and ("h2", {"id": "figures"}) in parsed.tags
    addresses = [value for _, attributes in parsed.tags for value in attributes.values() if value and "://" in value]
    assert not addresses  # nothing is fetched


def test_table_as_markdown():
    made = Table("Errors", ["", "1 spp"], [["wheels", "0.9"]]).markdown()
    assert made.splitlines() == ["|  | 1 spp |", "| --- | --- |", "| wheels | 0.9 |"]


@pytest.mark.parametrize(("middle", "corner"), [((0.5, 0.5), (20, 10)), ((0, 0), (0, 0)), ((1, 1), (40, 20))])
def test_crop_stays_inside(picture, tmp_path, monkeypatch, middle, corner):
    whole = plt.imread(picture)[..., :3]
    left, top = corner
    assert np.array_equal(crop(whole, middle, 20), whole[top : top + 20, left : left + 20])
    monkeypatch.setattr(crops, "EDGE", 20)
    written = plt.imread(write_crop(picture, middle, tmp_path / "new" / "crop.png"))
    assert np.array_equal(written[..., :3], crop(whole, middle, 20))


def test_count_of_random_samples_is_interpolated():
    flips = [0.4, 0.3, 0.2]
    assert count_of(0.25, flips) == pytest.approx(2.5)
    assert count_of(0.5, flips) == 1
    assert count_of(0.1, flips) == np.inf


def test_flip_sees_coarse_noise_better_than_fine():
    grey = np.full((64, 64, 3), 0.3, np.float32)
    checker = 0.1 * (np.indices((64, 64)).sum(0) % 2 - 0.5)[..., None]
    coarse = 0.1 * ((np.indices((64, 64)) // 8).sum(0) % 2 - 0.5)[..., None]
    assert flip(grey, grey) == 0
    assert flip(grey + coarse, grey) > 1.5 * flip(grey + checker, grey)


def test_spectrum_of_white_errors_is_their_mean_square():
    errors = np.random.default_rng(1).normal(scale=0.3, size=(20, 64, 64))
    spectrum = error_periodogram(errors)
    assert spectrum.radial_mean[5:] == pytest.approx(0.09, rel=0.15)


def test_table_of_tiles_is_found():
    found = tiles_table()
    assert {"Spectral Tiles", "OpenQMC pmjbn", "Cycles 5.2 blue noise"} <= set(found.header)
    assert all(len(row) == len(found.header) for row in found.rows)


def test_table_of_docs_replaces_what_stands_between_its_marks(tmp_path, monkeypatch):
    monkeypatch.setattr(doc_parts, "ROOT", tmp_path)
    page = tmp_path / "docs" / "measurements.md"
    page.parent.mkdir()
    made = Table("Errors", ["", "1 spp"], [["wheels", "0.9"]])
    page.write_text("before\n<!-- python -m bench paper --docs -->\nold\n<!-- end of paper -->\nafter\n")
    for _ in range(2):
        doc_parts.write_table("paper", made)
    lines = page.read_text().splitlines()
    assert (lines[0], lines[2], lines[-1]) == ("before", "Errors:", "after")
    assert lines.count("| wheels | 0.9 |") == 1
    assert "old" not in lines
    with pytest.raises(ValueError, match="no marks"):
        doc_parts.write_table("report", made)


@pytest.mark.parametrize("wanted", [1, 1.4, 4, 6, 40])
def test_errors_between_samples_lie_on_their_power_law(wanted):
    counts, seeds = (1, 4, 16), np.array([0.8, 1.0, 1.2])
    assert errors_at(counts, seeds / np.array([counts]).T ** 1.5, wanted) == pytest.approx(seeds / wanted**1.5)


def test_errors_of_a_single_count_fall_like_those_of_independent_samples():
    assert errors_at((4,), np.array([[3.0, 5.0]]), 8) == pytest.approx([1.5, 2.5])


def _found(ours, cycles):
    """Results of a scene whose errors at one sample a pixel these are, at every sigma."""
    errors = {
        (engine, 1): np.repeat([[value] for value in values], 3, axis=1)
        for engine, values in ((jobs.TILES, ours), (jobs.AUTOMATIC, cycles), (jobs.TABULATED, cycles))
    }
    return Results(SceneFile("attic", None, ""), None, errors, {1: [2.0]}, {}, {}, None)


WORSE = [1.3, 1.31, 1.29], [1.0, 1.01, 0.99]


def test_equal_time_gives_cycles_more_samples():
    found = _found(*WORSE)
    assert found.over(jobs.AUTOMATIC, 1).value == pytest.approx(1.3)
    assert found.at_equal_time(1).value == pytest.approx(2.6)


@pytest.mark.parametrize(
    ("ours", "raw", "reason"),
    [
        (1.0, 1.0, "chance"),
        (1.3, 1.0, "control variates"),
        (1.3, 1.3, "single pixels err more"),
        (1.3, (1.0, 1.3, 1.3), "single pixels err no more, but neighbours"),
    ],
)
def test_where_cycles_is_better_other_seeds_say_why(monkeypatch, ours, raw, reason):
    asked = []

    def measured(scene, settings, seeds, truth):
        asked.extend(seeds)
        level = 1.0 if settings.engine == jobs.AUTOMATIC else raw if settings.raw else ours
        return level * np.linspace(0.99, 1.01, len(seeds))[:, None] * np.ones(3)

    monkeypatch.setattr(doubts, "render", lambda scene, wanted: None)
    monkeypatch.setattr(doubts, "measured", measured)
    found = [_found(*WORSE), _found(*reversed(WORSE))]
    (doubt,) = looked_at_again(found, jobs.Settings(), range(3), Progress(1))
    assert not set(asked) & set(range(3))
    assert doubt.reason.startswith(reason)
    assert doubt.is_confirmed == (ours > 1)
    text = "".join(part.html() for part in doubts.parts([doubt]))
    assert "attic, 1 spp" in text and doubt.reason in text

    effort = Effort(("attic",), 32, (1,), range(3), 2, 32, (32, 32), 1)
    lead = report._lead(found, effort, [doubt])
    assert ("attic at 1 spp" in lead) == doubt.is_confirmed
    assert ("nowhere" in lead) != doubt.is_confirmed


def test_worse_is_by_more_than_two_standard_errors():
    assert is_worse(Ratio(1.3, 0.1))
    assert not is_worse(Ratio(1.3, 0.2))


def test_whole_report_of_one_small_scene(tmp_path, monkeypatch):
    monkeypatch.setattr(jobs, "CACHE", tmp_path)
    effort = Effort(("motion_blur",), 32, (1,), range(2), 2, 32, (32, 32), 1)
    made = report.make(effort, paper.Effort((), 32, range(2), 2, ()), tmp_path / "out", docs=False)
    text = made.read_text(encoding="utf-8")
    parsed = Page()
    parsed.feed(text)
    assert not parsed.open
    assert text.count("<img") == 3 + 1 + 4 + 4  # at the top, curves, equal samples and time, converged and variants
    wanted = ("2 seeds", "Spectral Tiles, denoised", "Cycles at equal time", "OpenQMC", jobs.blender_version())
    assert all(word in text for word in wanted)

    def rendered_again(*order):
        tasks = order[1]
        assert all("repeats" in task for _, task in tasks), "an image was not taken from the cache"
        return run(*order)

    run = jobs.run_worker
    monkeypatch.setattr(jobs, "run_worker", rendered_again)
    report.make(effort, paper.Effort((), 32, range(2), 2, ()), tmp_path / "out", docs=False)
