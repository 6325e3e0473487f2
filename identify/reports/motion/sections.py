"""The report of a motion: the records, their histories, circular tests, errors and fitted parameters."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from identify.reports.fit.tables import PARAMETERS_TERMINAL, parameter_rows
from identify.reports.kit.cells import Column, Curves, Table
from identify.reports.kit.circle_figure import circles
from identify.reports.kit.report import (
    EVERYWHERE,
    Drawing,
    Part,
    Pickers,
    Report,
    Section,
    Tabular,
    Text,
    origin,
)
from identify.reports.motion import tables
from identify.reports.motion.figure import histories
from identify.reports.motion.pick import Panel, moving, panels
from identify.results.circular import CircularTest
from identify.results.motion import MotionResult, RecordResult

_PICKERS = (("Record", "motion-record", ()), ("Joint", "motion-joint", ()))


def report(result: MotionResult) -> Report:
    """What is said of a motion."""
    opening: list[Part] = [
        Text(f"Model: {'; '.join(result.effects)}.", "effects"),
        Tabular(tables.record_table(result)),
    ]
    trials = tables.trial_table(result)
    if trials is not None:
        opening.append(_everywhere(trials))
    sections = [Section("motion", "Motion", _motion(result), data=_data(result), scripts=("motion.js",))]
    circular: list[Part] = [
        _everywhere(table, f"circle-{k}") for k, table in enumerate(tables.circle_tables(result))
    ]
    for record in result.records.values():
        if record.circles is not None:
            caption = f"{record.name}: radial errors enlarged about the mean circle."
            data = partial(_radial, record.circles)
            circular.append(Drawing("", partial(circles, record.circles), caption, data))
    errors = [_everywhere(table, f"rms-{k}") for k, table in enumerate(tables.rms_tables(result))]
    sections += [Section("circles", "Circular tests", circular), Section("errors", "Errors", errors)]
    if result.parameters is not None:
        fitted = parameter_rows(result.parameters)
        shown = Tabular(fitted, sort="parameters", terminal=PARAMETERS_TERMINAL, on=EVERYWHERE)
        sections.append(Section("parameters", "Parameters", [shown]))
    return Report(tables.tiles(result), opening, [*sections, *origin(result)])


def _everywhere(table: Table, sort: str = "") -> Tabular:
    return Tabular(table, heading=True, sort=sort, on=EVERYWHERE)


def _motion(result: MotionResult) -> list[Part]:
    """The page shows one record and one joint at a time, the PDF the joint that turns farthest."""
    parts: list[Part] = [Pickers(_PICKERS), Drawing("motion-plot")]
    for record in result.records.values():
        joint = moving(record)
        caption = f"{_name(record)}: {result.joints[joint]}."
        parts.append(Drawing("", partial(histories, record, joint), caption, partial(_curves, record, joint)))
    return parts


def _name(record: RecordResult) -> str:
    return record.name + (", not fitted" if record.use == "validate" else "")


def _data(result: MotionResult) -> dict[str, Any]:
    records = [
        {"name": _name(one), "moving": moving(one), "panels": [_panel(panel) for panel in panels(one)]}
        for one in result.records.values()
    ]
    return {"joints": list(result.joints), "records": records}


def _panel(panel: Panel) -> dict[str, Any]:
    curves = [{"name": curve.name, "time": curve.time, "values": curve.values.T} for curve in panel.curves]
    return {"label": panel.label, "unit": panel.unit, "curves": curves}


def _curves(record: RecordResult, joint: int) -> list[Curves]:
    """The numbers behind the figure: a set per curve."""
    return [
        Curves(
            f"{record.name}, {panel.label.lower()}, {curve.name}",
            (Column("Time", "s"), Column(panel.label, panel.unit)),
            np.column_stack([curve.time, curve.values[:, joint]]),
        )
        for panel in panels(record)
        for curve in panel.curves
    ]


def _radial(tests: dict[str, CircularTest]) -> list[Curves]:
    columns = (Column("Angle", "°"), Column("Radial error", "µm"))
    return [
        Curves(f"Circular test, {name}", columns, np.column_stack([np.degrees(test.angle), 1e6 * test.error]))
        for name, test in tests.items()
    ]
