"""The tables of a map of postures, as finished text; HTML and PDF print the same ones."""

from __future__ import annotations

import numpy as np

from identify.reports.kit.cells import Column, Table, number, percent, turns_per_minute, words
from identify.results.map import Learnt, MapResult


def tiles(result: MapResult) -> tuple[tuple[str, str, str], ...]:
    """The few numbers that are read first."""
    rows = result.rows
    damping = 100 * rows.damping_ratio[np.isfinite(rows.damping_ratio[:, 0]), 0]
    first, peak = rows.frequency_hz[:, 0], 1e6 * rows.peak_m_per_n
    half = 50 * (rows.frequency_high_95[:, 0] - rows.frequency_low_95[:, 0]) / first
    return (
        *_limit_tile(result),
        (
            "Postures",
            str(len(rows.name)),
            f"{number(len(rows.name) / result.seconds, 3)} per second on {result.workers}",
        ),
        (
            "First mode",
            f"{number(np.nanmin(first), 3)} to {number(np.nanmax(first), 3)} Hz",
            f"± {number(np.nanmax(half), 2)} % at most",
        ),
        ("Damping of it", f"{number(damping.min(), 3)} to {number(damping.max(), 3)} %", "damping ratio"),
        (
            "Largest receptance",
            f"{number(peak.max(), 3)} µm/N",
            f"of {result.tool}, along one of the base's axes",
        ),
    )


def _limit_tile(result: MapResult) -> tuple[tuple[str, str, str], ...]:
    """From the least to the largest of a limit."""
    limit = result.limit
    if limit is None or limit.kind == "frequency":
        return ()
    name, of, scale = ("Depth limit", "mm", 1e3) if limit.kind == "depth" else ("Deflection", "µm", 1e6)
    shown = scale * np.minimum(limit.value, limit.most)
    return ((name, f"{number(shown.min(), 3)} to {number(shown.max(), 3)} {of}", limit.about),)


def limit_table(result: MapResult) -> Table | None:
    """The limit at every posture and feed, the best first; None where none was asked for."""
    limit, rows = result.limit, result.rows
    if limit is None:
        return None
    scale, of = {"depth": (1e3, "mm"), "deflection": (1e6, "µm"), "frequency": (1.0, "Hz")}[limit.kind]
    sign = 1 if limit.kind == "deflection" else -1
    order = np.argsort(sign * limit.value, axis=None, kind="stable")
    feeds, found = len(limit.feed_deg), []
    for at in order:
        row, feed = divmod(int(at), feeds)
        values = (scale * one[row, feed] for one in (limit.value, limit.low_95, limit.high_95))
        place = map(number, np.round(rows.tool_m[row], 6) + 0.0)
        told = (
            *map(number, (limit.feed_deg[feed], limit.chatter_hz[row, feed])),
            turns_per_minute(limit.rpm[row, feed]),
        )
        found.append((rows.name[row], *place, *map(number, values), *told))
    heads = (
        words("Posture"),
        *(Column(f"Tip {axis}", "m") for axis in "xyz"),
        Column("Limit", of),
        Column("95 % low", of),
        Column("95 % high", of),
        Column("Feed turned by", "°"),
        Column("Chatter", "Hz"),
        Column("Speed", "rpm"),
    )
    note = f"Of {limit.about}, the best first. ∞: none up to the largest depth."
    return Table("Limits", heads, tuple(found), note)


def mode_table(result: MapResult) -> Table:
    """What each mode does over the postures."""
    rows, found = result.rows, []
    for mode in range(rows.frequency_hz.shape[1]):
        hz = rows.frequency_hz[:, mode]
        if not np.isfinite(hz).any():
            continue
        low, high = int(np.nanargmin(hz)), int(np.nanargmax(hz))
        half = 50 * (rows.frequency_high_95[:, mode] - rows.frequency_low_95[:, mode]) / hz
        ratio = rows.damping_ratio[:, mode]
        ends = (number(hz[low]), rows.name[low], number(hz[high]), rows.name[high])
        found.append(
            (
                str(mode + 1),
                *ends,
                number(np.nanmax(half), 2),
                percent(np.nanmin(ratio)),
                percent(np.nanmax(ratio)),
            )
        )
    columns = (
        words("Mode"),
        Column("Lowest", "Hz"),
        words("at"),
        Column("Highest", "Hz"),
        words("at"),
        Column("± at most", "%"),
        Column("Damping from", "%"),
        Column("to", "%"),
    )
    note = "Modes are numbered by frequency at each posture, so where two cross they change places."
    return Table("Modes over the postures", columns, tuple(found), note)


def posture_table(result: MapResult) -> Table:
    """Every posture: where the tool is, the first modes with their intervals, static and largest
    receptance.
    """
    rows, shown = result.rows, min(3, result.rows.frequency_hz.shape[1])
    found = []
    for k, name in enumerate(rows.name):
        modes: list[str] = []
        for mode in range(shown):
            hz = rows.frequency_hz[k, mode]
            half = 50 * (rows.frequency_high_95[k, mode] - rows.frequency_low_95[k, mode]) / hz
            modes += [number(hz), number(half, 2), percent(rows.damping_ratio[k, mode])]
        static = 1e6 * np.diag(rows.compliance_m_per_n[k])
        numbers = (
            *map(number, rows.tool_m[k]),
            *modes,
            *map(number, static),
            *map(number, 1e6 * rows.peak_m_per_n[k]),
        )
        found.append((name, *map(number, rows.posture_deg[k]), *numbers))
    heads = [
        column
        for mode in range(1, shown + 1)
        for column in (Column(f"Mode {mode}", "Hz"), Column("±", "%"), Column("Damping", "%"))
    ]
    tool, static_heads, peaks = (
        [Column(f"{what} {axis}", of) for axis in "xyz"]
        for what, of in (("Tool", "m"), ("Static", "µm/N"), ("Largest", "µm/N"))
    )
    angles = [Column(f"Joint {joint}", "°") for joint in range(1, rows.posture_deg.shape[1] + 1)]
    return Table("Postures", (words("Posture"), *angles, *tool, *heads, *static_heads, *peaks), tuple(found))


_LEARNED = {
    "frequency": ("Frequency", "Hz", 1.0),
    "damping": ("Damping", "%", 100.0),
    "peak": ("Peak", "µm/N", 1e6),
}


def process_table(learnt: Learnt) -> Table:
    """What measured postures tell of what the model lacks."""
    p, found = learnt.processes, []
    for row, quantity in enumerate(p.quantity):
        chance = 1 / (1 + np.exp(-p.log_odds[row]))
        sizes = percent(p.amplitude[row]), number(p.length_deg[row], 2), percent(p.scatter[row])
        shared = (number(p.shared[row], 2),) if learnt.like else ()
        counts = str(p.postures[row]), str(p.numbers[row])
        told = number(p.log_odds[row], 3), number(chance, 2)
        found.append((_LEARNED[quantity][0], *counts, *told, *sizes, *shared))
    columns = [words("Of the"), Column("Postures", ""), Column("Numbers", ""), Column("Log odds", "")]
    columns += [Column("Probability", ""), Column("Size", "%"), Column("Another after", "°")]
    columns += [Column("Scatter", "%"), *([Column("Shared", "")] if learnt.like else [])]
    note = (
        "Log odds for an error that goes with the posture, over scatter alone; size and angle of such a one."
    )
    if learnt.like:
        note += f" Shared: its correlation between this robot and those of {', '.join(learnt.like)}."
    return Table("What the map does not know", tuple(columns), tuple(found), note)


def left_out_table(learnt: Learnt) -> Table:
    """Each measured posture as all others tell it."""
    t, found = learnt.left_out, []
    for row, quantity in enumerate(t.quantity):
        of, scale = _LEARNED[quantity][1:]
        values = (scale * one[row] for one in (t.measured, t.model, t.corrected, t.low_95, t.high_95))
        inside = "yes" if t.low_95[row] <= t.measured[row] <= t.high_95[row] else "no"
        found.append(
            (t.measurement[row], _what(quantity, int(t.item[row])), of, *map(number, values), inside)
        )
    heads = [words("Measurement"), words("What"), words("Unit")]
    heads += [Column(head, "") for head in ("Measured", "Model", "Corrected", "95 % low", "95 % high")]
    note = "Each posture is left out in turn, and told by the others alone. Axes of peaks are the sensor's."
    return Table("Measured postures, each told by the others", (*heads, words("Inside")), tuple(found), note)


def corrected_table(result: MapResult) -> Table | None:
    """The first modes and the peaks at every posture as the model has them, and corrected; None where nothing
    was learned.
    """
    c, rows, found = result.correction, result.rows, []
    if c is None:
        return None
    hz = rows.frequency_hz, c.frequency_hz, c.frequency_low_95, c.frequency_high_95, c.frequency_known
    ratio = rows.damping_ratio, c.damping_ratio, c.damping_low_95, c.damping_high_95, c.damping_known
    peak = rows.peak_m_per_n, c.peak_m_per_n, c.peak_low_95, c.peak_high_95, c.peak_known
    for k, name in enumerate(rows.name):
        for quantity, (*values, known) in (("frequency", hz), ("damping", ratio), ("peak", peak)):
            of, scale = _LEARNED[quantity][1:]
            for item in range(min(3, known.shape[1])):
                if np.isfinite(known[k, item]):
                    cells = (number(scale * one[k, item]) for one in values)
                    share = number(100 * known[k, item], 2)
                    found.append((name, _what(quantity, item + 1), of, *cells, share))
    heads = [words("Posture"), words("What"), words("Unit")]
    heads += [Column(head, "") for head in ("Model", "Corrected", "95 % low", "95 % high")]
    note = (
        "With 95 % intervals of what would be measured. Known: how much of the variance before any data the"
        " measured postures take away; 0 far from all of them, where the interval is the widest."
    )
    return Table("Corrected by measured postures", (*heads, Column("Known", "%")), tuple(found), note)


def _what(quantity: str, item: int) -> str:
    name = _LEARNED[quantity][0]
    return f"{name} along {'xyz'[item - 1]}" if quantity == "peak" else f"{name} of mode {item}"
