"""The mass of the sensors, which the robot description does not know: the same at every measurement point."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Literal, Self

import numpy as np
from pydantic import Field

from identify.core.errors import InputError
from identify.core.parameters import Values, single_parameter
from identify.model.effects.base import Effect, Term
from identify.model.effects.site import Site
from identify.robot.description import Robot
from identify.robot.points import Point


class SensorMass(Effect):
    """Equal point masses with their weight at all measurement points, there during every impact; roving
    sensors are another matter.
    """

    kind: Literal["sensor-mass"] = "sensor-mass"
    mass: Values = Field(
        Values(initial=0.05, bounds=(0.0, 5.0)), description="of one sensor with its mount, kg"
    )

    def sentence(self) -> str:
        """Mass of the sensors."""
        return "mass of the sensors"

    @classmethod
    def instances(cls, robot: Robot, points: Mapping[int, Point]) -> Iterator[Self]:
        """All points at once, if there are any."""
        if points:
            yield cls()

    def terms(self, robot: Robot, site: Site, where: str) -> list[Term]:
        """The mass of one sensor: the sum over points of inertia J' J and gravity stiffness."""
        if not site.points:
            fix = "give `points`, or remove the effect"
            raise InputError(where, "there are no measurement points", "points where the sensors sit", fix)
        jacobians = [site.jacobian(point.link, point.position, where)[:3] for point in site.points.values()]
        weights = [site.weight_stiffness(point.link, point.position, where) for point in site.points.values()]
        mass = single_parameter("sensors.mass", "kg", self.mass, f"{where}.mass", default=1.0)
        inertia = np.sum([j.T @ j for j in jacobians], axis=0)
        return [Term(mass, mass=inertia, stiffness=np.sum(weights, axis=0))]
