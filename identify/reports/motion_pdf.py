"""The PDF report of a motion: the same tables as its HTML page, and printed time histories."""

from __future__ import annotations

import numpy as np

from identify.motion_result import MotionResult, RecordResult
from identify.reports import figures, motion_figure, motion_tables
from identify.reports.cells import Column, Curves
from identify.reports.document import Document
from identify.reports.motion_pick import moving, panels
from identify.reports.tables import parameter_rows


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


def _motions(made: Document, result: MotionResult) -> None:
    made.add("heading", "Motion")
    for record in result.records.values():
        joint = moving(record)
        use = ", not fitted" if record.use == "validate" else ""
        made.figure(motion_figure.histories(record, joint), f"{record.name}{use}: {result.joints[joint]}.", *_curves(record, joint))


def _curves(record: RecordResult, joint: int) -> list[Curves]:
    """The numbers behind the figure: a set per curve."""
    found = []
    for panel in panels(record):
        for curve in panel.curves:
            columns = (Column("Time", "s"), Column(panel.label, panel.unit))
            title = f"{record.name}, {panel.label.lower()}, {curve.name}"
            found.append(Curves(title, columns, np.column_stack([curve.time, curve.values[:, joint]])))
    return found
