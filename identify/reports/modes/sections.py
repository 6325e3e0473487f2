"""The report of a modal analysis: modes and shapes, stabilisation, rebuilt FRFs, rejected candidates."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from identify.core.text import capital
from identify.reports.shared import data, measurement_tables, pick
from identify.reports.shared.page_data import channels, frf_data, mac_data, robot_data
from identify.reports.shared.parts import (
    STAGES,
    error_lists,
    frf_picker,
    gap_maps,
    mac,
    overlays,
    shapes,
    stage,
)
from identify.reports.shared import robot_figure
from identify.reports.kit.cells import number, percent, unit
from identify.reports.kit.figures import Mac
from identify.reports.kit.report import (
    EVERYWHERE,
    PAGE,
    PRINT,
    WRITTEN,
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
from identify.reports.shared.shapes import analysed_views
from identify.reports.modes import tables
from identify.reports.modes.figure import stabilisation
from identify.reports.modes.setup_table import setup_table
from identify.results.modes import AnalysedMeasurement, ModesResult
from identify.results.tables import Geometry

_NO_SHAPES = (
    "Shapes are not drawn: where the measured points are is not known. They are in the modal table and the"
    " universal file."
)
_AUTO_MAC = "Modal assurance criterion of the shapes with each other (autoMAC)."
_MODELLED = "rebuilt from the modes"
_FEW, _REJECTED_ROWS = 8, 40


def report(result: ModesResult) -> Report:
    """What is said of a modal analysis."""
    measurements = list(result.measurements.values())
    named = [(m.name, m.frf) for m in measurements]
    page_data = {
        "measurements": [_measurement(m) for m in measurements],
        "curves": {"measured": "measured", "fitted": _MODELLED},
    }
    printed = [
        part for name, frf in named for part in (Heading(name, on=PRINT), *overlays(name, frf, _MODELLED))
    ]
    maps = gap_maps(named, measurements)
    nouns = result.noun.several
    sections = [
        Section(
            "modes", "Modes", [_modes(k, m) for k, m in enumerate(measurements)], "", page_data, ("modes.js",)
        ),
        Section("robot", "Mode shapes", _shapes(measurements), "Shapes"),
        Section("stabilisation", "Stabilisation", _diagrams(measurements)),
        Section("frf", f"Measured and rebuilt {nouns}", [frf_picker(measurements), *printed], capital(nouns)),
        Section("gap", f"Where the modes do not explain the {nouns}", maps, "Gap map"),
        Section("errors", "Errors", _errors(result)),
        Section("rejected", "Rejected candidates", _rejected(measurements), "Rejected"),
    ]
    opening = [Tabular(tables.measurement_table(result))]
    return Report(tables.tiles(result), opening, [*sections, *origin(result, "Settings")])


def _modes(k: int, m: AnalysedMeasurement) -> Box:
    hz, table = m.modes.frequency_hz, tables.mode_table(m)
    inside: list[Part] = [Box("table", [Tabular(table, on=EVERYWHERE if len(hz) else WRITTEN)])]
    matrix = _auto_mac(m)
    if matrix is not None:
        title = Heading("MAC of the shapes with each other (autoMAC)", on=PAGE)
        inside.append(Box("table", [title, Drawing(f"mac-{k}", look="auto"), *mac([matrix], _AUTO_MAC)]))
    for more in (setup_table(m), tables.mass_table(m), tables.tone_table(m)):
        if more is not None:
            inside.append(Box("table", [Tabular(more, heading=True)]))
    return Box("block wide", [Heading(m.name), Box("pairs" if len(hz) <= _FEW else "table", inside)])


def _shapes(measurements: list[AnalysedMeasurement]) -> list[Part]:
    moving = [m for m in measurements if m.geometry is not None and analysed_views(m)]
    if not moving:
        return [Text(_NO_SHAPES)]
    shown = [(kind, STAGES[kind]) for kind in ("measured", "motion")]
    parts: list[Part] = [stage(moving, shown, "Measurement")]
    for m in moving:
        views, most = analysed_views(m), robot_figure.MODES
        first = f" The first {most} of {len(views)}." if len(views) > most else ""
        caption = f"{m.name}: measured shapes, enlarged, at one end of the motion.{first}"
        parts.append(shapes(m, views, views, caption))
    return parts


def _diagrams(measurements: list[AnalysedMeasurement]) -> list[Part]:
    parts: list[Part] = []
    for k, m in enumerate(measurements):
        caption = f"{m.name}. {tables.DIAGRAM_NOTE}"
        drawing = Drawing(f"diagram-{k}", partial(stabilisation, m), caption, partial(data.stabilisation, m))
        parts += [Heading(m.name, on=PAGE), drawing]
    return [*parts, Text(tables.DIAGRAM_NOTE, "note", PAGE)]


def _errors(result: ModesResult) -> list[Part]:
    lists = [measurement_tables.frf_table(m.name, m.frf) for m in result.measurements.values()]
    checks = tables.reciprocity_table(result)
    reciprocity = [Tabular(checks, heading=True)] if checks is not None else []
    return [Tabular(tables.error_table(result)), *error_lists(lists), *reciprocity]


def _rejected(measurements: list[AnalysedMeasurement]) -> list[Part]:
    return [
        Tabular(tables.rejected_table(m), True, f"rejected-{k}", 20, _REJECTED_ROWS)
        for k, m in enumerate(measurements)
    ]


def _measurement(m: AnalysedMeasurement) -> dict[str, Any]:
    return {
        "name": m.name,
        "use": "",
        "robot": None if m.geometry is None or m.shapes is None else _robot(m, m.geometry),
        "frf": frf_data(m.frf),
        "mac": mac_data(_auto_mac(m)),
        "diagram": _diagram(m),
    }


def _robot(m: AnalysedMeasurement, geometry: Geometry) -> dict[str, Any]:
    ringed = pick.nodes(m.modes.references)
    shaped = robot_data(geometry, channels(m.frf), analysed_views(m), ringed, ("references", "reference"))
    return {**shaped, "measured": pick.nodes([*m.frf.output, *m.frf.input])}


def _auto_mac(m: AnalysedMeasurement) -> Mac | None:
    hz = m.modes.frequency_hz
    return Mac(m.name, m.modes.auto_mac, hz, hz, "Mode (Hz)", "Mode (Hz)") if len(hz) > 1 else None


def _diagram(m: AnalysedMeasurement) -> dict[str, Any]:
    d, modes = m.diagram, m.modes
    poles = {
        kind: {
            "order": d.order[rows],
            "frequency": d.frequency_hz[rows],
            "damping": 100 * d.damping_ratio[rows],
        }
        for kind, rows in (("stable", d.stable), ("unstable", ~d.stable), *d.marked())
    }
    chosen = [
        {"frequency": hz, "label": f"{number(hz)} Hz, damping {percent(ratio)} %"}
        for hz, ratio in zip(modes.frequency_hz, modes.damping_ratio, strict=True)
    ]
    indicator = np.where(d.indicator > 0, d.indicator, np.nan).T
    return {
        "poles": poles,
        "lines": d.line_hz,
        "indicator": indicator,
        "unit": unit(m.frf.unit),
        "modes": chosen,
        "highest": m.highest_order,
    }
