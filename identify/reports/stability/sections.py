"""The report of depth limits: lobes with bands, the methods side by side, feeds, and the tip's receptance."""

from __future__ import annotations

import numpy as np

from identify.core.arrays import Array
from identify.reports.kit.banded import Line, Panel, Plot
from identify.reports.kit.cells import (
    Column,
    Table,
    angles,
    digits,
    limited,
    number,
    percent,
    ready,
    several,
    signed,
    turns_per_minute,
    words,
)
from identify.reports.kit.report import EVERYWHERE, Report, Section, Tabular, Tiles, origin
from identify.results.stability import StabilityResult

_AXES = ("feed", "normal to it", "spindle, from the tip")
_NAMES = ("feed", "normal", "axis")
_SEVERAL = 1.5
"""The plot ends at so many times the deepest stable cut."""


def report(result: StabilityResult) -> Report:
    """What is said of depth limits."""
    lobes, feeds, tip = (plot(result).drawing() for plot in (_lobes, _feeds, _tip))
    limits = Tabular(limit_table(result), sort="limits", limit=20)
    modes = Tabular(mode_table(result)) if len(result.mode_hz) else None
    sections = [
        Section("lobes", "Depth limits", [lobes, limits], "Lobes"),
        Section("methods", "Methods", [Tabular(check_table(result))]),
        Section("feeds", "Feed direction", [feeds, Tabular(feed_table(result))]),
        Section("tip", "Receptance of the tip", [tip, modes], "Tip"),
        *origin(result, "Tool"),
    ]
    return Report(_tiles(result), [Tabular(place_table(result), on=EVERYWHERE)], sections)


def _tiles(result: StabilityResult) -> Tiles:
    limits = result.limits
    worst, best = int(np.argmin(limits.depth_m)), int(np.argmax(limits.low_95))

    def mm(value: float) -> str:
        return number(1e3 * value, 3)

    band = f"95 %: {mm(limits.low_95[worst])} to {mm(limits.high_95[worst])} mm"
    there = f"at {limits.rpm[best]:,.0f} rpm; 95 % from {mm(limits.low_95[best])} mm"
    coupled, low, high = map(mm, result.coupling[:3])
    enters, leaves = (number(angle, 3) for angle in result.engagement_deg)
    cut = f"at {result.place}, entering at {enters}° and leaving at {leaves}°"
    return (
        ("Stable at every speed", f"{mm(limits.depth_m[worst])} mm", band),
        ("Deepest cut", f"{mm(limits.depth_m[best])} mm", there),
        ("Mode coupling", f"{coupled} mm", f"without regeneration; 95 %: {low} to {high} mm"),
        ("Tool", result.tool, cut),
    )


def limit_table(result: StabilityResult) -> Table:
    """Every speed."""
    limits = result.limits
    columns = [
        Column("Speed", "rpm", limits.rpm, turns_per_minute),
        *limited("Limit", "mm", (1e3 * one for one in (limits.depth_m, limits.low_95, limits.high_95))),
        Column("Chatter", "Hz", limits.chatter_hz),
        Column("Zeroth order", "mm", 1e3 * limits.zeroth_order),
    ]
    note = "∞: stable up to the largest depth. Zeroth order: with the mean cutting force alone."
    return Table("Depth limits", columns, note)


def check_table(result: StabilityResult) -> Table:
    """The methods side by side."""
    checks, domain = result.checks, result.checks.semi_discretization
    several_lines = checks.multi_frequency
    in_time = np.full(len(checks.rpm), np.nan) if domain is None else domain
    known = np.isfinite(several_lines) & np.isfinite(in_time)
    apart = np.full(len(checks.rpm), np.nan)
    apart[known] = 100 * (several_lines[known] / in_time[known] - 1)
    columns = [
        Column("Speed", "rpm", checks.rpm, turns_per_minute),
        Column("Zeroth order", "mm", 1e3 * checks.zeroth_order),
        Column("Multi-frequency", "mm", 1e3 * several_lines),
        Column("Semi-discretisation", "mm", 1e3 * in_time),
        Column("Difference of the last two", "%", apart, lambda value: signed(value, 2)),
    ]
    return Table("The same limit by each method", columns)


def feed_table(result: StabilityResult) -> Table:
    """The least limit over the speeds, over the direction of the feed."""
    turned = np.radians(result.feed_deg)[:, None]
    along = np.round(np.cos(turned) * result.axes[0] + np.sin(turned) * result.axes[1], 9) + 0.0
    columns = [
        Column("Feed turned by", "°", result.feed_deg),
        Column("Least limit", "mm", 1e3 * result.feed_depth_m),
        *several([f"Feed {axis}" for axis in "xyz"], "", along, digits(3)),
    ]
    note = (
        "About the spindle, from the tool's own feed; its direction in the base's axes. Zeroth order, the"
        " least over all speeds."
    )
    return Table("Feed directions", columns, note)


def mode_table(result: StabilityResult) -> Table:
    """The modes at this posture."""
    columns = [
        words("Mode", range(1, len(result.mode_hz) + 1)),
        Column("Frequency", "Hz", result.mode_hz),
        Column("Damping", "%", result.mode_damping, percent),
    ]
    return Table("Modes at this posture", columns)


def place_table(result: StabilityResult) -> Table:
    """Where the tool is, and how it looks."""
    rows = [("tip (m)", *map(number, result.tip_m))] if result.joints else []
    rows += [
        (name, *(number(value, 3) for value in np.round(axis, 9)))
        for name, axis in zip(_AXES, result.axes, strict=True)
    ]
    whose = "base's" if result.joints else "file's"
    heads = (words(f"In the {whose} axes"), *(Column(axis, form=ready) for axis in "xyz"))
    kt, kr, ka = (f"{value / 1e6:.4g}" for value in result.cutting)
    stand = f"Joints at ({angles(result.posture_deg)})°. " if result.joints else ""
    note = (
        f"{stand}Cutting coefficients {kt} (tangential), {kr} (radial), {ka} (axial) N/mm²: {result.source}."
    )
    return Table.of("The tool on the robot" if result.joints else "The tool", heads, rows, note)


def _lobes(result: StabilityResult) -> Plot:
    limits, checks = result.limits, result.checks
    rpm, deepest = limits.rpm, 1e3 * result.max_depth_m
    finite = limits.depth_m[np.isfinite(limits.depth_m)]
    top = min(deepest, _SEVERAL * 1e3 * float(finite.max())) if finite.size else deepest

    def mm(values: Array) -> Array:
        return np.minimum(1e3 * values, deepest)

    lines = [
        Line("limit, with 95 % band", rpm, mm(limits.depth_m), mm(limits.low_95), mm(limits.high_95)),
        Line("zeroth order", rpm, mm(limits.zeroth_order)),
        Line("multi-frequency", checks.rpm, mm(checks.multi_frequency), points=True),
    ]
    if np.isfinite(result.coupling[0]):
        lines.append(Line("mode coupling", rpm, np.full(len(rpm), 1e3 * result.coupling[0])))
    depth = Panel(Column("Depth of cut", "mm"), lines, top=top)
    chatter = Panel(Column("Chatter", "Hz"), [Line("frequency of chatter", rpm, limits.chatter_hz)])
    caption = (
        f"Above the line the cut of {result.tool} chatters, at the frequency below; bands by {result.draws}"
        " draws of the uncertainty of fit, model, cut and posture."
    )
    return Plot("lobes-plot", Column("Spindle speed", "rpm"), [depth, chatter], caption, log_x=True)


def _feeds(result: StabilityResult) -> Plot:
    angle = np.append(result.feed_deg, 360.0)
    depth = 1e3 * np.minimum(np.append(result.feed_depth_m, result.feed_depth_m[0]), result.max_depth_m)
    line = Line("least limit over the speeds", angle, depth)
    panel = Panel(Column("Least limit", "mm"), [line], top=1.1 * depth.max())
    caption = "The least depth limit over all speeds, over the direction of the feed about the spindle."
    return Plot("feeds-plot", Column("Feed turned about the spindle by", "°"), [panel], caption)


def _tip(result: StabilityResult) -> Plot:
    tip = result.tip
    size, half = 1e6 * np.abs(tip.receptance).astype(float), 1e6 * tip.band_95.astype(float)
    direct = [
        Line.within(f"along {name}", tip.line_hz, size[:, k, k], half[:, k, k])
        for k, name in enumerate(_NAMES)
    ]
    cross = [
        Line(f"{_NAMES[row]} by {_NAMES[column]}", tip.line_hz, np.maximum(size[:, row, column], 1e-9))
        for row, column in ((0, 1), (0, 2), (1, 2))
    ]
    panels = [
        Panel(Column("Direct", "µm/N"), direct, log=True),
        Panel(Column("Cross", "µm/N"), cross, log=True),
    ]
    caption = "Receptance of the tip along the tool's axes, with 95 % bands; the cross terms are symmetric."
    return Plot("tip-plot", Column("Frequency", "Hz"), panels, caption)
