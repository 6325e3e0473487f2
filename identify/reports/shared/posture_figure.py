"""Pictures of quantities over many postures for the PDF: trends over a joint angle, and maps over two angles
or over the tool's place.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from identify.core.arrays import Array
from identify.reports.kit import plotting as mpl
from identify.reports.kit.cells import NONE
from identify.reports.kit.figures import BLUE, MUTED, ORANGE, PALETTE, WIDTH_IN
from identify.reports.shared.posture_pick import Postures, Quantity

_COLUMNS = 3
_MANY = 200
"""Dots beyond which a picture of them is smaller and quicker than their outlines."""
_COLORS = "cividis"
"""A colour map that colour-blind readers see as others do."""


def trends(postures: Postures, quantities: Sequence[Quantity]) -> mpl.Figure:
    """Each quantity with its 95 % interval over the angle of the joint it changes with, or over the number of
    the posture.
    """
    rows = -(-len(quantities) // _COLUMNS)
    figure = mpl.Figure((WIDTH_IN, 1.75 * rows), layout="constrained")
    panels = figure.subplots(rows, _COLUMNS, squeeze=False).ravel()
    for axes, one in zip(panels, quantities, strict=False):
        x, label = _across(postures, one)
        _trend(axes, x, one, _joined(postures, one))
        axes.set_xlabel(label)
        axes.set_title(one.name)
        axes.set_ylabel(one.unit or NONE)
    for axes in panels[len(quantities) :]:
        axes.set_axis_off()
    return figure


def _across(postures: Postures, one: Quantity) -> tuple[Array, str]:
    joint = postures.joint_of(one)
    if joint < 0:
        return np.arange(1.0, len(postures.names) + 1), f"Posture ({NONE})"
    return postures.angles_deg[:, joint], f"Joint {joint + 1} (°)"


def _joined(postures: Postures, one: Quantity) -> bool:
    """Whether one angle alone varies, so that a line may join its dots."""
    angles = postures.angles_deg[:, postures.joint_of(one)]
    return len(postures.varied) == 1 and postures.joint_of(one) >= 0 and len(set(angles)) == len(angles)


def _trend(axes: mpl.Axes, x: Array, one: Quantity, joined: bool) -> None:
    faint = np.zeros(len(x), dtype=bool) if one.faint is None else one.faint
    if one.level is not None:
        axes.axhspan(one.level[1], one.level[2], color=ORANGE, alpha=0.35, lw=0)
        axes.axhline(one.level[0], color=ORANGE, lw=0.9)
    if one.low is not None and one.high is not None:
        axes.vlines(x[~faint], one.low[~faint], one.high[~faint], color=MUTED, lw=0.6)
    order = np.argsort(x[~faint], kind="stable")
    style = ".-" if joined else "."
    axes.plot(x[~faint][order], one.value[~faint][order], style, color=BLUE, ms=3.5, lw=0.8)
    counted = one.value[~faint & np.isfinite(one.value)]
    axes.plot(x[faint], one.value[faint], "x", color=MUTED, ms=3)
    if len(counted):
        low, high = counted.min(), counted.max()
        room = 0.25 * (high - low) or 0.05 * abs(high) or 1.0
        axes.set_ylim(low - room, high + room)


def modes(postures: Postures, kind: str) -> mpl.Figure:
    """All frequencies, or all damping ratios, over the joint that explains the first one best."""
    figure = mpl.Figure((WIDTH_IN, 2.6), layout="constrained")
    axes = figure.subplots()
    found = postures.of(kind)
    x, label = _across(postures, found[0])
    for number, one in enumerate(found):
        color = PALETTE[number % len(PALETTE)]
        if one.low is not None and one.high is not None:
            axes.vlines(x, one.low, one.high, color=color, lw=0.5, rasterized=len(x) > _MANY)
        order = np.argsort(x, kind="stable")
        axes.plot(
            x[order],
            one.value[order],
            ".-" if _joined(postures, found[0]) else ".",
            color=color,
            ms=3,
            lw=0.8,
            rasterized=len(x) > _MANY,
            label=one.name.removeprefix(f"{kind} of "),
        )
    axes.set(xlabel=label, ylabel="Frequency (Hz)" if kind == "frequency" else "Damping ratio (%)")
    axes.set_ylim(0, None)
    figure.legend(*axes.get_legend_handles_labels(), loc="outside right center", markerscale=2)
    return figure


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
