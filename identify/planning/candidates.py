"""What could be measured: postures within reach, impacts, and places of triaxial sensors."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from identify.core.arrays import Array
from identify.core.errors import InputError
from identify.robot.description import Robot
from identify.vibration.fitted_model import FittedModel

_SPREAD = np.radians(60.0)
_TRIES = 50
AXES = "XYZ"


@dataclass(frozen=True)
class Candidates:
    """Postures (q, joints), rad; impacts as (node, axis) and sensors by node, all of points of the robot."""

    postures: Array
    impacts: tuple[tuple[int, int], ...]
    sensors: tuple[int, ...]

    def impact_name(self, number: int) -> str:
        """As a channel: `14:+X`."""
        node, axis = self.impacts[number]
        return f"{node}:+{AXES[axis]}"


def candidates(model: FittedModel, count: int, seed: int) -> Candidates:
    """Postures drawn around the first measured one, within the limits of the joints and with all points above
    the base's ground; impacts along every axis of every point that moves, sensors at all of these.

    InputError where there are too few.
    """
    rng, ground = np.random.default_rng(seed), min(0.0, _lowest(model, model.posture))
    postures = [model.posture]
    for _ in range(_TRIES * count):
        if len(postures) == count:
            break
        posture = model.posture + rng.uniform(-_SPREAD, _SPREAD, len(model.posture))
        if _within(model.robot, posture) and _lowest(model, posture) >= ground:
            postures.append(posture)
    if len(postures) < count:
        raise InputError(
            "identify plan",
            f"only {len(postures)} of {count} postures with all points above the base's ground",
            "a robot that reaches more",
            "give `--table postures.csv`",
        )
    return Candidates(np.array(postures), *_points(model))


def tabled(model: FittedModel, postures: Array) -> Candidates:
    """The same with postures of a table (q, joints), rad."""
    return Candidates(postures, *_points(model))


def _points(model: FittedModel) -> tuple[tuple[tuple[int, int], ...], tuple[int, ...]]:
    """Impacts and sensors; InputError where no point moves."""
    system = model.system(model.posture)
    moving = [
        node
        for node, point in model.points.items()
        if np.any(system.jacobian(point.link, point.position)[:3])
    ]
    if not moving:
        raise InputError("points", "none on a link that moves", "measurement points, for sensors and impacts")
    return tuple((node, axis) for node in moving for axis in range(3)), tuple(moving)


def _within(robot: Robot, posture: Array) -> bool:
    low = np.array([joint.lower for joint in robot.joints])
    high = np.array([joint.upper for joint in robot.joints])
    return bool(np.all((posture >= low) & (posture <= high)))


def _lowest(model: FittedModel, posture: Array) -> float:
    """Height of the lowest point above the base's ground, m; 0 where there are no points."""
    engine = model.system(posture).site.engine
    points = model.points.values()
    return min((float(engine.position(one.link, one.position)[2]) for one in points), default=0.0)
