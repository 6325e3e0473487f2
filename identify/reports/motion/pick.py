"""What is drawn of a motion: panels of curves over time, the same on screen and on paper; angles in
degrees.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from identify.core.arrays import Array
from identify.reports.kit.cells import unit as unit_text
from identify.results.motion import RecordResult

DEGREES = {"rad": "°", "rad/s": "°/s"}
POINTS = 1300
"""Points of a curve that are drawn: more than there are pixels."""
COMMAND, RECORDED, START, SIMULATED = "command", "recorded", "start model", "simulated"


@dataclass(frozen=True)
class Curve:
    """A curve per joint: name, time (n,) s, values (n, joints)."""

    name: str
    time: Array
    values: Array


@dataclass(frozen=True)
class Panel:
    """Curves that share an axis."""

    label: str
    unit: str
    curves: tuple[Curve, ...]


def factor(unit: str) -> float:
    """From SI to what is shown."""
    return float(np.degrees(1.0)) if unit in DEGREES else 1.0


def shown_unit(unit: str) -> str:
    """The unit that is shown."""
    return unit_text(DEGREES.get(unit, unit))


def panels(record: RecordResult) -> list[Panel]:
    """Position, how far it is off, windup of elastic joints, velocity, and current or torque."""
    position, link = record.signals["motor_position"], record.signals["link_position"]
    found = [_panel(record, "position"), _error(record)]
    if np.any(link.values != position.values):
        windup = Curve(SIMULATED, record.time_s, np.degrees(link.values - position.values))
        ahead = Curve(
            SIMULATED, record.time_s, np.degrees(link.values - record.signals["command_position"].values)
        )
        found += [
            Panel("Link less commanded", "°", (_thin(ahead),)),
            Panel("Link ahead of drive", "°", (_thin(windup),)),
        ]
    effort = "current" if "motor_current" in record.signals else "torque"
    return [*found, _panel(record, "velocity"), _panel(record, effort)]


def _panel(record: RecordResult, what: str) -> Panel:
    quantity = f"motor_{what}"
    compared = record.comparisons.get(quantity)
    trace = record.signals[quantity]
    scale, curves = factor(trace.unit), []
    if f"command_{what}" in record.signals:
        curves.append(Curve(COMMAND, record.time_s, scale * record.signals[f"command_{what}"].values))
    if compared is not None:
        curves.append(Curve(RECORDED, compared.time_s, scale * compared.measured))
        if compared.initial is not None:
            curves.append(Curve(START, compared.time_s, scale * compared.initial))
    curves.append(Curve(SIMULATED, record.time_s, scale * trace.values))
    return Panel(what.capitalize(), shown_unit(trace.unit), tuple(_thin(curve) for curve in curves))


def _error(record: RecordResult) -> Panel:
    """Simulated less recorded position where there is a record, else less commanded."""
    compared = record.comparisons.get("motor_position")
    if compared is None:
        values = record.signals["motor_position"].values - record.signals["command_position"].values
        return Panel(
            "Simulated less commanded", "°", (_thin(Curve(SIMULATED, record.time_s, np.degrees(values))),)
        )
    curves = [(START, compared.initial), (SIMULATED, compared.simulated)]
    drawn = [
        _thin(Curve(name, compared.time_s, np.degrees(v - compared.measured)))
        for name, v in curves
        if v is not None
    ]
    return Panel("Model less recorded", "°", tuple(drawn))


def _thin(curve: Curve) -> Curve:
    every = int(np.ceil(len(curve.time) / POINTS))
    return Curve(curve.name, curve.time[::every], curve.values[::every])


def moving(record: RecordResult) -> int:
    """The joint (from 0) that is commanded to turn farthest."""
    return int(np.argmax(np.ptp(record.signals["command_position"].values, axis=0)))
