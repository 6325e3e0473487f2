"""Arms that are not quite as their users are told: independent Gaussian errors of everything, by level."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from tests.generator.arm import Arm, Link, Point
from tests.generator.rigid import Array, Inertia, turn
from tests.generator.spec import TestSpec


@dataclass(frozen=True)
class Dirt:
    """Standard deviations: ln mass, centre (m, each axis), ln of principal moments, place of points (m, each
    axis), turn of sensors (degrees, each axis), ln sensitivity of each channel, direction of impacts
    (degrees, drawn for each posture and direction).
    """

    mass: float = 0.02
    centre: float = 0.005
    inertia: float = 0.05
    place: float = 0.003
    turn: float = 1.0
    gain: float = 0.01
    impact: float = 1.0


CAREFUL = Dirt()
ORDINARY = Dirt(0.06, 0.015, 0.15, 0.009, 3.0, 0.03, 3.0)


def soil(spec: TestSpec, dirt: Dirt) -> TestSpec:
    """The test as it really is where its user is told of the spec's own arm."""
    rng = np.random.default_rng([spec.seed, 0xD1])
    links = tuple(_link(link, dirt, rng) for link in spec.arm.links)
    points = tuple(_point(point, dirt, rng) for point in spec.arm.points)
    sensors = {point.name: _sensor(dirt, rng) for point in spec.arm.points}
    arm: Arm = replace(spec.arm, links=links, points=points)
    return replace(
        spec,
        arm=arm,
        told=spec.arm,
        sensors=sensors,
        held_askew_deg=dirt.impact,
    )


def _link(link: Link, dirt: Dirt, rng: np.random.Generator) -> Link:
    mass = link.inertia.mass * np.exp(dirt.mass * rng.normal())
    centre = link.inertia.centre + dirt.centre * rng.normal(size=3)
    principal, axes = np.linalg.eigh(link.inertia.tensor)
    while True:  # a body: the largest moment is less than the sum of the others
        moments = principal * np.exp(dirt.inertia * rng.normal(size=3))
        if 2 * moments.max() < moments.sum():
            return replace(link, inertia=Inertia(mass, centre, (axes * moments) @ axes.T))


def _point(point: Point, dirt: Dirt, rng: np.random.Generator) -> Point:
    return replace(point, xyz=point.xyz + dirt.place * rng.normal(size=3))


def _sensor(dirt: Dirt, rng: np.random.Generator) -> Array:
    """(3, 3): from true to recorded x, y, z."""
    vector = np.radians(dirt.turn) * rng.normal(size=3)
    angle = float(np.linalg.norm(vector))
    axes = turn(vector, angle) if angle > 0 else np.eye(3)
    return np.diag(np.exp(dirt.gain * rng.normal(size=3))) @ axes.T
