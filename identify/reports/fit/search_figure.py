"""Figures of the search in the PDF: parameters before and after every start, and how their estimates hang
together.
"""

from __future__ import annotations

import numpy as np

from identify.reports.fit import pick
from identify.reports.kit import plotting as mpl
from identify.reports.kit.cells import NONE
from identify.reports.kit.figures import BLUE, DIVERGING, MUTED, PALETTE, WIDTH_IN, Room, head, wide
from identify.results.fit import FitResult

_TILTED = 0.82
"""The sine of 55 degrees, by which names are turned."""
_AGREES = 1e-3
"""Starts whose costs differ by less than this part have found the same minimum."""


def starts(result: FitResult) -> mpl.Figure:
    """Every free parameter between its bounds, before and after each start; crosses: starts that ended at a
    worse cost.
    """
    p, s = result.parameters, result.starts
    before, after = (pick.between_bounds(p, values)[:, p.free] for values in (s.initial, s.final))
    best = float(np.nanmin(s.cost))
    same = s.cost - best <= _AGREES * max(best, 1e-12)
    names = [name for name, free in zip(p.name, p.free, strict=True) if free]
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
    names = [name for name, free in zip(result.parameters.name, result.parameters.free, strict=True) if free]
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
