"""The tables of a map of postures."""

from __future__ import annotations

import numpy as np

from identify.reports.kit.cells import (
    Column,
    Table,
    digits,
    limited,
    number,
    percent,
    ready,
    several,
    turns_per_minute,
    words,
)
from identify.reports.kit.report import Tiles
from identify.results.map import CorrectionRows, Learnt, MapResult

_LIMITS = {
    "depth": ("Depth limit", "mm", 1e3),
    "deflection": ("Deflection", "µm", 1e6),
    "frequency": ("", "Hz", 1.0),
}
_LEARNED = {
    "frequency": ("Frequency", "Hz", 1.0),
    "damping": ("Damping", "%", 100.0),
    "peak": ("Peak", "µm/N", 1e6),
}


def tiles(result: MapResult) -> Tiles:
    """The few numbers that are read first."""
    rows, three = result.rows, digits(3)
    damping = 100 * rows.damping_ratio[np.isfinite(rows.damping_ratio[:, 0]), 0]
    first, peak = rows.frequency_hz[:, 0], three(1e6 * rows.peak_m_per_n.max())
    half = 50 * (rows.frequency_high_95[:, 0] - rows.frequency_low_95[:, 0]) / first
    rate = f"{three(len(rows.name) / result.seconds)} per second on {result.workers}"
    low, high = three(np.nanmin(first)), three(np.nanmax(first))
    return (
        *_limit_tile(result),
        ("Postures", str(len(rows.name)), rate),
        ("First mode", f"{low} to {high} Hz", f"± {number(np.nanmax(half), 2)} % at most"),
        ("Damping of it", f"{three(damping.min())} to {three(damping.max())} %", "damping ratio"),
        ("Largest receptance", f"{peak} µm/N", f"of {result.tool}, along one of the base's axes"),
    )


def _limit_tile(result: MapResult) -> Tiles:
    """From the least to the largest of a limit."""
    limit = result.limit
    if limit is None or limit.kind == "frequency":
        return ()
    name, of, scale = _LIMITS[limit.kind]
    shown = scale * np.minimum(limit.value, limit.most)
    return ((name, f"{number(shown.min(), 3)} to {number(shown.max(), 3)} {of}", limit.about),)


def limit_table(result: MapResult) -> Table | None:
    """The limit at every posture and feed, the best first; None where none was asked for."""
    limit, rows = result.limit, result.rows
    if limit is None:
        return None
    _, of, scale = _LIMITS[limit.kind]
    sign = 1 if limit.kind == "deflection" else -1
    order = np.argsort(sign * limit.value, axis=None, kind="stable")
    posture, feed = np.divmod(order, len(limit.feed_deg))
    limits = (scale * one.ravel()[order] for one in (limit.value, limit.low_95, limit.high_95))
    columns = [
        words("Posture", [rows.name[row] for row in posture]),
        *several([f"Tip {axis}" for axis in "xyz"], "m", np.round(rows.tool_m[posture], 6) + 0.0),
        *limited("Limit", of, limits),
        Column("Feed turned by", "°", limit.feed_deg[feed]),
        Column("Chatter", "Hz", limit.chatter_hz.ravel()[order]),
        Column("Speed", "rpm", limit.rpm.ravel()[order], turns_per_minute),
    ]
    return Table("Limits", columns, f"Of {limit.about}, the best first. ∞: none up to the largest depth.")


def mode_table(result: MapResult) -> Table:
    """What each mode does over the postures."""
    rows = result.rows
    modes = np.flatnonzero(np.isfinite(rows.frequency_hz).any(axis=0))
    hz, ratio = rows.frequency_hz[:, modes], rows.damping_ratio[:, modes]
    half = 50 * (rows.frequency_high_95 - rows.frequency_low_95)[:, modes] / hz
    columns = [
        words("Mode", modes + 1),
        Column("Lowest", "Hz", np.nanmin(hz, axis=0)),
        words("at", [rows.name[row] for row in np.nanargmin(hz, axis=0)]),
        Column("Highest", "Hz", np.nanmax(hz, axis=0)),
        words("at", [rows.name[row] for row in np.nanargmax(hz, axis=0)]),
        Column("± at most", "%", np.nanmax(half, axis=0), digits(2)),
        Column("Damping from", "%", np.nanmin(ratio, axis=0), percent),
        Column("to", "%", np.nanmax(ratio, axis=0), percent),
    ]
    note = "Modes are numbered by frequency at each posture, so where two cross they change places."
    return Table("Modes over the postures", columns, note)


def posture_table(result: MapResult) -> Table:
    """Every posture: where the tool is, the first modes with their intervals, static and largest
    receptance.
    """
    rows = result.rows
    half = 50 * (rows.frequency_high_95 - rows.frequency_low_95) / rows.frequency_hz
    tool, static, largest = ([f"{what} {axis}" for axis in "xyz"] for what in ("Tool", "Static", "Largest"))
    joints = [f"Joint {joint + 1}" for joint in range(rows.posture_deg.shape[1])]
    modes: list[Column] = []
    for k in range(min(3, rows.frequency_hz.shape[1])):
        modes += [
            Column(f"Mode {k + 1}", "Hz", rows.frequency_hz[:, k]),
            Column("±", "%", half[:, k], digits(2)),
            Column("Damping", "%", rows.damping_ratio[:, k], percent),
        ]
    columns = [
        words("Posture", rows.name),
        *several(joints, "°", rows.posture_deg),
        *several(tool, "m", rows.tool_m),
        *modes,
        *several(static, "µm/N", 1e6 * np.diagonal(rows.compliance_m_per_n, axis1=1, axis2=2)),
        *several(largest, "µm/N", 1e6 * rows.peak_m_per_n),
    ]
    return Table("Postures", columns)


def process_table(learnt: Learnt) -> Table:
    """What measured postures tell of what the model lacks."""
    p = learnt.processes
    columns = [
        words("Of the", [_LEARNED[quantity][0] for quantity in p.quantity]),
        Column("Postures", "", map(str, p.postures), ready),
        Column("Numbers", "", map(str, p.numbers), ready),
        Column("Log odds", "", p.log_odds, digits(3)),
        Column("Probability", "", 1 / (1 + np.exp(-p.log_odds)), digits(2)),
        Column("Size", "%", p.amplitude, percent),
        Column("Another after", "°", p.length_deg, digits(2)),
        Column("Scatter", "%", p.scatter, percent),
        *([Column("Shared", "", p.shared, digits(2))] if learnt.like else []),
    ]
    note = (
        "Log odds for an error that goes with the posture, over scatter alone; size and angle of such a one."
    )
    if learnt.like:
        note += f" Shared: its correlation between this robot and those of {', '.join(learnt.like)}."
    return Table("What the map does not know", columns, note)


def left_out_table(learnt: Learnt) -> Table:
    """Each measured posture as all others tell it."""
    t = learnt.left_out
    scale = np.array([_LEARNED[quantity][2] for quantity in t.quantity])
    inside = (t.low_95 <= t.measured) & (t.measured <= t.high_95)
    columns = [
        words("Measurement", t.measurement),
        words("What", map(_what, t.quantity, t.item)),
        words("Unit", [_LEARNED[quantity][1] for quantity in t.quantity]),
        Column("Measured", "", scale * t.measured),
        Column("Model", "", scale * t.model),
        *limited("Corrected", "", (scale * one for one in (t.corrected, t.low_95, t.high_95))),
        words("Inside", ["yes" if one else "no" for one in inside]),
    ]
    note = (
        "Each posture is left out in turn, and predicted by the others alone. Axes of peaks are the sensor's."
    )
    return Table("Measured postures, each predicted by the others", columns, note)


def corrected_table(result: MapResult, c: CorrectionRows) -> Table:
    """The first modes and the peaks at every posture as the model has them, and corrected."""
    rows, found = result.rows, []
    kinds = {
        "frequency": (
            rows.frequency_hz,
            c.frequency_hz,
            c.frequency_low_95,
            c.frequency_high_95,
            c.frequency_known,
        ),
        "damping": (
            rows.damping_ratio,
            c.damping_ratio,
            c.damping_low_95,
            c.damping_high_95,
            c.damping_known,
        ),
        "peak": (rows.peak_m_per_n, c.peak_m_per_n, c.peak_low_95, c.peak_high_95, c.peak_known),
    }
    for k, name in enumerate(rows.name):
        for quantity, (*values, known) in kinds.items():
            _, of, scale = _LEARNED[quantity]
            for item in np.flatnonzero(np.isfinite(known[k, :3])):
                own = (scale * one[k, item] for one in values)
                found.append((name, _what(quantity, int(item) + 1), of, *own, 100 * known[k, item]))
    heads = [
        *(words(head) for head in ("Posture", "What", "Unit")),
        *(Column(head) for head in ("Model", "Corrected", "95 % low", "95 % high")),
        Column("Known", "%", form=digits(2)),
    ]
    note = (
        "With 95 % intervals of what would be measured. Known: share of the prior variance that the measured"
        " postures remove; 0 far from all of them, where the interval is the widest."
    )
    return Table.of("Corrected by measured postures", heads, found, note)


def _what(quantity: str, item: int) -> str:
    name = _LEARNED[quantity][0]
    return f"{name} along {'xyz'[item - 1]}" if quantity == "peak" else f"{name} of mode {item}"
