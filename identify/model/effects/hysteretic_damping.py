"""Structural damping of joints: a force in phase with velocity that does not grow with frequency, as in
bolted and greased contacts.

The complex stiffness k (1 + j eta) of steady-state theory.  It is not causal, so it exists here only in the
frequency domain.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Literal, Self

import numpy as np
from pydantic import Field

from identify.core.parameters import Values, parameter, spread
from identify.model.effects.base import Effect, Term
from identify.model.effects.place import Beside, Place
from identify.model.effects.site import Site
from identify.model.effects.springs import START_HZ, AxisList, Joints, joint_coordinates, stiffness_unit
from identify.robot.description import Robot
from identify.robot.points import Point


class HystereticDamping(Effect):
    """j h beside the stiffness of joint coordinates that a compliance frees; h = eta k, eta the loss
    factor, twice the damping ratio.
    """

    kind: Literal["hysteretic-damping"] = "hysteretic-damping"
    joints: Joints = Field("all", description="`all`, or joint numbers (from 1) or names")
    axes: AxisList = Field(
        ["rz"], min_length=1, description="axes damped at each joint, which a compliance must free"
    )
    loss_stiffness: Values = Field(
        Values(), description="h, N/m or N m/rad; default start: a loss factor of 0.02 at 20 Hz"
    )

    def sentence(self) -> str:
        """For example: hysteretic damping of joints 2 (rz)."""
        which = (
            "all joints"
            if self.joints == "all"
            else f"joint{'s' if len(self.joints) > 1 else ''} {', '.join(map(str, self.joints))}"
        )
        return f"hysteretic damping of {which} ({', '.join(self.axes)})"

    @classmethod
    def instances(cls, robot: Robot, points: Mapping[int, Point]) -> Iterator[Self]:
        """The drive of every joint."""
        for number in range(1, len(robot.joints) + 1):
            yield cls(joints=[number])

    def places(self, robot: Robot, points: Mapping[int, Point]) -> list[Place]:
        """Beside the springs that it damps."""
        return [Beside(tuple(self._coordinates(robot)))]

    def _coordinates(self, robot: Robot) -> list[str]:
        return joint_coordinates(robot, self.joints, self.axes, "effects.hysteretic-damping.joints")

    def terms(self, robot: Robot, site: Site, where: str) -> list[Term]:
        """h per coordinate, on the diagonal of the imaginary part of K."""
        names, values, key = self._coordinates(robot), self.loss_stiffness, f"{where}.loss_stiffness"
        inertia = np.array([site.inertia(name) for name in names])
        starts = spread(values, 0.02 * inertia * (2 * np.pi * START_HZ) ** 2, key)
        return [
            Term(
                parameter(f"{name}.loss_stiffness", stiffness_unit(name), start, values, key),
                hysteretic=site.unit(name),
            )
            for name, start in zip(names, starts, strict=True)
        ]
