"""Printed figures of an explained motion: measured and explained history, what is left before and after,
shares, gaps.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from identify.core.arrays import Array
from identify.reports.explain.tables import scale
from identify.reports.kit import plotting as mpl
from identify.reports.kit.banded import Line, Panel, Plot
from identify.reports.kit.cells import Column
from identify.reports.kit.figures import GRID, INK, PALETTE, WIDTH_IN
from identify.results.explain import Curves, TargetResult


@dataclass(frozen=True)
class History:
    """One joint of one record in the shown unit, (samples,): measured, known, explained; left before and
    after, NaN where not counted.
    """

    time_s: Array
    measured: Array
    known: Array
    explained: Array
    before: Array
    after: Array


def history(found: TargetResult, curves: Curves, row: int) -> History:
    """The curves of the joint in that row."""
    factor, _ = scale(found)
    measured, known, explained = (
        factor * getattr(curves, name)[:, row] for name in ("measured", "known", "explained")
    )
    used = curves.used[:, row]
    before, after = (np.where(used, measured - model, np.nan) for model in (known, explained))
    return History(curves.time_s, measured, known, explained, before, after)


def bars(found: TargetResult) -> tuple[tuple[str, ...], Array]:
    """Names of effects and how much each step took of the squares there were at first, % of all (steps,
    joints); found order.
    """
    squares = np.vstack([found.rms_judge_start, found.steps.rms_judge]) ** 2
    return found.steps.name, -100 * np.diff(squares, axis=0) / squares[0]


def histories(found: TargetResult, curves: Curves, caption: str) -> Plot:
    """Left the history of every joint, right what is left of it."""
    of, panels = scale(found)[1], []
    for row, joint in enumerate(found.joints):
        h = history(found, curves, row)
        lines = [
            Line("measured", h.time_s, h.measured, look="noisy"),
            Line("from what is known", h.time_s, h.known),
            Line("with the effects found", h.time_s, h.explained),
        ]
        left = [Line("left before", h.time_s, h.before), Line("left after", h.time_s, h.after)]
        panels += [Panel(Column(f"Joint {joint}", of), lines), Panel(Column("What is left", of), left)]
    return Plot("", Column("Time", "s"), panels, caption, height=1.35, columns=2)


def shares(found: TargetResult) -> mpl.Figure:
    """A bar per step and joint: how much of the squares there were at first each effect took when it was
    added.
    """
    names, values = bars(found)
    figure = mpl.Figure((WIDTH_IN, 0.9 + 0.17 * max(len(names), 3)), layout="constrained")
    left, right = figure.subplots(1, 2, width_ratios=(3, 1))
    rows = np.arange(len(names), dtype=float)
    height = 0.8 / len(found.joints)
    for column, joint in enumerate(found.joints):
        at = rows + (column - (len(found.joints) - 1) / 2) * height
        left.barh(at, values[:, column], height, color=PALETTE[column], label=f"joint {joint}")
    left.set(
        yticks=rows, yticklabels=names, ylim=(len(names) - 0.5, -0.5), xlabel="Of the squares at first (%)"
    )
    left.legend(loc="lower right")
    place = np.arange(len(found.joints), dtype=float)
    right.barh(place - 0.2, found.gap_start, 0.38, color=GRID, label="before")
    right.barh(place + 0.2, found.gap, 0.38, color=INK, label="after")
    right.set(
        xscale="log",
        yticks=place,
        yticklabels=[f"joint {joint}" for joint in found.joints],
        xlabel="Gap (1 is noise)",
    )
    right.set_ylim(len(found.joints) - 0.5, -0.5)
    right.legend(loc="best")
    return figure
