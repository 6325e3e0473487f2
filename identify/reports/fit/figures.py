"""Figures of a fit in the PDF: parameters and their profile likelihoods, convergence, every start, and how
estimates hang together.
"""

from __future__ import annotations

import numpy as np

from identify.core.arrays import Array
from identify.fitting.uncertainty import AT_LOWER, AT_UPPER
from identify.reports.kit import plotting as mpl
from identify.reports.kit.banded import Line, Panel, Plot
from identify.reports.kit.cells import NONE, Column, unit
from identify.reports.kit.figures import (
    BLUE,
    DIVERGING,
    INK,
    MUTED,
    PALETTE,
    WIDTH_IN,
    Room,
    head,
    plain_decades,
    wide,
)
from identify.reports.shared.parameters import between_bounds, free_names, half_interval
from identify.results.fit import FitResult

PLACES = ("initial", "value", "low_95", "high_95")
"""What of a parameter is drawn between its bounds."""

_STATUS = {
    "determined": ("#0072b2", "o"),
    "weak": ("#e69f00", "D"),
    "not determined": ("#d55e00", "X"),
    AT_LOWER: ("#cc79a7", "v"),
    AT_UPPER: ("#cc79a7", "^"),
    "fixed": ("#7f7f7f", "s"),
}
_WIDE = 10.0
"""Ratio from which a logarithmic axis pays."""
_LIMIT = 3.84
"""Rise of chi-square by which a parameter is at its 95 % limit."""
_TILTED = 0.82
"""The sine of 55 degrees, by which names are turned."""
_AGREES = 1e-3
"""Starts whose costs differ by less than this part have found the same minimum."""


def parameters(result: FitResult) -> mpl.Figure:
    """Left, start and fitted values with their intervals between the bounds; right, the size of the
    intervals.
    """
    table = result.parameters
    rows = np.arange(len(table.name))
    figure = mpl.Figure((WIDTH_IN, 0.75 + 0.165 * len(rows)))
    left, right = Room(0.15 + wide(table.name), bottom=0.4, top=0.3).axes(figure, (3, 2), 0.35)
    place = {name: between_bounds(table, getattr(table, name)) for name in PLACES}
    left.plot(place["initial"], rows, "o", mfc="none", mec=MUTED, ms=4.5, label="start")
    left.hlines(rows, place["low_95"], place["high_95"], color=INK, lw=0.9)
    half = 100 * half_interval(table)
    for status, (color, marker) in _STATUS.items():
        chosen = np.array([s == status for s in table.status])
        if chosen.any():
            left.plot(place["value"][chosen], rows[chosen], marker, color=color, ms=4.5, label=status)
            right.plot(half[chosen], rows[chosen], marker, color=color, ms=4.5)
    left.set(
        xlim=(-0.02, 1.02),
        xlabel=f"Place between the bounds ({NONE})",
        yticks=rows,
        ylim=(len(rows) - 0.5, -0.5),
    )
    left.set_xticks([0, 0.25, 0.5, 0.75, 1], ["lower", "¼", "½", "¾", "upper"])
    left.set_yticklabels(table.name)
    right.set(xscale="log", xlabel="Half the 95 % interval (% of the value)")
    plain_decades(right.xaxis)
    head(figure, left, 5)
    return figure


def profiles(result: FitResult) -> Plot:
    """Profile likelihoods, three a row."""
    p, panels = result.parameters, []
    for name, curve in result.profiles.items():
        row, ends = p.name.index(name), np.array([curve.values.min(), curve.values.max()])
        top = min(max(5.0, float(np.nanmax(curve.rise))), 20.0)
        limit = Line("3.84", ends, np.full(2, _LIMIT))
        lines = [Line("rise of chi-square", curve.values, curve.rise), limit]
        wide = bool(p.log[row] and ends[1] > _WIDE * ends[0])
        x = Column(name, unit(p.unit[row]))
        panels.append(Panel(Column("Rise of chi-square", NONE), lines, top=top, x=x, log_x=wide))
    caption = "Profile likelihood: rise of chi-square, all other parameters fitted again; dashed: 3.84."
    return Plot("profiles", Column(""), panels, caption, height=1.9, columns=3)


def convergence(result: FitResult) -> mpl.Figure:
    """Best cost of every start and stage over the evaluations of the start."""
    figure = mpl.Figure((WIDTH_IN, 2.1))
    [axes] = Room(0.62, top=0.1).axes(figure)
    for start, stage, evaluations, cost in cost_lines(result.history):
        label = f"start {start + 1}" if stage == 0 else None
        color = PALETTE[start % len(PALETTE)]
        axes.step(evaluations, cost, where="post", color=color, ls=("-", "--", ":")[stage % 3], label=label)
    axes.set(
        xlabel=f"Evaluations of the start ({NONE})",
        ylabel=f"Best cost, {result.cost_kind} ({NONE})",
        yscale="log",
    )
    plain_decades(axes.yaxis)
    axes.legend(ncols=5, loc="upper right")
    return figure


def starts(result: FitResult) -> mpl.Figure:
    """Every free parameter between its bounds, before and after each start; crosses: starts that ended at a
    worse cost.
    """
    p, s = result.parameters, result.starts
    before, after = (between_bounds(p, values)[:, p.free] for values in (s.initial, s.final))
    best = float(np.nanmin(s.cost))
    same = s.cost - best <= _AGREES * max(best, 1e-12)
    names = free_names(p)
    small = min(7.0, 420 / max(len(names), 1))
    figure = mpl.Figure((WIDTH_IN, 2.9))
    [axes] = Room(0.5, bottom=_TILTED * wide(names, small) + 0.12, top=0.3).axes(figure)
    where = np.arange(int(p.free.sum()))
    axes.plot(
        np.tile(where, len(before)),
        before.ravel(),
        "o",
        mfc="none",
        mec=MUTED,
        ms=3.5,
        mew=0.7,
        label="before",
    )
    looks = ((same, "o", BLUE, "after, best cost"), (~same, "x", PALETTE[1], "after, worse"))
    for rows, marker, color, label in looks:
        if rows.any():
            axes.plot(
                np.tile(where, int(rows.sum())),
                after[rows].ravel(),
                marker,
                color=color,
                ms=4,
                ls="none",
                label=label,
            )
    axes.set_xticks(where, names, rotation=55, ha="right", rotation_mode="anchor", fontsize=small)
    axes.set(ylim=(-0.03, 1.03), xlim=(-0.5, len(names) - 0.5), ylabel=f"Place between the bounds ({NONE})")
    head(figure, axes, 3)
    return figure


def correlation(result: FitResult) -> mpl.Figure:
    """The correlation matrix of the free parameters."""
    names = free_names(result.parameters)
    size = float(np.clip(1.6 + 0.17 * len(names), 2.6, WIDTH_IN - 1.5))
    small = min(6.5, 260 / max(len(names), 1))
    long = wide(names, small)
    figure = mpl.Figure((size + 1.1, size))
    [axes], beside = Room(long + 0.1, bottom=_TILTED * long + 0.12, top=0.08).with_bar(figure)
    mesh = axes.pcolormesh(
        result.correlation,
        vmin=-1,
        vmax=1,
        cmap=mpl.shades(DIVERGING),
        edgecolors="white",
        linewidth=0.4,
    )
    axes.grid(False)
    ticks = np.arange(len(names)) + 0.5
    axes.set_xticks(ticks, names, rotation=55, ha="right", rotation_mode="anchor", fontsize=small)
    axes.set_yticks(ticks, names, fontsize=small)
    axes.set(ylim=(len(names), 0))
    bar = figure.colorbar(mesh, cax=beside)
    bar.set_label(f"Correlation ({NONE})")
    return figure


def cost_lines(history: Array) -> list[tuple[int, int, Array, Array]]:
    """The history as lines (start, stage, evaluations since the start began, best cost of the stage); failed
    evaluations left out.
    """
    lines = []
    for start in np.unique(history[:, 0]):
        done = 0.0
        for stage in np.unique(history[history[:, 0] == start, 1]):
            rows = history[(history[:, 0] == start) & (history[:, 1] == stage)]
            known = np.isfinite(rows[:, 3])
            lines.append((int(start), int(stage), rows[known, 2] + done, rows[known, 3]))
            done += float(rows[-1, 2])
    return lines
