"""The PDF report of a modal analysis: the same tables as its HTML page, and printed figures."""

from __future__ import annotations

from identify.reports.fit import data
from identify.reports.fit.pdf import overlays
from identify.reports.kit import figures, robot_figure
from identify.reports.kit.document import Document
from identify.reports.kit.shapes import analysed_views
from identify.reports.modes import figure as modes_figure
from identify.reports.modes import tables as modes_tables
from identify.reports.modes.html import NO_SHAPES
from identify.results.modes import ModesResult

_REJECTED_ROWS = 40


def document(result: ModesResult) -> Document:
    """The PDF of a modal analysis, in the making."""
    made = Document()
    with figures.style():
        made.opening(result, modes_tables.tiles(result))
        made.table(modes_tables.measurement_table(result))
        _modes(made, result)
        _diagrams(made, result)
        _frfs(made, result)
        _rejected(made, result)
    made.sources(result)
    return made


def _modes(made: Document, result: ModesResult) -> None:
    made.add("heading", "Modes")
    for m in result.measurements.values():
        made.table(modes_tables.mode_table(m), heading=True)
        if len(m.modes.frequency_hz) > 1:
            hz = m.modes.frequency_hz
            matrix = figures.Mac(m.name, m.modes.auto_mac, hz, hz, "Mode (Hz)", "Mode (Hz)")
            auto = figures.mac([matrix])
            if auto is not None:
                made.figure(
                    auto,
                    "Modal assurance criterion of the shapes with each other (autoMAC).",
                    data.mac(matrix),
                )
    made.add("heading", "Mode shapes")
    moving = [m for m in result.measurements.values() if m.geometry is not None and analysed_views(m)]
    for m in moving:
        views = analysed_views(m)
        if m.geometry is not None:
            first = (
                f" The first {robot_figure.MODES} of {len(views)}." if len(views) > robot_figure.MODES else ""
            )
            caption = f"{m.name}: measured shapes, enlarged, at one end of the motion.{first}"
            made.figure(
                robot_figure.shapes(m.geometry, views),
                caption,
                data.shapes(m.geometry, views),
                data.geometry(m.name, m.geometry),
            )
    if not moving:
        made.add("paragraph", NO_SHAPES)


def _diagrams(made: Document, result: ModesResult) -> None:
    made.add("heading", "Stabilisation")
    for m in result.measurements.values():
        made.figure(
            modes_figure.stabilisation(m), f"{m.name}. {modes_tables.DIAGRAM_NOTE}", *data.stabilisation(m)
        )


def _frfs(made: Document, result: ModesResult) -> None:
    made.add("heading", "Measured and rebuilt FRFs")
    made.table(modes_tables.error_table(result))
    for m in result.measurements.values():
        made.add("subheading", m.name)
        overlays(made, m.name, m.frf, "rebuilt from the modes")
        made.figure(
            figures.gap_map(m.name, m.frf), f"Residual by band and FRF, {m.name}.", data.gap_map(m.frf)
        )
    checks = modes_tables.reciprocity_table(result)
    if checks is not None:
        made.table(checks, heading=True)


def _rejected(made: Document, result: ModesResult) -> None:
    made.add("heading", "Rejected candidates")
    for m in result.measurements.values():
        table = modes_tables.rejected_table(m)
        made.table(table, heading=True, rows=_REJECTED_ROWS)
        if len(table.rows) > _REJECTED_ROWS:
            made.add(
                "paragraph", f"The first {_REJECTED_ROWS} of {len(table.rows)}; all are on the HTML page."
            )
