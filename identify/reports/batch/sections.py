"""The report of a batch: what depends on posture, trends and maps, the fits and their parameters."""

from __future__ import annotations

import numpy as np

from identify.reports.batch import tables
from identify.reports.kit.posture_pick import Postures, batch_postures
from identify.reports.kit.posture_section import maps, modes, pictures, posture_data, trends
from identify.reports.kit.report import EVERYWHERE, PRINT, Heading, Part, Report, Section, Tabular, origin
from identify.results.batch import BatchResult

_PANELS = 18
_WORST_ROWS, _FAILURES = 30, 60
_NOTE = (
    "Dots: each posture on its own, with its 95 % interval. Orange: the weighted mean of all postures and its"
    " 95 % interval. Crosses are not counted: not determined there, or at a bound. Values by posture are in"
    " the table of parameters below, and in the file of each fit."
)
_TRENDS = (
    "Parameters of each posture on its own, with 95 % intervals, over the joint they change with; orange: the"
    " weighted mean; crosses: not counted."
)
_ERRORS = (
    "Errors by posture; frequency and damping errors are those of the modes that are paired with measured"
    " ones."
)


def report(result: BatchResult) -> Report:
    """What is said of a batch."""
    postures = batch_postures(result)
    data = {"postures": posture_data(postures, _first(result))}
    sections = [
        Section("dependence", "Does a parameter depend on posture?", _dependence(result), "Dependence"),
        Section(
            "postures", "Trends and maps", _postures(result, postures), data=data, scripts=("postures.js",)
        ),
        Section("fits", "Fits", _fits(result)),
        Section(
            "values",
            "Parameters by posture",
            [Tabular(tables.value_table(result), sort="values", limit=20, rows=0)],
            "Parameters",
        ),
    ]
    return Report(tables.tiles(result), (), [*sections, *origin(result, "Batch")])


def _dependence(result: BatchResult) -> list[Part]:
    brief = ("Parameter", "Mean", "Unit", "Scatter", "p", "Postures", "Verdict")
    return [
        Tabular(tables.dependence_table(result), sort="dependence", terminal=brief, on=EVERYWHERE),
        Tabular(tables.trend_table(result), heading=True, sort="trends"),
    ]


def _fits(result: BatchResult) -> list[Part]:
    failures = tables.failure_table(result)
    failed = [Tabular(failures, heading=True, rows=_FAILURES, on=EVERYWHERE)] if failures else []
    return [*failed, Tabular(tables.job_table(result), heading=True, sort="fits", limit=20, rows=_WORST_ROWS)]


def _postures(result: BatchResult, postures: Postures) -> list[Part]:
    """The plots of the page; in the PDF trends, modes, errors and maps."""
    parts = pictures(_NOTE)
    parameters, errors = postures.of("parameter")[:_PANELS], postures.of("error")
    if parameters:
        parts.append(trends(postures, parameters, _TRENDS))
    parts += [Heading("Modes and errors", on=PRINT), *modes(postures, "of the fitted models")]
    if errors:
        parts.append(trends(postures, errors[-_PANELS:], _ERRORS))
    if postures.varied:
        depends = [one for one in postures.of("parameter") if one.name in _dependent(result)][:3]
        gap = [one for one in errors if one.name == "gap"]
        parts.append(Heading("Maps of the postures", on=PRINT))
        parts += maps(postures, [*depends, *postures.of("frequency")[:1], *gap])
    return parts


def _first(result: BatchResult) -> str:
    """The quantity to show first: the parameter that depends on posture most, or the first one."""
    d = result.dependence
    scatter = np.where(d.depends, np.nan_to_num(d.scatter, nan=-1.0), -1.0)
    return d.parameter[int(np.argmax(scatter))] if len(d.parameter) else ""


def _dependent(result: BatchResult) -> list[str]:
    d = result.dependence
    return [name for name, depends in zip(d.parameter, d.depends, strict=True) if depends]
