"""The report of a map: modes and compliance over postures, and the FRFs of the tool."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from identify.core.arrays import Index
from identify.reports.kit.banded import Line, Panel, Plot
from identify.reports.kit.cells import Column, angles
from identify.reports.kit.report import (
    EVERYWHERE,
    PRINT,
    Drawing,
    Heading,
    Parts,
    Pickers,
    Report,
    Section,
    Tabular,
    origin,
)
from identify.reports.map import tables
from identify.reports.shared.posture_pick import map_postures_of
from identify.reports.shared.posture_section import maps, modes, pictures, posture_data
from identify.results.map import MapResult

_FRFS, _DRAWN = 40, 3
"""Postures whose FRFs are on the page, and in the figure, evenly chosen; all are in the result file."""
_AXES = (("0", "x"), ("1", "y"), ("2", "z"))


def report(result: MapResult) -> Report:
    """What is said of a map."""
    limits = tables.limit_table(result)
    ranked = None if limits is None else Tabular(limits, sort="limits", limit=20, rows=20)
    every = Tabular(tables.posture_table(result), sort="postures", limit=20, rows=0)
    sections = [
        Section("postures", "Maps", _maps(result)),
        Section("limits", "Best and worst places", [ranked]),
        Section("unknown", "What the map does not know", _learned(result), "Unknown"),
        Section("frf", "Receptance of the tool", _receptance(result), "Tool FRFs"),
        Section("table", "Postures", [every]),
        *origin(result),
    ]
    return Report(tables.tiles(result), [Tabular(tables.mode_table(result), on=EVERYWHERE)], sections)


def _learned(result: MapResult) -> Parts:
    """What measured postures tell of what the model lacks."""
    if result.learnt is None or result.correction is None:
        return []
    return [
        Tabular(tables.process_table(result.learnt)),
        Tabular(tables.corrected_table(result, result.correction), sort="corrected", limit=20, rows=20),
        Tabular(tables.left_out_table(result.learnt), sort="left-out", limit=20, rows=20),
    ]


def _maps(result: MapResult) -> Parts:
    postures = map_postures_of(result)
    limits, most = postures.of("limit"), None
    if result.limit is not None:  # over the two sides of the workspace that the places spread over most
        sides = np.argsort(-np.ptp(postures.tool_m, axis=0), kind="stable")[:2]
        most = [len(postures.varied) + int(side) for side in sorted(sides)]
    firsts = (("frequency", 1), ("damping", 1), ("corrected", 2), ("compliance", 3))
    shown = [*limits, *(one for kind, count in firsts for one in postures.of(kind)[:count])]
    first = limits[0].name if limits else "frequency of mode 1"
    return [
        *pictures("", posture_data(postures, first, most)),
        *(maps(postures, shown) if postures.varied else ()),
        Heading("Modes over the postures", on=PRINT),
        *modes(postures, "of the modes, with 95 % intervals"),
    ]


def _receptance(result: MapResult) -> Parts:
    some, rows = _chosen(result, _FRFS), _chosen(result, _DRAWN).tolist()
    note = (
        f"Displacement of {result.tool} by a force there, along the base's axes, with the 95 % band;"
        f" {len(some)} of {len(result.rows.name)} postures, from the stiffest to the softest. All, and the"
        " FRFs between different axes, are in the result file."
    )
    caption = (
        f"Receptance of {result.tool} at the stiffest, a middling and the softest posture, with 95 % bands,"
        " along the base's axes."
    )
    plot = Plot("", Column("Frequency", "Hz"), _panels(result, rows), caption, height=1.5)
    return [
        Pickers((("Posture", "tool-posture", ()), ("Along", "tool-axis", _AXES))),
        Drawing("tool-plot", plot.figure, caption, plot.curves, note, page={"tool": _tool(result, some)}),
    ]


def _panels(result: MapResult, rows: Sequence[int]) -> list[Panel]:
    """Direct receptances at some postures, µm/N, an axis a panel."""
    h, half = (1e6 * np.abs(one) for one in (result.rows.receptance_m_per_n, result.rows.band_95))
    return [
        Panel(
            Column(f"Receptance along {axis}", "µm/N"),
            [
                Line.within(result.rows.name[row], result.line_hz, h[row, :, k, k], half[row, :, k, k])
                for row in rows
            ],
            log=True,
        )
        for k, (_, axis) in enumerate(_AXES)
    ]


def _chosen(result: MapResult, count: int) -> Index:
    """At most so many postures, evenly from the stiffest tool to the softest."""
    order = np.argsort(result.rows.peak_m_per_n.max(axis=1), kind="stable")
    places = np.linspace(0, len(order) - 1, min(count, len(order))).round().astype(int)
    return np.asarray(order[np.unique(places)])


def _tool(result: MapResult, rows: Index) -> dict[str, Any]:
    """Direct receptances of the tool at chosen postures, µm/N, with half their bands."""
    direct, half = (
        values[rows][:, :, range(3), range(3)].transpose(0, 2, 1)
        for values in (result.rows.receptance_m_per_n, result.rows.band_95)
    )
    return {
        "names": [f"{result.rows.name[row]} ({angles(result.rows.posture_deg[row])})°" for row in rows],
        "line": result.line_hz,
        "magnitude": 1e6 * np.abs(direct).astype(float),
        "phase": np.rad2deg(np.angle(direct)).astype(float),
        "band": 1e6 * half.astype(float),
    }
