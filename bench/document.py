# SPDX-License-Identifier: GPL-3.0-or-later
"""Parts of a report, and the page they make: plain HTML, one file with its pictures inside."""

import base64
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path
from string import Template

from bench.table import table

TEMPLATE = Path(__file__).with_name("report.html")


@dataclass(frozen=True)
class Heading:
    """A section's title and what to know before its figures."""

    title: str
    text: str = ""

    def __str__(self) -> str:
        return f"{self.title}\n{'=' * len(self.title)}\n{self.text}".rstrip()

    def html(self) -> str:
        return f"<h2>{escape(self.title)}</h2>\n" + "".join(
            f"<p>{escape(text)}</p>\n" for text in self.text.splitlines()
        )


@dataclass(frozen=True)
class Table:
    """Figures; the first column names the row."""

    caption: str
    header: Sequence[str]
    rows: Sequence[Sequence[str]]

    def __str__(self) -> str:
        return f"{self.caption}\n{table(self.header, self.rows)}"

    def html(self) -> str:
        def line(cells: Sequence[str], kind: str) -> str:
            first, *others = map(escape, cells)
            return f"<tr><th>{first}</th>{''.join(f'<{kind}>{cell}</{kind}>' for cell in others)}</tr>\n"

        body = "".join(line(row, "td") for row in self.rows)
        caption = f"<caption>{escape(self.caption)}</caption>"
        return f'<div class="wide"><table>{caption}<thead>{line(self.header, "th")}</thead>{body}</table></div>\n'

    def markdown(self) -> str:
        """Return the table as README shows it."""
        lines = [self.header, ["---"] * len(self.header), *self.rows]
        return "\n".join("| " + " | ".join(cells) + " |" for cells in lines)


@dataclass(frozen=True)
class Pictures:
    """Small pictures in rows and columns, each shown with its own pixels."""

    caption: str
    columns: Sequence[str]
    rows: Sequence[tuple[str, Sequence[Path]]]

    def __str__(self) -> str:
        return f"{self.caption}: {', '.join(path.name for _, paths in self.rows for path in paths)}"

    def html(self) -> str:
        cells = "".join(
            f'<figure><img class="pixels" src="{_embedded(path)}" alt="{escape(f"{row} {column}")}">'
            f"<figcaption>{escape(f'{row} {column}'.strip())}</figcaption></figure>\n"
            for row, paths in self.rows
            for column, path in zip(self.columns, paths, strict=True)
        )
        title = f"<h3>{escape(self.caption)}</h3>\n" if self.caption else ""
        return f'{title}<div class="grid" style="--columns:{len(self.columns)}">{cells}</div>\n'


@dataclass(frozen=True)
class Plot:
    """One picture as wide as the page."""

    caption: str
    path: Path

    def __str__(self) -> str:
        return f"{self.caption}: {self.path.name}"

    def html(self) -> str:
        return (
            f'<figure class="plot"><img src="{_embedded(self.path)}" alt="{escape(self.caption)}">'
            f"<figcaption>{escape(self.caption)}</figcaption></figure>\n"
        )


Part = Heading | Table | Pictures | Plot


def page(title: str, parts: Sequence[Part]) -> str:
    """Return the page."""
    body = "".join(part.html() for part in parts)
    return Template(TEMPLATE.read_text(encoding="utf-8")).substitute(title=escape(title), body=body)


def _embedded(path: Path) -> str:
    return f"data:image/png;base64,{base64.b64encode(path.read_bytes()).decode()}"
