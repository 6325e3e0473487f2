"""The report of a modal analysis: modes and shapes, stabilisation, rebuilt FRFs, rejected candidates."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from identify.core.text import capital
from identify.reports.kit import plotting as mpl
from identify.reports.kit.cells import NONE, Column, Curves, several, unit
from identify.reports.kit.figures import BLUE, GRID, MUTED, PALETTE, WIDTH_IN, Room
from identify.reports.kit.report import (
    EVERYWHERE,
    PAGE,
    PRINT,
    WRITTEN,
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
from identify.reports.modes import tables
from identify.reports.shared import measurement_tables, pick, robot_figure
from identify.reports.shared.figures import Mac
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
from identify.reports.shared.shapes import analysed_views, mode_text
from identify.results.modes import AnalysedMeasurement, ModesResult
from identify.results.tables import Geometry

_NO_SHAPES = (
    "Shapes are not drawn, because positions of the measured points are not known. They are in the modal"
    " table and the universal file."
)
_AUTO_MAC = "Modal assurance criterion of the shapes with each other (autoMAC)."
_MODELLED = "rebuilt from the modes"
_FEW, _REJECTED_ROWS = 8, 40
_MARKS: dict[str, dict[str, Any]] = {
    "kept by hand": {"marker": "D", "mfc": "none", "mec": PALETTE[0], "mew": 0.8, "ms": 4.2},
    "dropped by hand": {"marker": "x", "mec": PALETTE[1], "mew": 0.9, "ms": 4.0},
    "below the threshold": {"marker": "s", "mfc": "none", "mec": PALETTE[4], "mew": 0.8, "ms": 3.6},
}
"""How poles look that a choice touched (`identify.results.modes.MARKS`)."""


def report(result: ModesResult) -> Report:
    """What is said of a modal analysis."""
    measurements, nouns = list(result.measurements.values()), result.noun.several
    named = [(m.name, m.frf) for m in measurements]
    page = {
        "measurements": [_measurement(m) for m in measurements],
        "curves": {"measured": "measured", "fitted": _MODELLED},
    }
    frfs: list[Part] = [frf_picker(measurements, page=page)]
    for name, frf in named:
        frfs += [Heading(name, on=PRINT), *overlays(name, frf, _MODELLED)]
    disagree = f"Where the modes do not explain the {nouns}"
    sections = [
        Section("modes", "Modes", [_modes(k, m) for k, m in enumerate(measurements)]),
        Section("robot", "Mode shapes", _shapes(measurements), "Shapes"),
        Section("stabilisation", "Stabilisation", _diagrams(measurements)),
        Section("frf", f"Measured and rebuilt {nouns}", frfs, capital(nouns)),
        Section("gap", disagree, gap_maps(named, measurements), "Gap map"),
        Section("errors", "Errors", _errors(result)),
        Section("rejected", "Rejected candidates", _rejected(measurements), "Rejected"),
        *origin(result, "Settings"),
    ]
    return Report(tables.tiles(result), [Tabular(tables.measurement_table(result))], sections)


def _modes(k: int, m: AnalysedMeasurement) -> Box:
    hz, matrix = m.modes.frequency_hz, _auto_mac(m)
    inside: list[Part] = [Tabular(tables.mode_table(m), on=EVERYWHERE if len(hz) else WRITTEN)]
    boxes = [Box("table", inside)]
    if matrix is not None:
        title = Heading("MAC of the shapes with each other (autoMAC)", on=PAGE)
        boxes.append(Box("table", [title, Drawing(f"mac-{k}", look="auto"), *mac([matrix], _AUTO_MAC)]))
    more = (tables.setup_table(m), tables.mass_table(m), tables.tone_table(m))
    boxes += [Box("table", [given(one)]) for one in more]
    return Box("block wide", [Heading(m.name), Box("pairs" if len(hz) <= _FEW else "table", boxes)])


def _shapes(measurements: list[AnalysedMeasurement]) -> Parts:
    moving = [m for m in measurements if m.geometry is not None and analysed_views(m)]
    if not moving:
        return [Text(_NO_SHAPES)]
    shown = [(kind, STAGES[kind]) for kind in ("measured", "motion")]
    parts: list[Part] = [stage(moving, shown, {}, "Measurement")]
    for m in moving:
        views, most = analysed_views(m), robot_figure.MODES
        first = f" The first {most} of {len(views)}." if len(views) > most else ""
        caption = f"{m.name}: measured shapes, enlarged, at one end of the motion.{first}"
        parts.append(shapes(m, views, views, caption))
    return parts


def _diagrams(measurements: list[AnalysedMeasurement]) -> Parts:
    parts: list[Part] = []
    for k, m in enumerate(measurements):
        caption = f"{m.name}. {tables.DIAGRAM_NOTE}"
        figure, numbers = partial(stabilisation, m), partial(_poles, m)
        drawing = Drawing(f"diagram-{k}", figure, caption, numbers, scripts=("modes.js",))
        parts += [Heading(m.name, on=PAGE), drawing]
    return [*parts, note(tables.DIAGRAM_NOTE)]


def _poles(m: AnalysedMeasurement) -> list[Curves]:
    """Poles of all orders, and the mode indicator over the lines."""
    d, of = m.diagram, unit(m.frf.unit)
    poles = [
        Column("Order", "", d.order),
        Column("Frequency", "Hz", d.frequency_hz),
        Column("Damping ratio", "%", 100 * d.damping_ratio),
        Column("Stable", "", d.stable),
        *(Column(name.capitalize(), "", rows) for name, rows in d.marked()),
    ]
    heads = [f"CMIF {k + 1}" for k in range(d.indicator.shape[1])]
    lines = [Column("Frequency", "Hz", d.line_hz), *several(heads, of, d.indicator)]
    return [Curves("poles", poles), Curves("indicator", lines)]


def _errors(result: ModesResult) -> Parts:
    lists = [measurement_tables.frf_table(m.name, m.frf) for m in result.measurements.values()]
    return [
        Tabular(tables.error_table(result)),
        *error_lists(lists),
        given(tables.reciprocity_table(result)),
    ]


def _rejected(measurements: list[AnalysedMeasurement]) -> Parts:
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
    return Mac(m.name, m.modes.auto_mac, hz, hz, "Mode", "Mode") if len(hz) > 1 else None


def _diagram(m: AnalysedMeasurement) -> dict[str, Any]:
    d, modes = m.diagram, zip(m.modes.frequency_hz, m.modes.damping_ratio, strict=True)
    kinds = (("stable", d.stable), ("unstable", ~d.stable), *d.marked())
    shown = (("order", d.order), ("frequency", d.frequency_hz), ("damping", 100 * d.damping_ratio))
    return {
        "poles": {kind: {name: values[rows] for name, values in shown} for kind, rows in kinds},
        "lines": d.line_hz,
        "indicator": np.where(d.indicator > 0, d.indicator, np.nan).T,
        "unit": unit(m.frf.unit),
        "modes": [{"frequency": hz, "label": mode_text(hz, ratio)} for hz, ratio in modes],
        "highest": m.highest_order,
    }


def stabilisation(m: AnalysedMeasurement) -> mpl.Figure:
    """Poles of every order over the mode indicator, with the chosen modes and what choices did."""
    figure = mpl.Figure((WIDTH_IN, 3.2))
    [below] = Room(left=0.6, right=0.48, top=0.36).axes(figure)
    axes = below.twinx()
    d = m.diagram
    for k, curve in enumerate(d.indicator.T):
        below.plot(d.line_hz, np.where(curve > 0, curve, np.nan), color=GRID if k else MUTED, lw=0.8)
    below.set(
        yscale="log",
        xlabel="Frequency (Hz)",
        ylabel=f"CMIF ({unit(m.frf.unit)})",
        xlim=(d.line_hz[0], d.line_hz[-1]),
    )
    below.grid(False)
    kinds = (
        ("unstable", ~d.stable, {"mfc": "none", "mec": PALETTE[7], "mew": 0.5, "ms": 2.6}),
        ("stable", d.stable, {"ms": 3.2}),
    )
    for label, rows, look in kinds:
        axes.plot(
            d.frequency_hz[rows],
            d.order[rows],
            "o" if label == "unstable" else ".",
            color=PALETTE[2],
            label=label,
            **look,
        )
    for name, rows in d.marked():
        axes.plot(d.frequency_hz[rows], d.order[rows], ls="none", label=name, **_MARKS[name])
    for k, hz in enumerate(m.modes.frequency_hz):
        axes.axvline(hz, color=BLUE, lw=0.7, ls=":", label=None if k else "chosen mode")
    axes.set(ylabel=f"Model order ({NONE})", ylim=(0, 1.06 * m.highest_order))
    axes.grid(False)
    figure.legend(*axes.get_legend_handles_labels(), loc="upper left", ncols=6)
    return figure
