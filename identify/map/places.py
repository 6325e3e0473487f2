"""Places of a workpiece, and the postures that put the tool there."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

from identify.core.arrays import Array
from identify.core.errors import InputError
from identify.robot.points import Point
from identify.robot.reach import about, placed, reached, shortest
from identify.vibration.fitted_model import FittedModel

_EXPECTED = "X1:X2:COUNT,Y1:Y2:COUNT,Z1:Z2:COUNT in metres, such as 1.2:1.8:7,-0.4:0.4:5,0.8:0.8:1"


@dataclass(frozen=True)
class Workpiece:
    """Places (n, 3), m, in the base's axes; turns: how many angles about the spindle at each, evenly over a
    turn; spindle (3,): its direction towards the tip in the base's axes, None: that of the fit's first
    posture.
    """

    places: Array
    turns: int = 1
    spindle: Array | None = None


def parse_workpiece(text: str) -> Array:
    """(n, 3), m, from three ranges; InputError for another text."""
    try:
        axes = []
        for part in text.split(","):
            first, last, count = part.split(":")
            axes.append(np.linspace(float(first), float(last), int(count)))
        found = np.array(list(itertools.product(*axes)))
    except ValueError as error:
        raise InputError("--workpiece", repr(text), _EXPECTED) from error
    if found.ndim != 2 or found.shape[1] != 3 or not np.isfinite(found).all():
        raise InputError("--workpiece", repr(text), _EXPECTED)
    return found


def parse_spindle(text: str) -> Array:
    """(3,) from `X,Y,Z`; InputError for another text."""
    try:
        found = np.array([float(part) for part in text.split(",")])
    except ValueError:
        found = np.array([])
    if found.shape != (3,) or not np.isfinite(found).all() or not found.any():
        raise InputError(
            "--spindle", repr(text), "X,Y,Z, from the spindle to the tip in the base's axes, such as 0,0,-1"
        )
    return found


def postures_of(
    model: FittedModel, point: Point, axis: Array, piece: Workpiece
) -> tuple[list[str], Array, int]:
    """Names and postures (n, joints), rad, that the robot reaches, and how many it does not; axis (3,): from
    spindle to tip, in the axes of the link that carries the point.

    InputError where it reaches none.
    """
    robot, first = model.robot, model.posture
    attitude = placed(robot, first, point.link, point.position)[1]
    wanted = attitude @ axis if piece.spindle is None else piece.spindle
    attitude = shortest(attitude @ axis, wanted) @ attitude
    names, found, last = [], [], first
    turns = np.arange(piece.turns) * 2 * np.pi / piece.turns
    width = len(str(len(piece.places)))
    for number, place in enumerate(piece.places, 1):
        for turn in turns:
            axes = about(wanted, float(turn)) @ attitude
            posture = reached(robot, point.link, point.position, place, axes, [first, last])
            if posture is None:
                continue
            last = posture
            said = f" turned {np.degrees(turn):.0f}°" if piece.turns > 1 else ""
            names.append(f"place{number:0{width}d}{said}")
            found.append(posture)
    if not found:
        raise InputError(
            "--workpiece", "no place that the robot reaches so", "places within reach", "see `--spindle`"
        )
    return names, np.array(found), len(piece.places) * piece.turns - len(found)
