"""The report of a fit: robot, parameters, modes, FRFs, residuals, convergence, identifiability."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

import numpy as np

from identify.core.arrays import Array
from identify.reports.fit import figures, tables
from identify.reports.kit.cells import Column, Curves, several, unit
from identify.reports.kit.report import (
    EVERYWHERE,
    PAGE,
    PRINT,
    Box,
    Drawing,
    Heading,
    Part,
    Parts,
    Report,
    Section,
    Tabular,
    Text,
    given,
    note,
    origin,
)
from identify.reports.shared import data, measurement_tables, robot_figure
from identify.reports.shared.figures import pair_mac
from identify.reports.shared.measurement_tables import amplitude_tables, magnitude_errors, mode_error_table
from identify.reports.shared.page_data import channels, measurement_data
from identify.reports.shared.parameters import (
    PARAMETERS_TERMINAL,
    between_bounds,
    free_names,
    half_interval,
    parameter_table,
)
from identify.reports.shared.parts import (
    error_lists,
    first_shapes,
    frf_picker,
    gap_maps,
    mac,
    overlays,
    stage,
    stages_of,
)
from identify.results.fit import FitResult, FrfComparison, MeasurementResult

_STAGE_LINES = "Solid, dashed, dotted: first, second, third stage, which may have costs of their own."
_MAC = "Modal assurance criterion (MAC) of measured and model modes."
_CHARTS = ("charts.js",)
_CURVES = {"measured": "measured", "initial": "start model", "fitted": "fitted"}


def report(result: FitResult) -> Report:
    """What is said of a fit."""
    found = list(result.measurements.values())
    table = measurement_tables.measurement_table(result)
    opening: Parts = [
        Text(f"Model: {'; '.join(result.effects)}.", "effects"),
        Tabular(table, terminal=("Measurement", "Use", "Data", "Gap"), on=EVERYWHERE),
    ]
    frfs = [(m, m.frf) for m in found if m.frf is not None]
    sections = [
        Section("robot", "Robot and mode shapes", _robot(found), "Robot"),
        Section("parameters", "Parameters", _parameters(result)),
        Section("modes", "Modes", _modes(result, found)),
        *(_frfs(result, frfs) if frfs else []),
        Section("convergence", "Convergence", _convergence(result)),
        Section("identifiability", "Identifiability", _identifiability(result)),
        Section("uncertainty", "Stated uncertainty", list(_stated(result))),
    ]
    return Report(tables.tiles(result), opening, [*sections, *origin(result)])


def _robot(measurements: list[MeasurementResult]) -> Parts:
    drawn = measurements[: robot_figure.POSTURES]
    first = "" if drawn == measurements else f" The first {len(drawn)} of {len(measurements)} postures."
    caption = f"The robot with its measurement points; {robot_figure.ARROWS}; floor grid 0.5 m.{first}"
    bodies = measurements[0].geometry.bodies
    if bodies is not None and bodies.missing:
        caption += f" Not drawn as they look: {'; '.join(bodies.missing)}."
    postures = Drawing(
        "",
        partial(robot_figure.postures, [_view(m) for m in measurements]),
        caption,
        lambda: [data.geometry(m.name, m.geometry) for m in measurements],
    )
    page = {"measurements": [measurement_data(m) for m in measurements], "curves": _CURVES}
    return [
        stage(measurements, stages_of(measurements), page),
        postures,
        first_shapes(measurements[0], "model"),
    ]


def _view(m: MeasurementResult) -> robot_figure.PostureView:
    return robot_figure.PostureView(f"{m.name}, {measurement_tables.use(m)}", m.geometry, *channels(m.frf))


def _parameters(result: FitResult) -> Parts:
    p, table = result.parameters, parameter_table(result.parameters)
    caption = "Start and fitted values between their bounds, and the size of the 95 % intervals."
    places = {key: between_bounds(p, getattr(p, key)) for key in figures.PLACES}
    own = {"name": list(p.name), "status": list(p.status), "half": 100 * half_interval(p), **places}
    page = {"parameters": own, "free": free_names(p)}
    figure = partial(figures.parameters, result)
    return [
        Tabular(table, sort="parameters", terminal=PARAMETERS_TERMINAL, on=EVERYWHERE),
        Drawing("parameter-plot", figure, caption, lambda: [table], page=page, scripts=_CHARTS),
        given(tables.profile_table(result)),
        figures.profiles(result).drawing(partial(_profiles, result)) if result.profiles else None,
        given(tables.published_table(result)),
    ]


def _profiles(result: FitResult) -> list[Curves]:
    units = dict(zip(result.parameters.name, result.parameters.unit, strict=True))
    return [
        Curves(
            name, [Column(name, unit(units[name]), one.values), Column("Rise of chi-square", "", one.rise)]
        )
        for name, one in result.profiles.items()
    ]


def _modes(result: FitResult, measurements: list[MeasurementResult]) -> Parts:
    boxes = [_mode_box(k, m) for k, m in enumerate(measurements)]
    matrices = [found for found in map(pair_mac, measurements) if found]
    return [
        Box("columns", boxes),
        given(mode_error_table(measurements), on=EVERYWHERE),
        *(Tabular(table, heading=True, on=EVERYWHERE) for table in amplitude_tables(measurements)),
        given(tables.published_modes_table(result)),
        *mac(matrices, _MAC),
    ]


def _mode_box(k: int, m: MeasurementResult) -> Box:
    use = "" if m.use == "fit" else f", {measurement_tables.use(m)}"
    brief = measurement_tables.MODES_TERMINAL
    table = Tabular(measurement_tables.mode_table(m), terminal=brief, on=EVERYWHERE)
    plot = Drawing(f"mac-{k}", look="mac") if m.pairs and m.pairs.mac_matrix is not None else None
    pairs = Box("pairs", [Box("table", [table]), plot])
    return Box(f"block{' wide' if m.pairs else ''}", [Heading(f"{m.name}{use}"), pairs])


def _frfs(result: FitResult, found: list[tuple[MeasurementResult, FrfComparison]]) -> list[Section]:
    measurements = list(result.measurements.values())
    named = [(m.name, frf) for m, frf in found]
    printed: list[Part] = []
    for m, frf in found:
        printed += [Heading(f"{m.name}, {measurement_tables.use(m)}", on=PRINT), *overlays(m.name, frf)]
    lists = error_lists(
        [measurement_tables.frf_table(m.name, frf, magnitude_errors(m, frf)) for m, frf in found]
    )
    return [
        Section("frf", "Frequency response functions", [frf_picker(measurements, True), *printed], "FRFs"),
        Section("gap", "Where the model disagrees", gap_maps(named, measurements), "Gap map"),
        Section("errors", "Errors", [Tabular(measurement_tables.error_table(result)), *lists]),
    ]


def _convergence(result: FitResult) -> Parts:
    p, starts, lines = result.parameters, result.starts, figures.cost_lines(result.history)
    sides = {
        key: between_bounds(p, values)[:, p.free]
        for key, values in (("initial", starts.initial), ("final", starts.final))
    }
    history = Drawing(
        "history-plot",
        partial(figures.convergence, result),
        f"Best cost over evaluations. {_STAGE_LINES}",
        lambda: [_history(result.history)],
        page={"history": lines, "cost": result.cost_kind},
    )
    ends = Drawing(
        "starts-plot",
        partial(figures.starts, result),
        "Free parameters before and after every start.",
        partial(_starts, result),
        page={"starts": {"cost": starts.cost, **sides}},
    )
    plots = [
        Box("block", [Heading("Best cost over the evaluations", on=PAGE), history]),
        Box("block", [Heading("Parameters before and after every start", on=PAGE), ends]),
    ]
    table = Tabular(tables.start_table(result), sort="starts")
    return [Box("columns two", plots), note(_STAGE_LINES), table]


def _history(history: Array) -> Curves:
    """The best cost of every start and stage over evaluations and time."""
    heads = ("Start", "Stage", "Evaluations of the stage", "Best cost")
    counted = history[:, :5] + np.array([1, 1, 0, 0, 0])
    return Curves("convergence", [*several(heads, "", counted[:, :4]), Column("Time", "s", counted[:, 4])])


def _starts(result: FitResult) -> list[Curves]:
    """The parameters before and after every start, a row per start."""
    p, s = result.parameters, result.starts
    number = Column("Start", "", np.arange(1, len(s.cost) + 1))
    return [
        Curves(
            side,
            [
                number,
                *(Column(p.name[k], unit(p.unit[k]), own) for k, own in enumerate(np.transpose(values))),
            ],
        )
        for side, values in (("before", s.initial), ("after", s.final))
    ]


def _identifiability(result: FitResult) -> Parts:
    groups = "; ".join(result.inseparable)
    said = f"Not separable by these data: {groups}." if groups else "The data separate all free parameters."
    singular = Drawing(
        "singular-plot", note="Triangles: below 0.01.", page={"singular": result.singular_values}
    )
    correlation = Drawing(
        "correlation-plot",
        partial(figures.correlation, result) if len(result.correlation) > 1 else None,
        "Correlation of the estimates.",
        lambda: [Curves("correlation", several(free_names(result.parameters), "", result.correlation))],
        page={"correlation": result.correlation},
    )
    plots = [
        Box("block", [Heading("Singular values", on=PAGE), singular]),
        Box("block", [Heading("Correlation of the estimates", on=PAGE), correlation]),
    ]
    return [Text(said), Box("columns two", plots), Tabular(tables.direction_table(result))]


def _stated(result: FitResult) -> Iterator[Part]:
    """What was stated to be uncertain, and what became of it."""
    stated = result.uncertainty
    if stated is not None:
        yield Text(" ".join(stated.sentences) or "No nuisance parameter is larger than was stated.")
        yield Tabular(tables.part_table(result, stated), heading=True)
        yield Tabular(tables.stated_table(stated), heading=True, limit=30)
