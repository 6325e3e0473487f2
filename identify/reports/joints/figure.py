"""Printed figures of identified joints: what was measured, and the identified curve over it."""

from __future__ import annotations

from typing import Any

from identify.core.text import capital
from identify.reports.kit import plotting as mpl
from identify.reports.kit.cells import unit
from identify.reports.kit.figures import INK, PALETTE, WIDTH_IN
from identify.results.joints import CurveResult, Panel

_SHOWN = {"rad": (1e3, "mrad"), "": (1.0, "")}
"""How small angles are shown: factor and unit."""


def scale(of: str) -> tuple[float, str]:
    """Factor and unit in which values are shown."""
    return _SHOWN.get(of, (1.0, unit(of)))


def label(text: str, of: str, between: str = " ") -> str:
    """Of an axis of values in a unit."""
    return f"{capital(text)}{between}({scale(of)[1]})"


def curve(found: CurveResult) -> mpl.Figure:
    """The panels of a curve, one under the other."""
    count = len(found.panels)
    figure = mpl.Figure((WIDTH_IN, 2.9 if count == 1 else 0.4 + 1.3 * count), layout="constrained")
    rows = figure.subplots(count, 1, squeeze=False)[:, 0]
    for axes, (name, panel) in zip(rows, found.panels.items(), strict=True):
        _draw(axes, panel)
        axes.set_title(name if count > 1 else found.title)
    rows[0].legend(loc="best")
    figure.align_ylabels()
    return figure


def _draw(axes: Any, panel: Panel) -> None:
    points = lines = 0
    for name, series in panel.series.items():
        x, y = scale(panel.x_unit)[0] * series.x, scale(panel.y_unit)[0] * series.y
        look: dict[str, Any] = {"color": INK, "label": name}
        if series.look == "line":
            look |= {"color": PALETTE[lines], "lw": 1.1, "ls": ("-", "--")[lines % 2], "zorder": 3}
            lines += 1
        elif series.look == "noisy":
            look |= {"lw": 0.5}
        else:
            many = (
                {"ms": 1.2, "mew": 0.0, "mfc": INK}
                if len(x) > 200
                else {"ms": 3.5, "mew": 0.8, "mfc": "none"}
            )
            look |= {"marker": ("o", "x")[points % 2], "ls": "none", **many}
            points += 1
        axes.plot(x, y, **look)
    axes.set(xlabel=label(panel.x_label, panel.x_unit), ylabel=label(panel.y_label, panel.y_unit, "\n"))
