"""The tables of a map of postures, as finished text; HTML and PDF print the same ones."""

from __future__ import annotations

import numpy as np

from identify.reports.kit.cells import Column, Table, number, percent, turns_per_minute, words
from identify.results.map import MapResult


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
