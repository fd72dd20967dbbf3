# SPDX-License-Identifier: GPL-3.0-or-later
import os
import resource
from html.parser import HTMLParser

import matplotlib.pyplot as plt
import numpy as np
import pytest

from bench import crops, doc_parts
from bench.crops import crop, write_crop
from bench.document import Heading, Pictures, Plot, Table, page
from bench.equal_quality import count_of
from bench.metrics import flip
from generator.periodogram import error_periodogram


class Page(HTMLParser):
    """Counts tags, and checks that those that want an end have one."""

    def __init__(self):
        super().__init__()
        self.tags, self.open = [], []

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))
        if tag not in {"meta", "img", "wbr"}:
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


def test_words_begin_at_the_left_and_numbers_do_not():
    made = Table("Errors", ["", "worst", "where"], [["all", "~1.2", "a_b"]]).html()
    assert '<th scope="col">worst</th><th scope="col" class="words">where</th>' in made
    assert '<td>~1.2</td><td class="words">a_<wbr>b</td>' in made


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


@pytest.mark.skipif(os.name != "posix", reason="quotas")
def test_a_page_and_its_pictures_stay_where_the_new_ones_do_not_fit(tmp_path, monkeypatch):
    """... on the disk: none is cut off."""
    monkeypatch.setattr(doc_parts, "ROOT", tmp_path)
    (tmp_path / "docs").mkdir()
    text, picture, source = (tmp_path / name for name in ("docs/a.md", "docs/a.jpg", "whole.png"))
    text.write_text("<!-- python -m bench a --docs -->\n<!-- end of a -->\n")
    picture.write_bytes(b"old")
    pixels = np.random.default_rng(1).random((64, 64, 3))
    plt.imsave(source, pixels)
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (500, before[1]))
    try:
        for write in (
            lambda: doc_parts.renew(text, "a", "x" * 1000),
            lambda: doc_parts.write_picture("a", pixels),
            lambda: crops.write_crop(source, (0.5, 0.5), picture.with_suffix(".png")),
        ):
            with pytest.raises(OSError, match="not written"):
                write()
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert text.read_text().endswith("end of a -->\n") and picture.read_bytes() == b"old"
    assert sorted(path.name for path in text.parent.iterdir()) == ["a.jpg", "a.md"]
