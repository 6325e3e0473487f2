"""The HTML report of a batch, from the parts it shares with the page of a fit (`html`)."""

from __future__ import annotations

from typing import Any

import numpy as np

from identify.reports.batch import tables as batch_tables
from identify.reports.fit.html import render
from identify.reports.kit.cells import NONE
from identify.reports.kit.posture_pick import Postures, Quantity, batch_postures
from identify.results.batch import BatchResult

_SECTIONS = (
    ("verdict", "Verdict"),
    ("dependence", "Dependence"),
    ("postures", "Trends and maps"),
    ("fits", "Fits"),
    ("values", "Parameters"),
    ("asked", "Batch"),
    ("provenance", "Provenance"),
)


def page(result: BatchResult) -> str:
    """The whole page of a batch."""
    return render(
        "batch.html.j2",
        "postures.js",
        {"postures": posture_data(batch_postures(result), _first(result))},
        result,
        sections=_SECTIONS,
        tiles=batch_tables.tiles(result),
        batch_tables=batch_tables,
    )


def _first(result: BatchResult) -> str:
    """The quantity to show first: the parameter that depends on posture most, or the first one."""
    d = result.dependence
    scatter = np.where(d.depends, np.nan_to_num(d.scatter, nan=-1.0), -1.0)
    return d.parameter[int(np.argmax(scatter))] if len(d.parameter) else ""


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
