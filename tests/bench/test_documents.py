# SPDX-License-Identifier: GPL-3.0-or-later
"""README and docs/ tell figures as they were measured, commands that there are, and links that lead somewhere."""

import re

import pytest

from bench import verify
from bench.__main__ import _parser
from bench.scene_files import ROOT

DOCUMENTS = [*verify.documents(), ROOT / "generator" / "README.md", ROOT / "CHANGELOG.md"]


def test_figures_are_quoted_as_told():
    assert verify.misquoted(verify.figures(), DOCUMENTS) == []


def test_every_figure_is_quoted_and_can_be_measured():
    quoted = {name for _, name, _ in verify.quotes(DOCUMENTS)}
    for figure in verify.figures():
        assert figure.name in quoted
        assert re.compile(figure.find).groups == 1
        assert figure.holds[0] < figure.holds[1]
        if figure.told != verify.UNKNOWN:
            float(figure.told)


def test_readme_is_short():
    assert len((ROOT / "README.md").read_text(encoding="utf-8").splitlines()) <= 120


def test_every_table_of_measurements_has_command_and_state():
    text = (ROOT / "docs" / "measurements.md").read_text(encoding="utf-8")
    for section in re.split(r"^## ", text, flags=re.M)[1:]:
        assert re.search(r"^    python -m (bench|generator) ", section, flags=re.M), section
        assert re.search(r"^State: ", section, flags=re.M), section


@pytest.mark.parametrize("path", DOCUMENTS, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_links_lead_somewhere(path):
    text = path.read_text(encoding="utf-8")
    for target, _, anchor in (link.partition("#") for link in re.findall(r"\]\(([^)\s]+)\)", text)):
        if target.startswith("http"):
            continue
        found = (path.parent / target) if target else path
        assert found.exists(), target
        if anchor:
            headings = re.findall(r"^#+ (.*)", found.read_text(encoding="utf-8"), flags=re.M)
            assert anchor in {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}, (
                anchor
            )


@pytest.mark.parametrize("path", [*DOCUMENTS, ROOT / "justfile"], ids=lambda path: path.name)
def test_commands_exist(path):
    known = next(action.choices for action in _parser()._actions if hasattr(action.choices, "keys"))
    named = re.findall(r"python -m bench ([a-z][a-z-]*)", path.read_text(encoding="utf-8"))
    assert set(named) <= set(known)


def test_wrong_quotations_are_found_and_put_right(tmp_path):
    page = tmp_path / "page.md"
    page.write_text(
        "It takes <!-- figure: pattern_time -->.9 or <!-- figure: pattern_all --> or <!-- figure: none -->1."
    )
    known = verify.figures()
    told = {figure.name: figure.told for figure in known}
    assert len(verify.misquoted(known, [page])) == 3
    verify.quote(known, [page])
    assert f"pattern_time -->{told['pattern_time']} or" in page.read_text()
    assert f"pattern_all -->{told['pattern_all']} or" in page.read_text()
    assert [line.split()[2] for line in verify.misquoted(known, [page])] == ["none"]


def test_figures_are_measured_anew(monkeypatch):
    figure = verify.Figure("one", "What it is", ".5", "long", "now", "generator --help", r"(\d+) worlds", (0.4, 0.6))
    monkeypatch.setattr(verify, "figures", lambda: [figure])
    monkeypatch.setattr(verify, "documents", list)
    ran = []
    monkeypatch.setattr(verify, "_output", lambda quick: "0 worlds")
    with pytest.raises(ValueError, match="one does not hold: What it is"):
        verify.report([], ran.append)
    assert ran == ["generator --help"]
    with pytest.raises(ValueError, match="no figure two; there are one"):
        verify.report(["two"], ran.append)


def test_output_of_a_quick_command_is_read():
    assert verify.report(["pattern_time"], print).splitlines()[-1].endswith("yes")
