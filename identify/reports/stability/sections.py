"""The report of depth limits: lobes with bands, the methods side by side, feeds, and the tip's receptance."""

from __future__ import annotations

import numpy as np

from identify.core.arrays import Array
from identify.reports.kit.banded import SCRIPTS, Line, Panel, Plot
from identify.reports.kit.cells import Column
from identify.reports.kit.report import EVERYWHERE, Report, Section, Tabular, origin
from identify.reports.stability import tables
from identify.results.stability import StabilityResult

_NAMES = ("feed", "normal", "axis")
_SEVERAL = 1.5
"""The plot ends at so many times the deepest stable cut."""


def report(result: StabilityResult) -> Report:
    """What is said of depth limits."""
    plots = (_lobes(result), _feeds(result), _tip(result))
    lobes, feeds, tip = (plot.drawing() for plot in plots)
    limits = Tabular(tables.limit_table(result), sort="limits", limit=20)
    sections = [
        Section("lobes", "Depth limits", [lobes, limits], "Lobes", plots[0].data(), SCRIPTS),
        Section("methods", "Methods", [Tabular(tables.check_table(result))]),
        Section(
            "feeds",
            "Feed direction",
            [feeds, Tabular(tables.feed_table(result))],
            "",
            plots[1].data(),
            SCRIPTS,
        ),
        Section(
            "tip",
            "Receptance of the tip",
            [tip, *([Tabular(tables.mode_table(result))] if len(result.mode_hz) else [])],
            "Tip",
            plots[2].data(),
            SCRIPTS,
        ),
        *origin(result, "Tool"),
    ]
    return Report(tables.tiles(result), [Tabular(tables.place_table(result), on=EVERYWHERE)], sections)


def _lobes(result: StabilityResult) -> Plot:
    limits, checks = result.limits, result.checks
    rpm, deepest = limits.rpm, 1e3 * result.max_depth_m
    finite = limits.depth_m[np.isfinite(limits.depth_m)]
    top = min(deepest, _SEVERAL * 1e3 * float(finite.max())) if finite.size else deepest
    coupling = np.full(len(rpm), 1e3 * result.coupling[0])

    def mm(values: Array) -> Array:
        return np.minimum(1e3 * values, deepest)

    lines = [
        Line("limit, with 95 % band", rpm, mm(limits.depth_m), mm(limits.low_95), mm(limits.high_95)),
        Line("zeroth order", rpm, mm(limits.zeroth_order)),
        Line("multi-frequency", checks.rpm, mm(checks.multi_frequency), points=True),
    ]
    if np.isfinite(result.coupling[0]):
        lines.append(Line("mode coupling", rpm, coupling))
    depth = Panel(Column("Depth of cut", "mm"), lines, top=top)
    chatter = Panel(Column("Chatter", "Hz"), [Line("frequency of chatter", rpm, limits.chatter_hz)])
    caption = (
        f"Above the line the cut of {result.tool} chatters, at the frequency below; bands of {result.draws}"
        " draws of what fit, model, cut and posture leave open."
    )
    return Plot("lobes-plot", Column("Spindle speed", "rpm"), [depth, chatter], caption, log_x=True)


def _feeds(result: StabilityResult) -> Plot:
    angle = np.append(result.feed_deg, 360.0)
    depth = 1e3 * np.minimum(np.append(result.feed_depth_m, result.feed_depth_m[0]), result.max_depth_m)
    panel = Panel(
        Column("Least limit", "mm"),
        [Line("least limit over the speeds", angle, depth)],
        top=1.1 * depth.max(),
    )
    caption = "The least depth limit over all speeds, over the direction of the feed about the spindle."
    return Plot("feeds-plot", Column("Feed turned about the spindle by", "°"), [panel], caption)


def _tip(result: StabilityResult) -> Plot:
    tip = result.tip
    size, half = 1e6 * np.abs(tip.receptance).astype(float), 1e6 * tip.band_95.astype(float)
    hz = tip.line_hz
    direct = [
        Line(
            f"along {name}",
            hz,
            size[:, k, k],
            np.maximum(size[:, k, k] - half[:, k, k], 1e-3 * size[:, k, k]),
            size[:, k, k] + half[:, k, k],
        )
        for k, name in enumerate(_NAMES)
    ]
    cross = [
        Line(f"{_NAMES[row]} by {_NAMES[column]}", hz, np.maximum(size[:, row, column], 1e-9))
        for row, column in ((0, 1), (0, 2), (1, 2))
    ]
    panels = [
        Panel(Column("Direct", "µm/N"), direct, log=True),
        Panel(Column("Cross", "µm/N"), cross, log=True),
    ]
    caption = "Receptance of the tip along the tool's axes, with 95 % bands; the cross terms are symmetric."
    return Plot("tip-plot", Column("Frequency", "Hz"), panels, caption)
