"""A PDF in the making: what `report.typ` sets, and the blocks that all kinds of results share.

It also keeps its figures, its tables with all their rows, and the numbers behind the figures, for `export`.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import typst
from matplotlib.figure import Figure

from identify.reports.fit.tables import provenance_table
from identify.reports.kit import figures
from identify.reports.kit.cells import Curves, Table, sentence
from identify.reports.kit.settings import default_table, given_table
from identify.results.header import Header

_TEMPLATE = Path(__file__).parents[1] / "assets" / "report.typ"


@dataclass(frozen=True)
class Drawn:
    """A figure of the document: where it stands, as SVG, as it can be drawn again, and the numbers behind
    it.
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

    def add(self, kind: str, text: str, **more: Any) -> None:
        """A block of text: heading, subheading, paragraph, lead, warning or code."""
        if kind in ("heading", "subheading"):
            self._under = text
        self.blocks.append({"kind": kind, "text": text, **more})

    def table(self, table: Table, heading: bool = False, rows: int | None = None) -> None:
        """A table, with its title where asked; rows: how many of them are printed, all are exported."""
        self.tables.append(table)
        columns = [{"heading": c.heading, "unit": c.unit, "numeric": c.numeric} for c in table.columns]
        title = table.title if heading else ""
        self.blocks.append(
            {
                "kind": "table",
                "title": title,
                "columns": columns,
                "rows": table.rows[:rows],
                "note": table.note,
            }
        )

    def figure(self, figure: Figure, caption: str, *data: Table | Curves) -> None:
        """A figure at its own size; data: the numbers behind it, where the tables do not have them."""
        self.drawn.append(Drawn(self._under, figures.svg(figure), figure, data))
        file = f"figure{len(self.drawn)}.svg"
        self.blocks.append(
            {"kind": "figure", "file": file, "width": float(figure.get_figwidth()), "caption": caption}
        )

    def opening(self, result: Header, tiles: tuple[tuple[str, str, str], ...]) -> None:
        """Verdict, notes and tiles."""
        for said in result.verdict:
            self.add("lead", said)
        for note in result.notes:
            self.add("warning", sentence(note))
        self.blocks.append({"kind": "tiles", "items": tiles})

    def sources(self, result: Header) -> None:
        """What was asked, with the source of each value, and provenance."""
        if result.provenance.config:
            self.add("heading", "What was asked")
            self.add("code", result.provenance.config)
        for settings in (given_table(result.provenance), default_table(result.provenance)):
            if settings is not None:
                self.table(settings, heading=True)
        self.add("heading", "Provenance")
        self.table(provenance_table(result))

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
        files: Any = {"main.typ": _TEMPLATE.read_bytes(), "data.json": data, **drawn}
        return bytes(typst.compile(files, format="pdf", ignore_system_fonts=True))
