"""The PDF of a report: the blocks that `report.typ` sets, figures, and all tables; set by Typst in the
fonts of figures and no others, so that it looks the same everywhere.

It also keeps its figures, its tables with all their rows, and the numbers behind the figures, for export.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typst

from identify.reports.kit import figures
from identify.reports.kit.cells import Curves, Table, sentence
from identify.reports.kit.report import (
    GAP,
    PRINT,
    Bullets,
    Code,
    Drawing,
    Heading,
    Part,
    Report,
    Tabular,
    speaks_of_gap,
    visible,
)
from identify.results.header import Header

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_TEMPLATE = Path(__file__).parents[1] / "assets" / "report.typ"


@dataclass(frozen=True)
class Drawn:
    """A figure of the document: where it stands, as SVG with text in `figures.fonts`, as it can be drawn
    again, and the numbers behind it.
    """

    title: str
    svg: bytes
    figure: Figure
    data: tuple[Table | Curves, ...]


class Document:
    """A page description in the making: blocks in reading order, figures, and all tables."""

    def __init__(self) -> None:
        self.blocks: list[dict[str, Any]] = []
        self.drawn: list[Drawn] = []
        self.tables: list[Table] = []
        self._under = ""

    def add(self, kind: str, text: str) -> None:
        """A block of text: heading, subheading, paragraph, lead, warning or code."""
        if kind in ("heading", "subheading"):
            self._under = text
        self.blocks.append({"kind": kind, "text": text})

    def table(self, table: Table, heading: bool = False, rows: int | None = None) -> None:
        """A table, with its title where asked; rows: how many of them are printed, all are exported."""
        self.tables.append(table)
        columns = [{"heading": c.heading, "unit": c.unit, "numeric": c.numeric} for c in table.columns]
        shown = {"rows": table.rows[:rows], "columns": columns, "note": table.note}
        if rows != 0:
            self.blocks.append({"kind": "table", "title": table.title if heading else "", **shown})
        if rows is not None and len(table.rows) > rows:
            some = (
                f"The first {rows} of {len(table.rows)} rows; all" if rows else f"All {len(table.rows)} rows"
            )
            self.add("paragraph", f"{some} are on the HTML page and in the exported tables.")

    def figure(self, figure: Figure, caption: str, *data: Table | Curves) -> None:
        """A figure at its own size; data: the numbers behind it, where the tables do not have them."""
        self.drawn.append(Drawn(self._under, figures.svg(figure), figure, data))
        file = f"figure{len(self.drawn)}.svg"
        self.blocks.append(
            {"kind": "figure", "file": file, "width": float(figure.get_figwidth()), "caption": caption}
        )

    def compile(self, result: Header) -> bytes:
        """The PDF."""
        head = {
            "name": result.name,
            "kind": result.kind,
            "written": result.provenance.written,
            "version": result.provenance.identify,
        }
        data = json.dumps({**head, "blocks": self.blocks}).encode()
        drawn = {f"figure{number}.svg": one.svg for number, one in enumerate(self.drawn, 1)}
        return pdf({"main.typ": _TEMPLATE.read_bytes(), "data.json": data, **drawn})


def document(result: Header, report: Report) -> Document:
    """The PDF of a report, in the making."""
    made = Document()
    for said in result.verdict:
        made.add("lead", said)
    for note in result.notes:
        made.add("warning", sentence(note))
    made.blocks.append({"kind": "tiles", "items": report.tiles})
    if speaks_of_gap(report):
        made.add("paragraph", GAP)
    with figures.style():
        _add(made, visible(report.opening, PRINT))
        for section in report.sections:
            parts = visible(section.parts, PRINT)
            if parts:
                made.add("heading", section.title)
                _add(made, parts)
    return made


def _add(made: Document, parts: Sequence[Part]) -> None:
    for part in parts:
        if isinstance(part, Tabular):
            made.table(part.table, part.heading, part.rows)
        elif isinstance(part, Drawing) and part.figure is not None:
            made.figure(part.figure(), part.caption, *part.data())
        elif isinstance(part, Bullets):
            for text in part.items:
                made.add("paragraph", text)
        elif isinstance(part, Heading):
            made.add("subheading", part.text)
        elif isinstance(part, Code):
            made.add("code", part.text)
        else:
            made.add("paragraph", part.text)  # type: ignore[union-attr]


def pdf(files: dict[str, bytes]) -> bytes:
    """`main.typ` set with what it names among the files."""
    return _compiled(files, format="pdf")


def png(svg: bytes, width_in: float, height_in: float, dpi: float) -> bytes:
    """A figure of that size (inches) as a picture: the same drawing as in the PDF, in a third of the time
    that it takes to draw the figure once more.
    """
    page = f'#set page(width: {width_in}in, height: {height_in}in, margin: 0pt)\n#image("figure.svg")'
    return _compiled({"main.typ": page.encode(), "figure.svg": svg}, format="png", ppi=dpi)


def _compiled(files: dict[str, bytes], **form: Any) -> bytes:
    return bytes(typst.compile(files, font_paths=_fonts(), **form))


@cache
def _fonts() -> typst.Fonts:
    """Looked for once."""
    return typst.Fonts(include_system_fonts=False, font_paths=[str(figures.fonts())])
