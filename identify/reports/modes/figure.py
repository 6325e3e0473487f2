"""The stabilisation diagram of the PDF."""

from __future__ import annotations

from typing import Any

import numpy as np

from identify.reports.kit import plotting as mpl
from identify.reports.kit.cells import NONE, unit
from identify.reports.kit.figures import BLUE, GRID, MUTED, PALETTE, WIDTH_IN, Room
from identify.results.modes import AnalysedMeasurement

_MARKS: dict[str, dict[str, Any]] = {
    "kept by hand": {"marker": "D", "mfc": "none", "mec": PALETTE[0], "mew": 0.8, "ms": 4.2},
    "dropped by hand": {"marker": "x", "mec": PALETTE[1], "mew": 0.9, "ms": 4.0},
    "below the threshold": {"marker": "s", "mfc": "none", "mec": PALETTE[4], "mew": 0.8, "ms": 3.6},
}
"""How poles look that a choice touched (`identify.results.modes.MARKS`)."""


def stabilisation(m: AnalysedMeasurement) -> mpl.Figure:
    """Poles of every order over the mode indicator, with the chosen modes and what choices did."""
    figure = mpl.Figure((WIDTH_IN, 3.2))
    [below] = Room(left=0.6, right=0.48, top=0.36).axes(figure)
    axes = below.twinx()
    d = m.diagram
    for k, curve in enumerate(d.indicator.T):
        below.plot(d.line_hz, np.where(curve > 0, curve, np.nan), color=GRID if k else MUTED, lw=0.8)
    below.set(
        yscale="log",
        xlabel="Frequency (Hz)",
        ylabel=f"CMIF ({unit(m.frf.unit)})",
        xlim=(d.line_hz[0], d.line_hz[-1]),
    )
    below.grid(False)
    kinds = (
        ("unstable", ~d.stable, {"mfc": "none", "mec": PALETTE[7], "mew": 0.5, "ms": 2.6}),
        ("stable", d.stable, {"ms": 3.2}),
    )
    for label, rows, look in kinds:
        axes.plot(
            d.frequency_hz[rows],
            d.order[rows],
            "o" if label == "unstable" else ".",
            color=PALETTE[2],
            label=label,
            **look,
        )
    for name, rows in d.marked():
        axes.plot(d.frequency_hz[rows], d.order[rows], ls="none", label=name, **_MARKS[name])
    for k, hz in enumerate(m.modes.frequency_hz):
        axes.axvline(hz, color=BLUE, lw=0.7, ls=":", label=None if k else "chosen mode")
    axes.set(ylabel=f"Model order ({NONE})", ylim=(0, 1.06 * m.highest_order))
    axes.grid(False)
    figure.legend(*axes.get_legend_handles_labels(), loc="upper left", ncols=6)
    return figure
