"""A PDF in the making: what `report.typ` sets, and the blocks that all kinds of results share."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import typst
from matplotlib.figure import Figure

from identify.modes_result import ModesResult
from identify.reports import figures
from identify.reports.cells import Table, sentence
from identify.reports.tables import provenance_table
from identify.results import Result

_TEMPLATE = Path(__file__).parent / "report.typ"


class Document:
    """A page description in the making: blocks in reading order, and the files of its figures."""

    def __init__(self) -> None:
        self.blocks: list[dict[str, Any]] = []
        self.files: dict[str, bytes] = {}

    def add(self, kind: str, text: str, **more: Any) -> None:
        """A block of text: heading, paragraph, warning or code."""
        self.blocks.append({"kind": kind, "text": text, **more})

    def table(self, table: Table, heading: bool = False) -> None:
        """A table, with its title where asked."""
        columns = [{"heading": c.heading, "unit": c.unit, "numeric": c.numeric} for c in table.columns]
        title = table.title if heading else ""
        self.blocks.append({"kind": "table", "title": title, "columns": columns, "rows": table.rows, "note": table.note})

    def figure(self, figure: Figure, caption: str) -> None:
        """A figure at its own size."""
        name = f"figure{len(self.files)}.svg"
        self.files[name] = figures.svg(figure)
        self.blocks.append({"kind": "figure", "file": name, "width": float(figure.get_figwidth()), "caption": caption})

    def opening(self, result: Result | ModesResult, tiles: tuple[tuple[str, str, str], ...]) -> None:
        """Verdict, notes and tiles."""
        for said in result.verdict:
            self.add("lead", said)
        for note in result.notes:
            self.add("warning", sentence(note))
        self.blocks.append({"kind": "tiles", "items": tiles})

    def sources(self, result: Result | ModesResult) -> None:
        """What was asked, and provenance."""
        self.add("heading", "What was asked")
        self.add("code", result.provenance.config)
        self.add("heading", "Provenance")
        self.table(provenance_table(result))

    def compile(self, result: Result | ModesResult) -> bytes:
        """The PDF."""
        head = {"name": result.name, "kind": result.kind, "written": result.provenance.written, "version": result.provenance.identify}
        data = json.dumps({**head, "blocks": self.blocks}).encode()
        files: Any = {"main.typ": _TEMPLATE.read_bytes(), "data.json": data, **self.files}
        return bytes(typst.compile(files, format="pdf", ignore_system_fonts=True))
