"""The PDF report of a motion: the same tables as its HTML page, and printed time histories."""

from __future__ import annotations

import numpy as np

from identify.reports.fit.tables import parameter_rows
from identify.reports.kit import figures
from identify.reports.kit.cells import Column, Curves
from identify.reports.kit.circle_figure import circles
from identify.reports.kit.document import Document
from identify.reports.motion import figure as motion_figure
from identify.reports.motion import tables as motion_tables
from identify.reports.motion.pick import moving, panels
from identify.results.circular import CircularTest
from identify.results.motion import MotionResult, RecordResult


def document(result: MotionResult) -> Document:
    """The PDF of a motion, in the making."""
    made = Document()
    with figures.style():
        made.opening(result, motion_tables.tiles(result))
        made.add("paragraph", f"Model: {'; '.join(result.effects)}.")
        made.table(motion_tables.record_table(result))
        trials = motion_tables.trial_table(result)
        if trials is not None:
            made.table(trials, heading=True)
        _motions(made, result)
        for table in motion_tables.circle_tables(result):
            made.table(table, heading=True)
        for record in result.records.values():
            if record.circles is not None:
                made.figure(
                    circles(record.circles),
                    f"{record.name}: radial errors enlarged about the mean circle.",
                    *_errors(record.circles),
                )
        tables = motion_tables.rms_tables(result)
        if tables:
            made.add("heading", "Errors")
        for table in tables:
            made.table(table, heading=True)
        if result.parameters is not None:
            made.add("heading", "Parameters")
            made.table(parameter_rows(result.parameters))
    made.sources(result)
    return made


def _errors(tests: dict[str, CircularTest]) -> list[Curves]:
    columns = (Column("Angle", "°"), Column("Radial error", "µm"))
    parts = {
        name: np.column_stack([np.degrees(test.angle), 1e6 * test.error]) for name, test in tests.items()
    }
    return [Curves(f"Circular test, {name}", columns, rows) for name, rows in parts.items()]


def _motions(made: Document, result: MotionResult) -> None:
    made.add("heading", "Motion")
    for record in result.records.values():
        joint = moving(record)
        use = ", not fitted" if record.use == "validate" else ""
        made.figure(
            motion_figure.histories(record, joint),
            f"{record.name}{use}: {result.joints[joint]}.",
            *_curves(record, joint),
        )


def _curves(record: RecordResult, joint: int) -> list[Curves]:
    """The numbers behind the figure: a set per curve."""
    found = []
    for panel in panels(record):
        for curve in panel.curves:
            columns = (Column("Time", "s"), Column(panel.label, panel.unit))
            title = f"{record.name}, {panel.label.lower()}, {curve.name}"
            found.append(Curves(title, columns, np.column_stack([curve.time, curve.values[:, joint]])))
    return found
