"""A limit at each posture of a map: depth of cut, deflection by a force, or the frequency of the first mode.

Depths are searched for by semi-discretisation with coarse steps, and are then the exact ones beside what it
finds, with bands from their exact slopes; one crossing alone, so that a band does not know of another lobe.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from identify.core.arrays import Array
from identify.core.thresholds import SIGMAS_95
from identify.machining.mounted import Mounted
from identify.machining.one_limit import limit_at
from identify.machining.stability import UNKNOWN
from identify.machining.tool import Tool
from identify.machining.uncertain import uncertain_tip
from identify.model.system import System
from identify.results.map import LimitRows, PostureRows
from identify.robot.points import Point
from identify.robot.reach import about
from identify.vibration.fitted_model import FittedModel

KINDS = {"depth": "m", "deflection": "m", "frequency": "Hz"}


@dataclass(frozen=True)
class Wanted:
    """kind: of `KINDS`; tool: of a depth, with spindle speeds rpm, and how many feeds about the spindle;
    force (3,), N, of a deflection, along the base's axes.
    """

    kind: str
    tool: Tool | None = None
    rpm: tuple[float, ...] = ()
    feeds: int = 1
    force: tuple[float, ...] = ()

    @classmethod
    def of(cls, given: Mapping[str, Any]) -> Wanted:
        """From what a worker was given (`given`)."""
        tool = None if given["tool"] is None else Tool.model_validate(given["tool"])
        return cls(given["kind"], tool, tuple(given["rpm"]), given["feeds"], tuple(given["force"]))

    @property
    def given(self) -> dict[str, Any]:
        """For a worker, as plain numbers and texts."""
        tool = None if self.tool is None else self.tool.model_dump(mode="json", by_alias=True)
        kept = {"kind": self.kind, "rpm": list(self.rpm), "feeds": self.feeds, "force": list(self.force)}
        return {**kept, "tool": tool}

    @property
    def feed_deg(self) -> Array:
        """(f,), about the spindle from the tool's own feed."""
        return np.arange(self.feeds) * 360.0 / self.feeds

    @property
    def about(self) -> str:
        """What it is the limit of, in words."""
        if self.tool is not None:
            return f"{self.tool.name} at {', '.join(f'{one:,.0f}' for one in self.rpm)} rpm"
        return f"a force of ({', '.join(f'{one:g}' for one in self.force)}) N" if self.force else "mode 1"


def map_limits(
    wanted: Wanted,
    model: FittedModel,
    errors: Array,
    point: Point,
    postures: Array,
    systems: Sequence[System],
    rows: PostureRows,
) -> LimitRows:
    """The limits at postures (n, joints), rad; errors (p,): `identify.vibration.misfit`; rows: what the map
    has of these postures.
    """
    most = np.inf if wanted.tool is None else wanted.tool.max_depth_mm / 1e3
    if wanted.kind == "frequency":
        columns = [rows.frequency_hz, rows.frequency_low_95, rows.frequency_high_95]
        nothing = np.full(len(postures), np.nan)
        table = np.stack([*(one[:, 0] for one in columns), nothing, nothing], axis=1)[:, None]
    elif wanted.kind == "deflection":
        found = [
            _deflection(wanted, model, system, errors, point, posture)
            for system, posture in zip(systems, postures, strict=True)
        ]
        table = np.array(found)[:, None]
    else:
        several = [
            _depths(wanted, model, system, errors, point, posture)
            for system, posture in zip(systems, postures, strict=True)
        ]
        table = np.array(several)
    return LimitRows(wanted.kind, wanted.about, most, wanted.feed_deg, *np.moveaxis(table, -1, 0))


def _deflection(
    wanted: Wanted, model: FittedModel, system: System, errors: Array, point: Point, posture: Array
) -> list[float]:
    """Size of the static deflection, m, with its 95 % limits, and no chatter."""
    tip = uncertain_tip(model, system, point, np.eye(3), posture, errors)
    force = np.array(wanted.force)
    moved = tip.out @ np.linalg.solve(tip.matrices[2].real, tip.out.T @ force)
    size = float(np.linalg.norm(moved))
    columns, own = (
        np.einsum("i,ijc,j->c", moved / size, one[0], force).real for one in tip.changes(np.zeros(1))
    )
    half = SIGMAS_95 * float(np.hypot(np.linalg.norm(columns), np.linalg.norm(own) / np.sqrt(2))) / size
    return [size, size * np.exp(-half), size * np.exp(half), np.nan, np.nan]


def _depths(
    wanted: Wanted, model: FittedModel, system: System, errors: Array, point: Point, posture: Array
) -> list[list[float]]:
    """(f, 5): the least depth limit over the speeds, m, its 95 % limits, its chatter, Hz, and its speed."""
    tool = wanted.tool
    assert tool is not None
    engine = system.site.engine
    axes = tool.axes(engine.axes(point.link))
    tip_m = engine.position(point.link, point.position)
    found = []
    for angle in np.radians(wanted.feed_deg):
        turned = about(np.array([0.0, 0.0, 1.0]), -float(angle)) @ axes
        on = Mounted(
            model=model,
            system=system,
            tool=tool,
            where="tool",
            point=point,
            posture=posture,
            axes=turned,
            tip_m=tip_m,
            speeds=2,
            draws=0,
            errors=errors,
        )
        found.append(min((_depth(on, rpm) for rpm in wanted.rpm), key=lambda one: one[0]))
    return found


def _depth(on: Mounted, rpm: float) -> list[float]:
    depth, hz, exact = limit_at(on, rpm)
    if not np.isfinite(depth):
        return [np.inf, np.inf, np.inf, np.nan, rpm]
    if exact is None:
        return [depth, *(depth * part for part in UNKNOWN), hz, rpm]
    change, misfit = on.uncertain.relative(exact)
    half = SIGMAS_95 * float(np.linalg.norm([*change, misfit, on.coefficients]))
    return [depth, depth * np.exp(-half), depth * np.exp(half), hz, rpm]
