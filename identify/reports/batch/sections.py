"""The report of a batch: what depends on posture, trends and maps, the fits and their parameters."""

from __future__ import annotations

import numpy as np

from identify.core.arrays import Array
from identify.reports.batch import tables
from identify.reports.kit.banded import Line, Panel, Plot
from identify.reports.kit.cells import Column
from identify.reports.kit.report import (
    EVERYWHERE,
    PRINT,
    Heading,
    Parts,
    Report,
    Section,
    Tabular,
    given,
    origin,
)
from identify.reports.shared.posture_pick import batch_postures
from identify.reports.shared.posture_section import maps, modes, pictures, posture_data, trends
from identify.results.batch import BatchResult, PopulationTable

_PANELS = 18
_WORST_ROWS, _FAILURES = 30, 60
_NOTE = (
    "Dots: each posture on its own, with its 95 % interval. Orange: the weighted mean of all postures and its"
    " 95 % interval. Crosses are not counted: not determined there, or at a bound. Values by posture are in"
    " the table of parameters below, and in the file of each fit."
)
_SCATTERS = 6
"""Parameters that are drawn, those that scatter most."""
_ABOUT = (
    "Each fit alone, and combined with all others, relative to the mean of all; the parameters that scatter"
    " most. Fits are numbered as in the table of parameters."
)
_TRENDS = (
    "Parameters of each posture on its own, with 95 % intervals, over the joint they change with, and the"
    " weighted mean; not counted: not determined there, or at a bound."
)
_ERRORS = (
    "Errors by posture; frequency and damping errors are those of the modes that are paired with measured"
    " ones."
)


def report(result: BatchResult) -> Report:
    """What is said of a batch."""
    together = [] if result.population is None else _population(result, result.population)
    values = Tabular(tables.value_table(result), sort="values", limit=20, rows=0)
    sections = [
        Section("dependence", "Does a parameter depend on posture?", _dependence(result), "Dependence"),
        Section("population", "All fits together", together, "Together"),
        Section("postures", "Trends and maps", _postures(result)),
        Section("fits", "Fits", _fits(result)),
        Section("values", "Parameters by posture", [values], "Parameters"),
        *origin(result, "Batch"),
    ]
    return Report(tables.tiles(result), (), sections)


def _population(result: BatchResult, p: PopulationTable) -> Parts:
    """Means and scatters, and the fits about the mean of the parameters that scatter most."""
    brief = ("Parameter", "Mean", "Unit", "±", "Scatter", "Fits", "Verdict")
    order = np.argsort(-np.nan_to_num(p.relative_scatter, nan=-1.0), kind="stable")
    shown = [int(k) for k in order if np.isfinite(p.scatter[k]) and p.mean[k]][:_SCATTERS]
    plot = Plot("population-plot", Column("Fit", "number"), [_about(result, p, k) for k in shown], _ABOUT)
    return [
        Tabular(tables.population_table(result, p), sort="population", terminal=brief, on=EVERYWHERE),
        plot.drawing() if shown else None,
        Tabular(tables.own_table(result, p), heading=True, sort="own", limit=20, rows=0),
    ]


def _about(result: BatchResult, p: PopulationTable, k: int) -> Panel:
    """A parameter of each fit about the mean, in per cent of it."""
    fits = np.arange(1.0, len(p.value) + 1)

    def off(values: Array) -> Array:
        return np.asarray(100 * (values / p.mean[k] - 1))

    spread = 100 * p.relative_scatter[k] * np.ones(len(fits))
    lines = [
        Line("mean of all, and scatter", fits, 0 * fits, -spread, spread),
        Line(
            "combined with all others, 95 %",
            fits,
            off(p.value[:, k]),
            off(p.low_95[:, k]),
            off(p.high_95[:, k]),
        ),
        Line("on its own", fits, off(result.parameters.value[:, k]), points=True),
    ]
    return Panel(Column(p.parameter[k], "% off the mean"), lines)


def _dependence(result: BatchResult) -> Parts:
    brief = ("Parameter", "Mean", "Unit", "Scatter", "p", "Postures", "Verdict")
    return [
        Tabular(tables.dependence_table(result), sort="dependence", terminal=brief, on=EVERYWHERE),
        Tabular(tables.trend_table(result), heading=True, sort="trends"),
    ]


def _fits(result: BatchResult) -> Parts:
    return [
        given(tables.failure_table(result), rows=_FAILURES, on=EVERYWHERE),
        Tabular(tables.job_table(result), heading=True, sort="fits", limit=20, rows=_WORST_ROWS),
    ]


def _postures(result: BatchResult) -> Parts:
    """The plots of the page; in the PDF trends, modes, errors and maps."""
    postures = batch_postures(result)
    parameters, errors = postures.of("parameter"), postures.of("error")
    printed = [
        trends(postures, parameters[:_PANELS], _TRENDS),
        Heading("Modes and errors", on=PRINT),
        *modes(postures, "of the fitted models"),
        trends(postures, errors[-_PANELS:], _ERRORS),
    ]
    if postures.varied:
        depends = [one for one in parameters if one.name in _dependent(result)][:3]
        gap = [one for one in errors if one.name == "gap"]
        printed.append(Heading("Maps of the postures", on=PRINT))
        printed += maps(postures, [*depends, *postures.of("frequency")[:1], *gap])
    return [*pictures(_NOTE, posture_data(postures, _first(result))), *printed]


def _first(result: BatchResult) -> str:
    """The quantity to show first: the parameter that depends on posture most, or the first one."""
    d = result.dependence
    scatter = np.where(d.depends, np.nan_to_num(d.scatter, nan=-1.0), -1.0)
    return d.parameter[int(np.argmax(scatter))] if len(d.parameter) else ""


def _dependent(result: BatchResult) -> list[str]:
    d = result.dependence
    return [name for name, depends in zip(d.parameter, d.depends, strict=True) if depends]
