"""The PDF report: the same tables as the HTML page and printed figures, set by typst, the same bytes for the same result."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import typst
from matplotlib.figure import Figure

from identify.reports import figures, frf_figure, measurement_tables, pick, robot_figure, tables
from identify.reports.cells import Table, count, listed
from identify.results import FrfComparison, MeasurementResult, Result

_TEMPLATE = Path(__file__).parent / "report.typ"
_WORST_ROWS = 10


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


def document(result: Result) -> bytes:
    """The PDF of a fit."""
    made = Document()
    with figures.style():
        _opening(made, result)
        _parameters(made, result)
        _modes(made, result)
        _frfs(made, result)
        _search(made, result)
    _sources(made, result)
    head = {"name": result.name, "kind": result.kind, "written": result.provenance.written, "version": result.provenance.identify}
    data = json.dumps({**head, "blocks": made.blocks}).encode()
    files: Any = {"main.typ": _TEMPLATE.read_bytes(), "data.json": data, **made.files}
    return bytes(typst.compile(files, format="pdf", ignore_system_fonts=True))


def _opening(made: Document, result: Result) -> None:
    for sentence in result.verdict:
        made.add("lead", sentence)
    for note in result.notes:
        made.add("warning", note)
    made.blocks.append({"kind": "tiles", "items": tables.tiles(result)})
    made.add("paragraph", f"Model: {'; '.join(result.effects)}.")
    made.table(measurement_tables.measurement_table(result))
    measurements = list(result.measurements.values())
    drawn = measurements[: robot_figure.POSTURES]
    first = "" if drawn == measurements else f" The first {len(drawn)} of {len(measurements)} postures."
    made.figure(robot_figure.postures(measurements), f"The robot with its measurement points; floor grid 0.5 m.{first}")


def _parameters(made: Document, result: Result) -> None:
    made.add("heading", "Parameters")
    made.table(tables.parameter_table(result))
    made.figure(figures.parameters(result), "Start and fitted values between their bounds, and the size of the 95 % intervals.")
    for table in (tables.profile_table(result), tables.published_table(result)):
        if table is not None:
            made.table(table, heading=True)
    if result.profiles:
        made.figure(
            figures.profiles(result), "Profile likelihood: rise of chi-square with all other parameters fitted again; dotted: 3.84."
        )


def _modes(made: Document, result: Result) -> None:
    made.add("heading", "Modes")
    measurements = list(result.measurements.values())
    for m in measurements:
        made.table(measurement_tables.mode_table(m), heading=True)
    published = tables.published_modes_table(result)
    if published is not None:
        made.table(published, heading=True)
    mac = figures.mac(measurements)
    if mac is not None:
        made.figure(mac, "Modal assurance criterion (MAC) of measured and model modes.")
    first = measurements[0]
    caption = f"Modes of the model, {first.name}: at rest (grey) and at both ends of the motion, enlarged"
    caption += "; rings: measured." if first.pairs and first.pairs.measured_shapes is not None else "."
    made.figure(robot_figure.shapes(first), caption)


def _frfs(made: Document, result: Result) -> None:
    found = [(m, m.frf) for m in result.measurements.values() if m.frf is not None]
    if not found:
        return
    made.add("heading", "Frequency response functions")
    made.table(measurement_tables.error_table(result))
    for m, frf in found:
        made.add("subheading", f"{m.name}, {measurement_tables.use(m)}")
        made.figure(frf_figure.overlays(frf), _chosen(m, frf))
        worst = measurement_tables.frf_table(m)
        if worst is not None:
            made.add("paragraph", f"The {min(_WORST_ROWS, len(worst.rows))} FRFs of {m.name} with the largest error, of {len(worst.rows)}:")
            made.table(worst.head(_WORST_ROWS))
    made.add("heading", "Where the model disagrees")
    for m, frf in found:
        made.figure(figures.gap_map(m, frf), f"Residual by band and FRF, {m.name}.")


def _chosen(m: MeasurementResult, frf: FrfComparison) -> str:
    by = "relative error" if frf.gap is None else "gap"
    pairs = pick.shown_frfs(frf)
    drive = sum(pick.is_drive_point(frf, pair) for pair in pairs)
    parts = [count(drive, "drive point")] if drive else []
    if drive < len(pairs):
        parts.append(f"the {len(pairs) - drive} other FRFs with the largest {by}")
    return f"{m.name}: {frf.quantity}, {measurement_tables.band(frf)}; {listed(parts)}."


def _search(made: Document, result: Result) -> None:
    made.add("heading", "Convergence")
    made.figure(
        figures.convergence(result),
        "Best cost over evaluations; solid, dashed, dotted: first, second, third stage, which may have costs of their own.",
    )
    made.table(tables.start_table(result))
    made.add("heading", "Identifiability")
    groups = "; ".join(result.inseparable)
    made.add("paragraph", f"Not separable by these data: {groups}." if groups else "The data separate all free parameters.")
    made.table(tables.direction_table(result))


def _sources(made: Document, result: Result) -> None:
    made.add("heading", "What was asked")
    made.add("code", result.provenance.config)
    made.add("heading", "Provenance")
    made.table(tables.provenance_table(result))
