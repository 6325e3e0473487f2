"""Figures of a comparison in the PDF: parameters of all runs relative to the first one, and residuals over
frequency.
"""

from __future__ import annotations

import numpy as np

from identify.core.arrays import Array
from identify.reports.compare.pick import Shared
from identify.reports.kit import plotting as mpl
from identify.reports.kit.banded import Line, Panel, Plot
from identify.reports.kit.cells import NONE, Column
from identify.reports.kit.figures import MUTED, PALETTE, WIDTH_IN, Room, head, wide
from identify.reports.shared import pick
from identify.results.comparison import Comparison
from identify.results.fit import FrfComparison

_MARKERS = "oDs^vX"
_WIDE = 5.0
"""Ratio of residuals from which a logarithmic axis shows them better."""
_IN_ROW = 4
"""Runs in a row of a legend."""


def ratios(comparison: Comparison) -> tuple[list[str], dict[str, Array]]:
    """Names (p) of all parameters of the first run that are positive, and per run (p, 3): value and limits of
    the 95 % interval over the first run's value; NaN where a run has no such parameter, or no interval.
    """
    first = next(iter(comparison.runs.values())).parameters
    names = [name for name, value in zip(first.name, first.value, strict=True) if value > 0]
    base = np.array([first.value[first.name.index(name)] for name in names])
    found = {}
    for label, run in comparison.runs.items():
        p, values = run.parameters, np.full((len(names), 3), np.nan)
        for row, name in enumerate(names):
            if name in p.name:
                i = p.name.index(name)
                values[row] = p.value[i], p.low_95[i], p.high_95[i]
        values[values <= 0] = np.nan
        found[label] = values / base[:, None]
    return names, found


def parameters(comparison: Comparison) -> mpl.Figure:
    """Values with their intervals over those of the first run."""
    names, found = ratios(comparison)
    figure = mpl.Figure((WIDTH_IN, 0.8 + (0.13 + 0.06 * len(found)) * len(names)))
    [axes] = Room(0.15 + wide(names), top=0.12 + 0.18 * -(-len(found) // _IN_ROW)).axes(figure)
    rows = np.arange(len(names))
    for number, (label, values) in enumerate(found.items()):
        at, color = rows + 0.6 * ((number + 0.5) / len(found) - 0.5), PALETTE[number % len(PALETTE)]
        axes.hlines(at, values[:, 1], values[:, 2], color=color, lw=0.9)
        axes.plot(values[:, 0], at, _MARKERS[number % len(_MARKERS)], color=color, ms=3.6, label=label)
    axes.axvline(1.0, color=MUTED, lw=0.6, ls=":")
    low, high = shown_range(found)
    axes.set(
        xscale="log" if high > 3 * low else "linear",
        xlim=(low, high),
        yticks=rows,
        ylim=(len(names) - 0.5, -0.5),
    )
    axes.set_xlabel(f"Value over that of {next(iter(found))} ({NONE})")
    axes.set_yticklabels(names)
    head(figure, axes, _IN_ROW)
    return figure


def shown_range(found: dict[str, Array]) -> tuple[float, float]:
    """What the axis of ratios spans: all values, and intervals up to a factor of thirty."""
    every = np.concatenate(list(found.values()))
    low, high = np.nanmin(every[:, 0]), np.nanmax(every[:, 0])
    low, high = min(low, max(np.nanmin(every), low / 30)), max(high, min(np.nanmax(every), high * 30))
    return float(low / 1.15), float(high * 1.15)


def band_gaps(frf: FrfComparison) -> tuple[Array, Array]:
    """Edges of bands, Hz (b + 1,), and the RMS over all FRFs of the residual in each (b,), as in the gap
    map.
    """
    found = pick.gap_map(frf)
    return found.edges_hz, np.sqrt(np.nanmean(found.values**2, axis=1))


def residuals(anchor: str, one: Shared) -> Plot:
    """The residual of every run over frequency, all common FRFs together; steps from band to band."""
    bands = {label: band_gaps(frf) for label, frf in one.frfs.items()}
    lines = [Line(label, x, np.append(y, y[-1:]), look="steps") for label, (x, y) in bands.items()]
    every = np.concatenate([line.y for line in lines])
    low, high = float(np.nanmin(every)), float(np.nanmax(every))
    wide = high > _WIDE * low > 0
    y = Column("Residual / noise (1 = noise)" if one.in_noise else "Residual / measured")
    panel = Panel(y, lines, log=wide, top=None if wide else 1.05 * high)
    caption = f"Residual over frequency, {one.name}, all common FRFs together."
    return Plot(anchor, Column("Frequency", "Hz"), [panel], caption, height=1.7)
