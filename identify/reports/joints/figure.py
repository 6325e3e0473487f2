"""Printed figures of identified joints: what was measured, and the identified curve over it."""

from __future__ import annotations

from typing import Any

from identify.core.text import capital
from identify.reports.kit import plotting as mpl
from identify.reports.kit.cells import unit
from identify.reports.kit.figures import INK, PALETTE, WIDTH_IN
from identify.results.joints import CurveResult, Panel

SHOWN = {"rad": (1e3, "mrad"), "": (1.0, "")}
"""How small angles are shown: factor and unit."""


def scale(of: str) -> tuple[float, str]:
    """Factor and unit in which values are shown."""
    return SHOWN.get(of, (1.0, unit(of)))


def curve(found: CurveResult) -> mpl.Figure:
    """The panels of a curve, one under the other."""
    panels = list(found.panels.items())
    figure = mpl.Figure(
        (WIDTH_IN, 2.9 if len(panels) == 1 else 0.4 + 1.3 * len(panels)), layout="constrained"
    )
    rows = figure.subplots(len(panels), 1, squeeze=False)[:, 0]
    for axes, (name, panel) in zip(rows, panels, strict=True):
        _draw(axes, panel)
        axes.set_title(name if len(panels) > 1 else found.title)
    rows[0].legend(loc="best")
    figure.align_ylabels()
    return figure


def _draw(axes: Any, panel: Panel) -> None:
    x_factor, x_unit = scale(panel.x_unit)
    y_factor, y_unit = scale(panel.y_unit)
    points = lines = 0
    for name, series in panel.series.items():
        x, y = x_factor * series.x, y_factor * series.y
        if series.look == "line":
            axes.plot(x, y, color=PALETTE[lines], lw=1.1, ls=("-", "--")[lines % 2], label=name, zorder=3)
            lines += 1
        elif series.look == "noisy":
            axes.plot(x, y, color=INK, lw=0.5, label=name)
        else:
            many = len(x) > 200
            look: Any = {"ms": 1.2 if many else 3.5, "mew": 0.0 if many else 0.8}
            axes.plot(
                x, y, ("o", "x")[points % 2], color=INK, mfc=INK if many else "none", label=name, **look
            )
            points += 1
    axes.set_xlabel(f"{capital(panel.x_label)} ({x_unit})")
    axes.set_ylabel(f"{capital(panel.y_label)}\n({y_unit})")
