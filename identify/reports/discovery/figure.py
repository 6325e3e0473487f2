"""Figures of a discovery in the PDF: where the gap lives, the candidates, the fall of the gap, and gap maps
before and after.
"""

from __future__ import annotations

from textwrap import fill

import numpy as np

from identify.core.arrays import Array
from identify.core.thresholds import CONVINCING
from identify.reports.discovery.pick import (
    STANDINGS,
    Bars,
    Fall,
    few,
    gap_maps,
    gaps_on_robot,
    is_wide,
    reach,
    standings,
)
from identify.reports.kit import plotting as mpl
from identify.reports.kit.cells import NONE, number
from identify.reports.kit.figures import (
    BLUE,
    DIVERGING,
    GRID,
    INK,
    MUTED,
    PALETTE,
    WIDTH_IN,
    Room,
    decades_beside,
    head,
    plain_decades,
    wide,
)
from identify.reports.shared import robot_figure
from identify.results.discovery import DiscoveryResult, StepResult

GAP = "Gap: residual / noise (1 = noise)"
_STANDING = ((PALETTE[0], "o"), (PALETTE[4], "D"), (PALETTE[7], "o"))
_COLUMNS, _ROW_IN, _HEAD_IN = 3, 0.145, 0.55
_LABEL = 48
"""Characters of a name in one line beside an axis."""
_MOST_CHANNELS = 60
"""Channels that a map of the PDF has labels for."""


def parts(bars: list[Bars]) -> mpl.Figure:
    """The gap in the parts of the fitted data, a panel a kind, in columns of about the same height."""
    columns: list[list[Bars]] = [[] for _ in range(_COLUMNS)]
    for one in sorted(bars, key=lambda b: -len(b.names)):
        min(columns, key=lambda column: sum(_height(b) for b in column)).append(one)
    columns = [column for column in columns if column]
    high = max(sum(_height(b) for b in column) for column in columns)
    figure = mpl.Figure((WIDTH_IN, high))
    most = max(float(b.gap.max()) for b in bars)
    for place, column in enumerate(columns):
        top = 0.0
        for one in column:
            axes = figure.add_axes(_box(place, len(columns), top, one, high))
            _bars(axes, one, most)
            top += _height(one)
    return figure


def on_robot(result: DiscoveryResult) -> mpl.Figure:
    """The gap at every point of the robot, and where the added effects sit."""
    found, far = gaps_on_robot(result), reach(result)
    marks = robot_figure.Marks(result.marks.at_m, result.marks.along)
    colors = robot_figure.Colors(mpl.shades(DIVERGING), (1 / far, far))
    return robot_figure.coloured(found.geometry, found.gaps, marks, colors, GAP)


def _height(bars: Bars) -> float:
    """Of a panel with its title and axis, inches."""
    return _HEAD_IN + _ROW_IN * len(bars.names)


def _box(place: int, columns: int, top: float, bars: Bars, high: float) -> tuple[float, float, float, float]:
    """Left, bottom, width, height of a panel in parts of the figure; room for names on its left and shares on
    its right.
    """
    inside = _ROW_IN * len(bars.names)
    width = 1 / columns
    return place * width + 0.11, 1 - (top + 0.2 + inside) / high, width - 0.15, inside / high


def _bars(axes: mpl.Axes, bars: Bars, most: float) -> None:
    rows = np.arange(len(bars.names))
    axes.barh(rows, bars.gap, color=BLUE, height=0.7)
    axes.axvline(1.0, color=INK, lw=0.6, ls=":")
    for row, share in enumerate(bars.share):
        axes.annotate(
            share, (bars.gap[row], row), (2, 0), textcoords="offset points", va="center", fontsize=6
        )
    axes.set(ylim=(len(rows) - 0.5, -0.5), xlim=(0, 1.05 * max(most, 1.0)))
    axes.set_xlabel("Gap (1 = noise)", fontsize=7, labelpad=1)
    axes.set_yticks(rows, bars.names, fontsize=6.5)
    axes.tick_params(length=0, pad=2, axis="y")
    axes.tick_params(labelsize=6.5, axis="x", pad=1.5)
    axes.grid(False, axis="y")
    axes.set_title(
        bars.title if bars.total == len(bars.names) else f"{bars.title}, {len(bars.names)} of {bars.total}",
        pad=3,
        x=-0.0,
    )


def options(step: StepResult) -> mpl.Figure:
    """The best candidates: the gap that each leaves on fitted and on other data, and the evidence for it."""
    o, chosen = step.options, few(step.options)
    names, gap, other, evidence = (
        o.sentence[chosen],
        o.gap[chosen],
        o.gap_validation[chosen],
        o.log_odds[chosen],
    )
    rows, labels = np.arange(len(names)), [fill(name, _LABEL) for name in names]
    lines = 1 + max((label.count("\n") for label in labels), default=0)
    figure = mpl.Figure((WIDTH_IN, 0.85 + (0.06 + 0.11 * lines) * len(rows)))
    left, right = Room(0.15 + wide(labels, 7), top=0.28).axes(figure, (3, 2))
    left.hlines(rows, np.minimum(gap, step.gap), np.maximum(gap, step.gap), color=GRID, lw=3, zorder=1)
    known = np.flatnonzero(np.isfinite(evidence))
    worth = np.maximum(evidence[known], 1.0)
    right.hlines(known, 1.0, worth, color=GRID, lw=3, zorder=1)
    stand = np.array(standings(step))
    for number_of, (color, marker) in enumerate(_STANDING):
        own = stand == number_of
        if own.any():
            left.plot(gap[own], rows[own], marker, color=color, ms=4.5, label=STANDINGS[number_of])
            right.plot(worth[own[known]], known[own[known]], marker, color=color, ms=4.5)
    left.plot(other, rows, "o", mfc="none", mec=INK, mew=0.7, ms=6.5, label="on other data")
    left.axvline(step.gap, color=INK, lw=0.7, ls="--", label="without it")
    left.axvline(1.0, color=INK, lw=0.7, ls=":")
    left.set_yticks(rows, labels, fontsize=7)
    left.tick_params(length=0, axis="y")
    left.set(ylim=(len(rows) - 0.5, -0.6))
    left.grid(False, axis="y")
    _gap_axis(left, np.concatenate([gap, other, [step.gap, 1.0]]))
    _evidence_axis(right, evidence)
    head(figure, left, 5)
    return figure


def _evidence_axis(axes: mpl.Axes, evidence: Array) -> None:
    """Logarithmic, with a line where evidence convinces, and words where there is none."""
    for row in np.flatnonzero(~np.isfinite(evidence)):
        axes.text(1.1, float(row), "ruled out on few lines", fontsize=6, color=MUTED, va="center")
    axes.axvline(CONVINCING, color=PALETTE[1], lw=0.7, ls=":", zorder=0)
    high = max(100.0, float(np.max(evidence, where=np.isfinite(evidence), initial=1.0)))
    axes.set(xscale="log", xlim=(0.8, 2.0 * high), xlabel=f"Evidence ({NONE})")
    axes.xaxis.set_major_locator(mpl.LogLocator(numticks=6))
    axes.xaxis.set_minor_locator(mpl.NullLocator())
    axes.grid(False, axis="y")


def _gap_axis(axes: mpl.Axes, values: Array) -> None:
    """From noise up, logarithmic where gaps are far apart."""
    axes.set_xlabel(GAP)
    values = values[np.isfinite(values)]  # a model without a solution leaves an infinite gap
    low, high = float(values.min()), float(values.max())
    if not is_wide(values):
        axes.set_xlim(low - 0.12 * (high - low + 0.1), high + 0.3 * (high - low + 0.1))
        return
    axes.set(xscale="log", xlim=(low / 1.12, high * 1.5))
    plain_decades(axes.xaxis)


def falls(rows: list[Fall]) -> mpl.Figure:
    """The gap of each model from noise up, and what every addition does to it."""
    figure = mpl.Figure((WIDTH_IN, 0.85 + 0.36 * len(rows)))
    labels = [fill(row.label, _LABEL) for row in rows]
    [axes] = Room(0.15 + wide(labels), top=0.28).axes(figure)
    begin, end = (np.array([getattr(row, side) for row in rows]) for side in ("begin", "end"))
    for side, (name, color) in enumerate((("fitted data", PALETTE[0]), ("other data", PALETTE[1]))):
        for row, one in enumerate(rows):
            if np.isnan(end[row, side]):
                continue
            low, high = sorted((begin[row, side], end[row, side]))
            at, label = row + 0.4 * side - 0.2, name if row == 0 else None
            axes.barh(
                at,
                high - low,
                left=low,
                height=0.36,
                color=color,
                alpha=1.0 if one.whole else 0.45,
                label=label,
            )
            right = end[row, side] >= begin[row, side]
            place = ((3 if right else -3), 0)
            text = number(end[row, side])
            align = "left" if right else "right"
            axes.annotate(
                text,
                (end[row, side], at),
                place,
                textcoords="offset points",
                va="center",
                ha=align,
                fontsize=6.5,
            )
    _gap_axis(axes, np.concatenate([begin.ravel(), end.ravel()]))
    low, high = axes.get_xlim()
    axes.set_xlim(low / 1.25 if is_wide(end.ravel()) else low - 0.08 * (high - low), high)
    axes.axvline(1.0, color=INK, lw=0.7, ls=":")
    axes.set(ylim=(len(rows) - 0.5, -0.5))
    axes.set_yticks(range(len(rows)), labels)
    axes.tick_params(length=0, axis="y")
    axes.grid(False, axis="y")
    head(figure, axes, 2)
    return figure


def gap_map(result: DiscoveryResult, number_of: int) -> mpl.Figure:
    """The gap of one measurement by band and channel, of the study's and of the final model in the same
    colours.
    """
    title, panels = gap_maps(result)[number_of]
    channels, bands = result.map_before.channels, result.map_before.bands_hz
    most = reach(result)
    figure = mpl.Figure((WIDTH_IN, float(np.clip(0.85 + 0.075 * len(channels), 1.8, 5.2))))
    several, beside = Room(0.35 + wide(channels, 5), top=0.42).with_bar(figure, len(panels))
    every = -(-len(channels) // _MOST_CHANNELS)
    for axes, (label, gap) in zip(several, panels, strict=True):
        rows = np.arange(len(channels) + 1)
        mesh = axes.pcolormesh(
            bands,
            rows,
            np.maximum(gap.T, 1e-6),
            norm=mpl.LogNorm(1 / most, most),
            cmap=mpl.shades(DIVERGING),
            rasterized=True,
        )
        axes.grid(False)
        axes.set(
            xscale="log",
            xlabel="Frequency (Hz)",
            title=label,
            ylim=(len(channels), 0),
            xlim=(bands[0], bands[-1]),
        )
        plain_decades(axes.xaxis)
    several[0].set_ylabel("Response channel")
    several[0].set_yticks(np.arange(0, len(channels), every) + 0.5, channels[::every], fontsize=5)
    several[0].tick_params(length=0, axis="y")
    decades_beside(figure.colorbar(mesh, cax=beside), GAP, (1 / most, most))
    figure.suptitle(title, fontsize=8.5, x=0.01, y=1.0, ha="left")
    return figure
