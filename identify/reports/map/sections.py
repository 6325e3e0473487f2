"""The report of a map: modes and compliance over postures, and the FRFs of the tool."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from identify.reports.kit.cells import Column, Curves
from identify.reports.kit.posture_pick import Postures, map_postures_of
from identify.reports.kit.posture_section import maps, modes, pictures, posture_data
from identify.reports.kit.report import (
    EVERYWHERE,
    PRINT,
    Drawing,
    Heading,
    Part,
    Pickers,
    Report,
    Section,
    Tabular,
    origin,
)
from identify.reports.map import tables
from identify.reports.map.figure import receptances
from identify.results.map import MapResult

_FRFS, _DRAWN = 40, 3
"""Postures whose FRFs are on the page, and in the figure, evenly chosen; all are in the result file."""
_AXES = (("0", "x"), ("1", "y"), ("2", "z"))


def report(result: MapResult) -> Report:
    """What is said of a map."""
    postures, rows = map_postures_of(result), _chosen(result, _FRFS)
    first = [one.name for one in postures.of("limit")] or ["frequency of mode 1"]
    pictured = posture_data(postures, first[0])
    if result.limit is not None:  # over the two sides of the workspace that the places spread over most
        sides = np.argsort(-np.ptp(postures.tool_m, axis=0), kind="stable")[:2]
        pictured["most"] = [len(postures.varied) + int(side) for side in sorted(sides)]
    data = {"postures": pictured, "tool": _tool(result, rows)}
    every = Tabular(tables.posture_table(result), sort="postures", limit=20, rows=0)
    limits = tables.limit_table(result)
    ranked = () if limits is None else (Tabular(limits, sort="limits", limit=20, rows=20),)
    sections = [
        Section("postures", "Maps", _maps(postures), data=data, scripts=("postures.js",)),
        *(Section("limits", "Best and worst places", [one]) for one in ranked),
        *_learned(result),
        Section("frf", "Receptance of the tool", _receptance(result, len(rows)), "Tool FRFs"),
        Section("table", "Postures", [every]),
    ]
    return Report(
        tables.tiles(result),
        [Tabular(tables.mode_table(result), on=EVERYWHERE)],
        [*sections, *origin(result)],
    )


def _learned(result: MapResult) -> list[Section]:
    """What measured postures tell of what the model lacks."""
    corrected = tables.corrected_table(result)
    if result.learnt is None or corrected is None:
        return []
    parts: list[Part] = [
        Tabular(tables.process_table(result.learnt)),
        Tabular(corrected, sort="corrected", limit=20, rows=20),
        Tabular(tables.left_out_table(result.learnt), sort="left-out", limit=20, rows=20),
    ]
    return [Section("unknown", "What the map does not know", parts, "Unknown")]


def _maps(postures: Postures) -> list[Part]:
    parts = pictures("")
    if postures.varied:
        shown = [
            *postures.of("limit"),
            *postures.of("frequency")[:1],
            *postures.of("damping")[:1],
            *postures.of("corrected")[:2],
            *postures.of("compliance")[:3],
        ]
        parts += maps(postures, shown)
    return [
        *parts,
        Heading("Modes over the postures", on=PRINT),
        *modes(postures, "of the modes, with 95 % intervals"),
    ]


def _receptance(result: MapResult, shown: int) -> list[Part]:
    rows = _chosen(result, _DRAWN).tolist()
    note = (
        f"Displacement of {result.tool} by a force there, along the base's axes, with the 95 % band; {shown}"
        f" of {len(result.rows.name)} postures, from the stiffest to the softest. All, and the FRFs between"
        " different axes, are in the result file."
    )
    caption = (
        f"Receptance of {result.tool} at the stiffest, a middling and the softest posture, with 95 % bands,"
        " along the base's axes."
    )
    return [
        Pickers((("Posture", "tool-posture", ()), ("Along", "tool-axis", _AXES))),
        Drawing(
            "tool-plot", partial(receptances, result, rows), caption, partial(_curves, result, rows), note
        ),
    ]


def _chosen(result: MapResult, count: int) -> NDArray[np.intp]:
    """At most so many postures, evenly from the stiffest tool to the softest."""
    order = np.argsort(result.rows.peak_m_per_n.max(axis=1), kind="stable")
    places = np.linspace(0, len(order) - 1, min(count, len(order))).round().astype(int)
    return np.asarray(order[np.unique(places)])


def _tool(result: MapResult, rows: NDArray[np.intp]) -> dict[str, Any]:
    """Direct receptances of the tool at chosen postures, µm/N, with half their bands."""
    axes = range(3)
    direct, half = (
        values[rows][:, :, axes, axes].transpose(0, 2, 1)
        for values in (result.rows.receptance_m_per_n, result.rows.band_95)
    )
    return {
        "names": [_name(result, row) for row in rows],
        "line": result.line_hz,
        "magnitude": 1e6 * np.abs(direct).astype(float),
        "phase": np.rad2deg(np.angle(direct)).astype(float),
        "band": 1e6 * half.astype(float),
    }


def _name(result: MapResult, row: int) -> str:
    angles = ", ".join(f"{angle:.4g}" for angle in result.rows.posture_deg[row])
    return f"{result.rows.name[row]} ({angles})°"


def _curves(result: MapResult, rows: Sequence[int]) -> list[Curves]:
    """The direct receptances of the drawn postures."""
    columns = (Column("Frequency", "Hz"), *(Column(f"Receptance along {axis}", "µm/N") for _, axis in _AXES))
    found = []
    for row in rows:
        size = 1e6 * np.abs(result.rows.receptance_m_per_n[row][:, range(3), range(3)]).astype(float)
        found.append(Curves(result.rows.name[row], columns, np.column_stack([result.line_hz, size])))
    return found
