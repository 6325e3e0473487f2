"""Pictures of quantities over many postures for the PDF: trends over a joint angle, and maps over two angles
or over the tool's place.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from identify.core.arrays import Array, Mask
from identify.reports.kit import plotting as mpl
from identify.reports.kit.banded import Line, Panel, Plot
from identify.reports.kit.cells import NONE, Column
from identify.reports.kit.figures import WIDTH_IN
from identify.reports.shared.posture_pick import Postures, Quantity

_MANY = 200
"""Dots beyond which a picture of them is smaller and quicker than their outlines."""
_COLORS = "cividis"
"""A colour map that colour-blind readers see as others do."""


def trends(postures: Postures, quantities: Sequence[Quantity], caption: str) -> Plot:
    """Each quantity with its 95 % interval over the angle of the joint it changes with, or over the number of
    the posture.
    """
    panels = [_trend(*_across(postures, one), one, _joined(postures, one)) for one in quantities]
    return Plot("", Column(""), panels, caption, height=1.75, columns=3)


def _across(postures: Postures, one: Quantity) -> tuple[Array, Column]:
    joint = postures.joint_of(one)
    if joint < 0:
        return np.arange(1.0, len(postures.names) + 1), Column("Posture", NONE)
    return postures.angles_deg[:, joint], Column(f"Joint {joint + 1}", "°")


def _joined(postures: Postures, one: Quantity) -> bool:
    """Whether one angle alone varies, so that a line may join its dots."""
    angles = postures.angles_deg[:, postures.joint_of(one)]
    return len(postures.varied) == 1 and postures.joint_of(one) >= 0 and len(set(angles)) == len(angles)


def _over(name: str, x: Array, one: Quantity, joined: bool, counts: Mask | None = None) -> Line:
    """Values with their limits at the postures that count, in order of x."""
    rows = np.argsort(x, kind="stable")
    rows = rows if counts is None else rows[counts[rows]]
    low, high = (None if limit is None else limit[rows] for limit in (one.low, one.high))
    return Line(name, x[rows], one.value[rows], low, high, points=not joined)


def _trend(x: Array, across: Column, one: Quantity, joined: bool) -> Panel:
    counts = np.ones(len(x), dtype=bool) if one.faint is None else ~one.faint
    lines = [_over("each posture", x, one, joined, counts)]
    if one.level is not None:
        ends = np.array([np.nanmin(x), np.nanmax(x)])
        level, low_95, high_95 = (np.full(2, value) for value in one.level)
        lines.append(Line(one.level_name, ends, level, low_95, high_95))
    if not counts.all():
        lines.append(Line("not counted", x[~counts], one.value[~counts], points=True))
    counted = one.value[counts & np.isfinite(one.value)]
    low, high = (counted.min(), counted.max()) if len(counted) else (0.0, 1.0)
    room = 0.25 * (high - low) or 0.05 * abs(high) or 1.0
    y = Column(one.name, one.unit or NONE)
    return Panel(y, lines, top=(float(low - room), float(high + room)), x=across)


def modes(postures: Postures, kind: str, caption: str) -> Plot:
    """All frequencies, or all damping ratios, over the joint that explains the first one best."""
    found = postures.of(kind)
    (x, across), joined = _across(postures, found[0]), _joined(postures, found[0])
    lines = [_over(one.name.removeprefix(f"{kind} of "), x, one, joined) for one in found]
    y = Column("Frequency", "Hz") if kind == "frequency" else Column("Damping ratio", "%")
    most = max(float(np.nanmax(one.value if one.high is None else one.high)) for one in found)
    return Plot("", across, [Panel(y, lines, top=1.05 * most)], caption)


def maps(postures: Postures, quantities: Sequence[Quantity]) -> mpl.Figure:
    """Each quantity as colour: over the two joints that tell most, and over the place of the tool from the
    side and from above.
    """
    figure = mpl.Figure((WIDTH_IN, 2.0 * len(quantities)), layout="constrained")
    panels = figure.subplots(len(quantities), 3, squeeze=False)
    reach = np.hypot(postures.tool_m[:, 0], postures.tool_m[:, 1])
    x, y, z = postures.tool_m.T
    for row, one in zip(panels, quantities, strict=True):
        for axes, (across, up, names) in zip(
            row,
            (
                (*_two_angles(postures),),
                (reach, z, ("Reach (m)", "Height (m)")),
                (x, y, ("Tool x (m)", "Tool y (m)")),
            ),
            strict=True,
        ):
            shown = axes.scatter(
                across, up, c=one.value, cmap=_COLORS, s=9, lw=0, rasterized=len(one.value) > _MANY
            )
            axes.set(xlabel=names[0], ylabel=names[1])
        for axes in row[1:]:
            axes.set_aspect("equal", adjustable="datalim")
        row[0].set_title(one.name)
        bar = figure.colorbar(shown, ax=row[-1], pad=0.02, aspect=18)
        bar.set_label(one.unit or NONE)
        bar.outline.set_visible(False)
    return figure


def _two_angles(postures: Postures) -> tuple[Array, Array, tuple[str, str]]:
    number = np.arange(1.0, len(postures.names) + 1)
    sides = [
        (postures.angles_deg[:, joint], f"Joint {joint + 1} (°)") for joint in sorted(postures.telling[:2])
    ]
    sides += [(number, f"Posture ({NONE})")] * (2 - len(sides))
    return sides[0][0], sides[1][0], (sides[0][1], sides[1][1])
