"""Quantities over many postures, as parts of a report: trends, modes and maps."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial
from typing import Any

import numpy as np

from identify.reports.kit import posture_figure
from identify.reports.kit.cells import NONE, Column, Table, several, words
from identify.reports.kit.posture_pick import Postures, Quantity
from identify.reports.kit.report import PAGE, Box, Drawing, Heading, Part, Pickers

_CHOICES = (
    ("Quantity", "posture-quantity"),
    ("Over", "posture-over"),
    ("Map across", "posture-across"),
    ("Map up", "posture-up"),
)


def pictures(note: str) -> list[Part]:
    """What `postures.js` fills on the page: a quantity over an angle, and as colour over two."""
    return [
        Pickers(tuple((label, anchor, ()) for label, anchor in _CHOICES)),
        Box("columns two", [Drawing("trend-plot"), Drawing("posture-plot")]),
        Heading("All frequencies", on=PAGE),
        Drawing("frequency-plot", note=note),
    ]


def trends(postures: Postures, shown: Sequence[Quantity], caption: str) -> Drawing:
    """Quantities over the joint they change with, in the PDF."""
    return _drawing(partial(posture_figure.trends, postures, shown), caption, postures, shown)


def modes(postures: Postures, said: str) -> Iterator[Drawing]:
    """Frequencies and damping ratios over the postures, in the PDF."""
    for kind, what in (("frequency", "Frequencies"), ("damping", "Damping ratios")):
        shown = postures.of(kind)
        if shown:
            figure = partial(posture_figure.modes, postures, kind)
            yield _drawing(figure, f"{what} {said}.", postures, shown)


def maps(postures: Postures, shown: Sequence[Quantity]) -> Iterator[Drawing]:
    """Maps of some quantities, three a figure, in the PDF."""
    caption = "Over two joints, and over the place of the tool from the side and from above."
    for first in range(0, len(shown), 3):
        some = shown[first : first + 3]
        yield _drawing(partial(posture_figure.maps, postures, some), caption, postures, some)


def _drawing(figure: Any, caption: str, postures: Postures, shown: Sequence[Quantity]) -> Drawing:
    return Drawing("", figure, caption, lambda: [_values(postures, shown)])


def _values(postures: Postures, shown: Sequence[Quantity]) -> Table:
    """Quantities by posture, for export."""
    joints = [f"Joint {joint + 1}" for joint in range(postures.angles_deg.shape[1])]
    angles = several(joints, "°", postures.angles_deg)
    values = [Column(one.name, one.unit, one.value) for one in shown]
    return Table("by posture", [words("Posture", postures.names), *angles, *values])


def posture_data(postures: Postures, first: str) -> dict[str, Any]:
    """What `postures.js` draws from: quantities, and what they can be shown over."""
    varied = sorted(postures.varied)
    over = [
        {"label": f"Joint {joint + 1} (°)", "values": postures.angles_deg[:, joint], "joint": joint + 1}
        for joint in varied
    ]
    over += [
        {"label": f"Tool {axis} (m)", "values": postures.tool_m[:, k], "joint": 0}
        for k, axis in enumerate("xyz")
    ]
    reach = np.hypot(postures.tool_m[:, 0], postures.tool_m[:, 1])
    over += [{"label": "Reach of the tool (m)", "values": reach, "joint": 0}]
    over += [{"label": f"Posture ({NONE})", "values": np.arange(1, len(postures.names) + 1), "joint": 0}]
    names = [one.name for one in postures.quantities]
    return {
        "names": list(postures.names),
        "over": over,
        "quantities": [_quantity(one, postures.joint_of(one) + 1) for one in postures.quantities],
        "first": names.index(first) if first in names else 0,
        "most": [varied.index(joint) for joint in postures.telling[:2]],
    }


def _quantity(one: Quantity, joint: int) -> dict[str, Any]:
    return {
        "kind": one.kind,
        "name": one.name,
        "label": one.label,
        "value": one.value,
        "low": one.low,
        "high": one.high,
        "level": one.level,
        "level_name": one.level_name,
        "joint": joint,
        "faint": None if one.faint is None else one.faint.astype(int),
    }
