# SPDX-License-Identifier: GPL-3.0-or-later
"""Parts of a report, and the page they make: plain HTML, one file with its pictures inside."""

import base64
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path
from string import Template

import matplotlib.pyplot as plt

from bench.table import table

TEMPLATE = Path(__file__).with_name("report.html")

#: Dots an inch of plots, which the page shows at 96: two for each of its pixels, so that they are sharp on phones too.
DPI = 192

#: The page's inner width in pixels, the gap between pictures, and the most that one of them is enlarged to.
_WIDTH, _GAP, _LARGEST = 1056, 8, 340


@dataclass(frozen=True)
class Heading:
    """A section's title and what to know before its figures."""

    title: str
    text: str = ""

    @property
    def anchor(self) -> str:
        """What links to it name."""
        return "".join(letter if letter.isalnum() else "-" for letter in self.title.lower())

    def __str__(self) -> str:
        return f"{self.title}\n{'=' * len(self.title)}\n{self.text}".rstrip()

    def html(self) -> str:
        return f'<h2 id="{self.anchor}">{escape(self.title)}</h2>\n{_paragraphs(self.text)}'


@dataclass(frozen=True)
class Table:
    """Figures; the first column names the row."""

    caption: str
    header: Sequence[str]
    rows: Sequence[Sequence[str]]

    def __str__(self) -> str:
        return f"{self.caption}\n{table(self.header, self.rows)}"

    def html(self) -> str:
        # Numbers stand one below the other, words begin at the left.
        classes = [' class="words"' if any(map(_is_words, column)) else "" for column in zip(*self.rows, strict=True)]
        header = "".join(
            f'<th scope="col"{kind}>{escape(cell)}</th>' for cell, kind in zip(self.header, classes, strict=True)
        )
        cells = (
            "".join(f"<td{kind}>{_breakable(cell)}</td>" for cell, kind in zip(row[1:], classes[1:], strict=True))
            for row in self.rows
        )
        body = "".join(
            f'<tr><th scope="row">{_breakable(row[0])}</th>{rest}</tr>\n'
            for row, rest in zip(self.rows, cells, strict=True)
        )
        # The caption stands outside of what scrolls sideways, so that it is as wide as the page and stays.
        return (
            f'<figure class="table"><figcaption>{escape(self.caption)}</figcaption>\n'
            f'<div class="wide" tabindex="0"><table><thead><tr>{header}</tr></thead>\n{body}</table></div></figure>\n'
        )

    def markdown(self) -> str:
        """Return the table as Markdown."""
        lines = [self.header, ["---"] * len(self.header), *self.rows]
        return "\n".join("| " + " | ".join(cells) + " |" for cells in lines)


@dataclass(frozen=True)
class Pictures:
    """Small square pictures of one size, with a label each, in rows of one length.

    They are enlarged by a whole number where there is room, and stand two by two on phones.
    """

    caption: str
    rows: Sequence[Sequence[tuple[str, Path]]]

    def __str__(self) -> str:
        return f"{self.caption}: {', '.join(path.name for row in self.rows for _, path in row)}"

    def html(self) -> str:
        columns = len(self.rows[0])
        edge = plt.imread(self.rows[0][0][1]).shape[1]
        shown = edge * max(1, min(_WIDTH // columns - _GAP, _LARGEST) // edge)
        figures = "\n".join(self._figure(*one) for row in self.rows for one in row)
        style = f"--columns:{columns};--edge:{shown}px"
        return f'<h3>{escape(self.caption)}</h3>\n<div class="pictures" style="{style}">{figures}</div>\n'

    def _figure(self, label: str, path: Path) -> str:
        image = f'<img src="{_embedded(path)}" alt="{escape(f"{self.caption}; {label}")}">'
        return f"<figure>{image}<figcaption>{escape(label)}</figcaption></figure>"


@dataclass(frozen=True)
class Plot:
    """One picture with `DPI` dots an inch."""

    caption: str
    path: Path

    def __str__(self) -> str:
        return f"{self.caption}: {self.path.name}"

    def html(self) -> str:
        width = round(plt.imread(self.path).shape[1] * 96 / DPI)
        return (
            f'<figure class="plot"><div class="wide" tabindex="0"><img style="--width:{width}px" '
            f'src="{_embedded(self.path)}" alt="{escape(self.caption)}"></div>'
            f"<figcaption>{escape(self.caption)}</figcaption></figure>\n"
        )


Part = Heading | Table | Pictures | Plot


def page(title: str, summary: str, parts: Sequence[Part]) -> str:
    """Return the page: title, summary, links to the parts' headings, parts."""
    headings = [part for part in parts if isinstance(part, Heading)]
    links = " · ".join(f'<a href="#{part.anchor}">{escape(part.title)}</a>' for part in headings)
    return Template(TEMPLATE.read_text(encoding="utf-8")).substitute(
        title=escape(title), summary=_paragraphs(summary), links=links, body="".join(part.html() for part in parts)
    )


def _is_words(text: str) -> bool:
    return not (text[:1] in "~-" or text[:1].isdigit() or text == "inf")


def _breakable(name: str) -> str:
    """Return a name as HTML that may go on in the next line after an underscore."""
    return escape(name).replace("_", "_<wbr>")


def _paragraphs(text: str) -> str:
    return "".join(f"<p>{escape(line)}</p>\n" for line in text.splitlines())


def _embedded(path: Path) -> str:
    return f"data:image/png;base64,{base64.b64encode(path.read_bytes()).decode()}"
