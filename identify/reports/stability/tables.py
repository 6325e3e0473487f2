"""The tables of depth limits, as finished text; HTML and PDF print the same ones."""

from __future__ import annotations

import numpy as np

from identify.reports.kit.cells import Column, Table, number, percent, signed, turns_per_minute, words
from identify.results.stability import StabilityResult

_AXES = ("feed", "normal to it", "spindle, from the tip")


def tiles(result: StabilityResult) -> tuple[tuple[str, str, str], ...]:
    """The few numbers that are read first."""
    limits = result.limits
    worst, best = int(np.argmin(limits.depth_m)), int(np.argmax(limits.low_95))
    coupled = 1e3 * result.coupling
    return (
        (
            "Stable at every speed",
            f"{number(1e3 * limits.depth_m[worst], 3)} mm",
            f"95 %: {number(1e3 * limits.low_95[worst], 3)} to {number(1e3 * limits.high_95[worst], 3)} mm",
        ),
        (
            "Deepest cut",
            f"{number(1e3 * limits.depth_m[best], 3)} mm",
            f"at {limits.rpm[best]:,.0f} rpm; 95 % from {number(1e3 * limits.low_95[best], 3)} mm",
        ),
        (
            "Mode coupling",
            f"{number(coupled[0], 3)} mm",
            f"without regeneration; 95 %: {number(coupled[1], 3)} to {number(coupled[2], 3)} mm",
        ),
        (
            "Tool",
            result.tool,
            f"at {result.place}, entering at {number(result.engagement_deg[0], 3)}° and leaving"
            f" at {number(result.engagement_deg[1], 3)}°",
        ),
    )


def limit_table(result: StabilityResult) -> Table:
    """Every speed."""
    limits = result.limits
    columns = (limits.rpm, *(1e3 * values for values in (limits.depth_m, limits.low_95, limits.high_95)))
    rows = zip(*columns, limits.chatter_hz, 1e3 * limits.zeroth_order, strict=True)
    heads = (
        Column("Speed", "rpm"),
        Column("Limit", "mm"),
        Column("95 % low", "mm"),
        Column("95 % high", "mm"),
        Column("Chatter", "Hz"),
        Column("Zeroth order", "mm"),
    )
    note = "∞: stable up to the largest depth. Zeroth order knows the mean of the cut alone."
    return Table(
        "Depth limits", heads, tuple((turns_per_minute(row[0]), *map(number, row[1:])) for row in rows), note
    )


def check_table(result: StabilityResult) -> Table:
    """The methods side by side."""
    checks = result.checks
    domain = checks.semi_discretization
    in_time = np.full(len(checks.rpm), np.nan) if domain is None else domain
    rows = zip(
        checks.rpm, 1e3 * checks.zeroth_order, 1e3 * checks.multi_frequency, 1e3 * in_time, strict=True
    )
    heads = (
        Column("Speed", "rpm"),
        Column("Zeroth order", "mm"),
        Column("Multi-frequency", "mm"),
        Column("Semi-discretisation", "mm"),
        Column("Difference of the last two", "%"),
    )
    cells = []
    for row in rows:
        apart = 100 * (row[2] / row[3] - 1) if np.isfinite(row[2:]).all() else np.nan
        cells.append((turns_per_minute(row[0]), *map(number, row[1:]), signed(apart, 2)))
    return Table("The same limit by each method", heads, tuple(cells))


def feed_table(result: StabilityResult) -> Table:
    """The least limit over the speeds, over the direction of the feed."""
    turned = np.radians(result.feed_deg)[:, None]
    along = np.round(np.cos(turned) * result.axes[0] + np.sin(turned) * result.axes[1], 9) + 0.0
    rows = zip(result.feed_deg, 1e3 * result.feed_depth_m, along, strict=True)
    heads = (
        Column("Feed turned by", "°"),
        Column("Least limit", "mm"),
        *(Column(f"Feed {axis}") for axis in "xyz"),
    )
    note = (
        "About the spindle, from the tool's own feed; its direction in the base's axes. Zeroth order, the"
        " least over all speeds."
    )
    cells = tuple((number(angle), number(depth), *(number(v, 3) for v in d)) for angle, depth, d in rows)
    return Table("Feed directions", heads, cells, note)


def mode_table(result: StabilityResult) -> Table:
    """The modes at this posture."""
    rows = zip(result.mode_hz, result.mode_damping, strict=True)
    cells = tuple((str(k), number(hz), percent(damping)) for k, (hz, damping) in enumerate(rows, 1))
    return Table(
        "Modes at this posture", (words("Mode"), Column("Frequency", "Hz"), Column("Damping", "%")), cells
    )


def place_table(result: StabilityResult) -> Table:
    """Where the tool is, and how it looks."""
    rows = [("tip (m)", *map(number, result.tip_m))] if result.joints else []
    rows += [
        (name, *(number(value, 3) for value in np.round(axis, 9)))
        for name, axis in zip(_AXES, result.axes, strict=True)
    ]
    whose = "base's" if result.joints else "file's"
    heads = (words(f"In the {whose} axes"), Column("x"), Column("y"), Column("z"))
    angles = ", ".join(f"{angle:.4g}" for angle in result.posture_deg)
    kt, kr, ka = (f"{value / 1e6:.4g}" for value in result.cutting)
    stand = f"Joints at ({angles})°. " if result.joints else ""
    note = (
        f"{stand}Cutting coefficients {kt} (tangential), {kr} (radial), {ka} (axial) N/mm²: {result.source}."
    )
    return Table("The tool on the robot" if result.joints else "The tool", heads, tuple(rows), note)
