"""Printed figures of a motion: one record and one joint each, panels under each other over the same time."""

from __future__ import annotations

from typing import Any

from identify.reports.kit import plotting as mpl
from identify.reports.kit.figures import BLUE, INK, MUTED, ORANGE, WIDTH_IN
from identify.reports.motion.pick import COMMAND, RECORDED, SIMULATED, START, panels
from identify.results.motion import RecordResult

_LOOKS: dict[str, Any] = {
    COMMAND: {"color": MUTED, "lw": 0.8, "ls": ":"},
    RECORDED: {"color": INK, "lw": 1.1},
    START: {"color": ORANGE, "lw": 0.8, "ls": "--"},
    SIMULATED: {"color": BLUE, "lw": 0.9},
}


def histories(record: RecordResult, joint: int) -> mpl.Figure:
    """Position, how far it is off, velocity, and current or torque of one joint."""
    shown = panels(record)
    figure = mpl.Figure((WIDTH_IN, 0.6 + 0.86 * len(shown)), layout="constrained")
    rows = figure.subplots(len(shown), 1, sharex=True)
    for axes, panel in zip(rows, shown, strict=True):
        for curve in panel.curves:
            axes.plot(curve.time, curve.values[:, joint], label=curve.name, **_LOOKS[curve.name])
        axes.set_ylabel(f"{panel.label}\n({panel.unit})")
    rows[-1].set_xlabel("Time (s)")
    figure.align_ylabels()
    figure.legend(*rows[0].get_legend_handles_labels(), loc="outside upper left", ncols=4)
    return figure
