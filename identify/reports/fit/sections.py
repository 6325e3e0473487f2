"""The report of a fit: robot, parameters, modes, FRFs, residuals, convergence, identifiability."""

from __future__ import annotations

from functools import partial
from typing import Any

from identify.reports.fit import (
    data,
    measurement_tables,
    pick,
    search_figure,
    tables,
    uncertainty_tables,
)
from identify.reports.fit.page_data import channels, measurement_data
from identify.reports.fit.parts import (
    error_lists,
    first_shapes,
    frf_picker,
    gap_maps,
    mac,
    overlays,
    stage,
    stages_of,
)
from identify.reports.kit import figures, robot_figure
from identify.reports.kit.cells import Table, unit
from identify.reports.kit.report import (
    EVERYWHERE,
    PAGE,
    PRINT,
    Box,
    Drawing,
    Heading,
    Part,
    Report,
    Section,
    Tabular,
    Text,
    origin,
)
from identify.results.fit import FitResult, FrfComparison, MeasurementResult, ProfileCurve

_STAGE_LINES = "Solid, dashed, dotted: first, second, third stage, which may have costs of their own."
_MAC = "Modal assurance criterion (MAC) of measured and model modes."


def report(result: FitResult) -> Report:
    """What is said of a fit."""
    measurements = list(result.measurements.values())
    opening: list[Part] = [
        Text(f"Model: {'; '.join(result.effects)}.", "effects"),
        Tabular(
            measurement_tables.measurement_table(result),
            terminal=("Measurement", "Use", "Data", "Gap"),
            on=EVERYWHERE,
        ),
    ]
    page_data = {
        "measurements": [measurement_data(m) for m in measurements],
        "curves": {"measured": "measured", "initial": "start model", "fitted": "fitted"},
    }
    charts = ("charts.js",)
    sections = [
        Section("robot", "Robot and mode shapes", _robot(measurements), "Robot", page_data),
        Section(
            "parameters", "Parameters", _parameters(result), data=_parameter_data(result), scripts=charts
        ),
        Section("modes", "Modes", _modes(result, measurements)),
        *_frfs(result, measurements),
        Section("convergence", "Convergence", _convergence(result), data=_search_data(result)),
        Section("identifiability", "Identifiability", _identifiability(result)),
        *_stated(result),
    ]
    return Report(tables.tiles(result), opening, [*sections, *origin(result)])


def _robot(measurements: list[MeasurementResult]) -> list[Part]:
    drawn = measurements[: robot_figure.POSTURES]
    first = "" if drawn == measurements else f" The first {len(drawn)} of {len(measurements)} postures."
    caption = f"The robot with its measurement points; {robot_figure.ARROWS}; floor grid 0.5 m.{first}"
    bodies = measurements[0].geometry.bodies
    if bodies is not None and bodies.missing:
        caption += f" Not as they look: {'; '.join(bodies.missing)}."
    postures = Drawing(
        "",
        partial(robot_figure.postures, [_view(m) for m in measurements]),
        caption,
        lambda: [data.geometry(m.name, m.geometry) for m in measurements],
    )
    return [stage(measurements, stages_of(measurements)), postures, first_shapes(measurements[0], "model")]


def _view(m: MeasurementResult) -> robot_figure.PostureView:
    outputs, inputs = channels(m.frf) or ((), ())
    return robot_figure.PostureView(f"{m.name}, {measurement_tables.use(m)}", m.geometry, outputs, inputs)


def _titled(table: Table | None) -> list[Part]:
    return [] if table is None else [Tabular(table, heading=True)]


def _parameters(result: FitResult) -> list[Part]:
    table = tables.parameter_rows(result.parameters)
    caption = "Start and fitted values between their bounds, and the size of the 95 % intervals."
    return [
        Tabular(table, sort="parameters", terminal=tables.PARAMETERS_TERMINAL, on=EVERYWHERE),
        Drawing("parameter-plot", partial(figures.parameters, result), caption, lambda: [table]),
        *_profiles(result),
        *_titled(tables.published_table(result)),
    ]


def _profiles(result: FitResult) -> list[Part]:
    if not result.profiles:
        return []
    caption = "Profile likelihood: rise of chi-square, all other parameters fitted again; dotted: 3.84."
    plots = [Drawing(f"profile-{k}") for k in range(len(result.profiles))]
    printed = Drawing("", partial(figures.profiles, result), caption, partial(data.profiles, result))
    return [*_titled(tables.profile_table(result)), Box("columns some", plots), printed]


def _modes(result: FitResult, measurements: list[MeasurementResult]) -> list[Part]:
    boxes = [_mode_box(k, m) for k, m in enumerate(measurements)]
    matrices = [found for found in map(figures.pair_mac, measurements) if found]
    return [Box("columns", boxes), *_titled(tables.published_modes_table(result)), *mac(matrices, _MAC)]


def _mode_box(k: int, m: MeasurementResult) -> Box:
    use = "" if m.use == "fit" else f", {measurement_tables.use(m)}"
    table = Tabular(
        measurement_tables.mode_table(m), terminal=measurement_tables.MODES_TERMINAL, on=EVERYWHERE
    )
    plot = [Drawing(f"mac-{k}", look="mac")] if m.pairs and m.pairs.mac_matrix is not None else []
    pairs = Box("pairs", [Box("table", [table]), *plot])
    return Box(f"block{' wide' if m.pairs else ''}", [Heading(f"{m.name}{use}"), pairs])


def _frfs(result: FitResult, measurements: list[MeasurementResult]) -> list[Section]:
    found = [(m, m.frf) for m in measurements if m.frf is not None]
    if not found:
        return []
    named = [(m.name, frf) for m, frf in found]
    printed = [part for m, frf in found for part in _printed_frfs(m, frf)]
    lists = error_lists([measurement_tables.frf_table(name, frf) for name, frf in named])
    return [
        Section("frf", "Frequency response functions", [frf_picker(measurements, True), *printed], "FRFs"),
        Section("gap", "Where the model disagrees", gap_maps(named, measurements), "Gap map"),
        Section("errors", "Errors", [Tabular(measurement_tables.error_table(result)), *lists]),
    ]


def _printed_frfs(m: MeasurementResult, frf: FrfComparison) -> list[Part]:
    return [Heading(f"{m.name}, {measurement_tables.use(m)}", on=PRINT), *overlays(m.name, frf)]


def _convergence(result: FitResult) -> list[Part]:
    history = Drawing(
        "history-plot",
        partial(figures.convergence, result),
        f"Best cost over evaluations. {_STAGE_LINES}",
        lambda: [data.history(result)],
    )
    starts = Drawing(
        "starts-plot",
        partial(search_figure.starts, result),
        "Free parameters before and after every start.",
        partial(data.starts, result),
    )
    titled = [
        Box("block", [Heading(title, on=PAGE), plot])
        for title, plot in (
            ("Best cost over the evaluations", history),
            ("Parameters before and after every start", starts),
        )
    ]
    note = Text(_STAGE_LINES, "note", PAGE)
    return [Box("columns two", titled), note, Tabular(tables.start_table(result), sort="starts")]


def _identifiability(result: FitResult) -> list[Part]:
    groups = "; ".join(result.inseparable)
    said = f"Not separable by these data: {groups}." if groups else "The data separate all free parameters."
    singular = Drawing("singular-plot", note="Triangles: below 0.01.")
    figure = partial(search_figure.correlation, result) if len(result.correlation) > 1 else None
    correlation = Drawing(
        "correlation-plot", figure, "Correlation of the estimates.", lambda: [data.correlation(result)]
    )
    plots = [
        Box("block", [Heading("Singular values", on=PAGE), singular]),
        Box("block", [Heading("Correlation of the estimates", on=PAGE), correlation]),
    ]
    return [Text(said), Box("columns two", plots), Tabular(tables.direction_table(result))]


def _stated(result: FitResult) -> list[Section]:
    """What was stated to be uncertain, and what became of it."""
    stated = result.uncertainty
    if stated is None:
        return []
    tables_of = [
        Tabular(uncertainty_tables.part_table(result, stated), heading=True),
        Tabular(uncertainty_tables.error_table(stated), heading=True, limit=30),
    ]
    said = " ".join(stated.sentences) or "No error of what was told is larger than was stated."
    return [Section("uncertainty", "Stated uncertainty", [Text(said), *tables_of])]


def _parameter_data(result: FitResult) -> dict[str, Any]:
    p = result.parameters
    places = {
        key: pick.between_bounds(p, getattr(p, key)) for key in ("initial", "value", "low_95", "high_95")
    }
    own = {"name": list(p.name), "status": list(p.status), "half": 100 * pick.half_interval(p), **places}
    return {
        "parameters": own,
        "free": [name for name, is_free in zip(p.name, p.free, strict=True) if is_free],
        "profiles": [_profile(result, name, curve) for name, curve in result.profiles.items()],
    }


def _profile(result: FitResult, name: str, curve: ProfileCurve) -> dict[str, Any]:
    p = result.parameters
    row = p.name.index(name)
    label = f"{name} ({unit(p.unit[row])})"
    return {
        "label": label,
        "log": bool(p.log[row]),
        "values": curve.values,
        "rise": curve.rise,
        "best": p.value[row],
    }


def _search_data(result: FitResult) -> dict[str, Any]:
    p, starts = result.parameters, result.starts
    return {
        "correlation": result.correlation,
        "singular": result.singular_values,
        "starts": {
            "cost": starts.cost,
            "initial": pick.between_bounds(p, starts.initial)[:, p.free],
            "final": pick.between_bounds(p, starts.final)[:, p.free],
        },
        "history": pick.cost_lines(result.history),
        "cost": result.cost_kind,
    }
