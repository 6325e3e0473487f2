"""Quantities over many postures, as parts of a report: trends, modes and maps."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial
from typing import Any

import numpy as np

from identify.reports.kit.cells import NONE, Column, Table, several, words
from identify.reports.kit.report import PAGE, Box, Drawing, Heading, Part, Pickers
from identify.reports.shared import posture_figure
from identify.reports.shared.posture_pick import Postures, Quantity

_CHOICES = (
    ("Quantity", "posture-quantity"),
    ("Over", "posture-over"),
    ("Map across", "posture-across"),
    ("Map up", "posture-up"),
)


def pictures(note: str, page: dict[str, Any]) -> list[Part]:
    """What `postures.js` fills on the page: a quantity over an angle, and as colour over two; page: of
    `posture_data`, and what else is drawn there.
    """
    plots = [Drawing("trend-plot", page=page, scripts=("postures.js",)), Drawing("posture-plot")]
    return [
        Pickers(tuple((label, anchor, ()) for label, anchor in _CHOICES)),
        Box("columns two", plots),
        Heading("All frequencies", on=PAGE),
        Drawing("frequency-plot", note=note),
    ]


def trends(postures: Postures, shown: Sequence[Quantity], caption: str) -> Drawing | None:
    """Quantities over the joint they change with, in the PDF."""
    if not shown:
        return None
    return posture_figure.trends(postures, shown, caption).printed(partial(_values, postures, shown))


def modes(postures: Postures, said: str) -> Iterator[Drawing]:
    """Frequencies and damping ratios over the postures, in the PDF."""
    for kind, what in (("frequency", "Frequencies"), ("damping", "Damping ratios")):
        shown = postures.of(kind)
        if shown:
            plot = posture_figure.modes(postures, kind, f"{what} {said}.")
            yield plot.printed(partial(_values, postures, shown))


def maps(postures: Postures, shown: Sequence[Quantity]) -> Iterator[Drawing]:
    """Maps of some quantities, three a figure, in the PDF."""
    caption = "Over two joints, and over the place of the tool from the side and from above."
    for first in range(0, len(shown), 3):
        some = shown[first : first + 3]
        figure = partial(posture_figure.maps, postures, some)
        yield Drawing("", figure, caption, partial(_values, postures, some))


def _values(postures: Postures, shown: Sequence[Quantity]) -> list[Table]:
    """Quantities by posture, for export."""
    joints = [f"Joint {joint + 1}" for joint in range(postures.angles_deg.shape[1])]
    angles = several(joints, "°", postures.angles_deg)
    values = [Column(one.name, one.unit, one.value) for one in shown]
    return [Table("by posture", [words("Posture", postures.names), *angles, *values])]


def posture_data(postures: Postures, first: str, most: Sequence[int] | None = None) -> dict[str, Any]:
    """What `postures.js` draws from, as `postures`: quantities, and what they can be shown over."""
    varied = sorted(postures.varied)
    reach = np.hypot(postures.tool_m[:, 0], postures.tool_m[:, 1])
    sides = [
        *((f"Joint {joint + 1} (°)", postures.angles_deg[:, joint], joint + 1) for joint in varied),
        *((f"Tool {axis} (m)", postures.tool_m[:, k], 0) for k, axis in enumerate("xyz")),
        ("Reach of the tool (m)", reach, 0),
        (f"Posture ({NONE})", np.arange(1, len(postures.names) + 1), 0),
    ]
    names = [one.name for one in postures.quantities]
    found = {
        "names": list(postures.names),
        "over": [{"label": label, "values": values, "joint": joint} for label, values, joint in sides],
        "quantities": [_quantity(one, postures.joint_of(one) + 1) for one in postures.quantities],
        "first": names.index(first) if first in names else 0,
        "most": [varied.index(joint) for joint in postures.telling[:2]] if most is None else most,
    }
    return {"postures": found}


def _quantity(one: Quantity, joint: int) -> dict[str, Any]:
    drawn = {name: value for name, value in vars(one).items() if name != "unit"}
    faint = None if one.faint is None else one.faint.astype(int)
    return drawn | {"label": one.label, "joint": joint, "faint": faint}
