"""A drive whose stiffness relaxes: stiff against fast motion, softer against slow, as grease, belts, harmonic
drives and polymer couplings are.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Literal, Self

import numpy as np
from pydantic import Field

from identify.core.arrays import Array
from identify.core.parameters import Parameter, Values
from identify.model.effects.base import Effect, Term
from identify.model.effects.site import Added, Site
from identify.model.effects.springs import START_HZ
from identify.robot.description import Robot
from identify.robot.points import Point
from identify.robot.posture import Mechanism

_SLOWEST_HZ, _FASTEST_HZ = 0.3, 300.0
_MASSLESS = 1e-4
"""Share of the inertia behind a joint that its relaxing coordinate has of its own, so that the mass matrix
can be inverted: it resonates far above what a robot's tests see.
"""


class JointRelaxation(Effect):
    """A Kelvin-Voigt element in series with the drive's spring (standard linear solid: Findley, Lai and
    Onaran, Creep and Relaxation of Nonlinear Viscoelastic Materials, 1976, section 5.5).

    With compliance c and retardation time tau the drive has the compliance 1 / (k + d s) + c / (1 + tau s);
    it has its own stiffness k against motion much faster than 1 / tau and 1 / (1 / k + c) against slow
    motion.
    """

    kind: Literal["joint-relaxation"] = "joint-relaxation"
    joints: list[int | str] = Field(min_length=1, description="joint numbers (from 1) or names")
    compliance: Values = Field(
        Values(), description="of the relaxing element, rad/(N m); zero is a drive that does not relax"
    )
    retardation_time: Values = Field(
        Values(), description="s; default start: that of the middle of where robots resonate, 20 Hz"
    )

    def sentence(self) -> str:
        """For example: relaxation of the drive of joint 2."""
        many = "drive of joint" if len(self.joints) == 1 else "drives of joints"
        return f"relaxation of the {many} {', '.join(map(str, self.joints))}"

    @classmethod
    def instances(cls, robot: Robot, points: Mapping[int, Point]) -> Iterator[Self]:
        """Every joint."""
        return (cls(joints=[number]) for number in range(1, len(robot.joints) + 1))

    def _numbers(self, robot: Robot) -> list[int]:
        return robot.joint_numbers(self.joints, f"effects.{self.kind}.joints")

    def added_coordinates(self, robot: Robot, mechanism: Mechanism) -> list[Added]:
        """What the relaxing element turns by: the link turns with it, as with the drive's own coordinate."""
        return [
            Added(f"joint{n}.relaxation", robot.links[n].name, {f"joint{n}.rz": 1.0})
            for n in self._numbers(robot)
        ]

    def free_coordinates(self, robot: Robot) -> list[str]:
        """joint2.relaxation and so on."""
        return [f"joint{n}.relaxation" for n in self._numbers(robot)]

    def consistent_mass(self, robot: Robot, site: Site) -> Array | None:
        """Next to nothing on each of its coordinates."""
        names = self.free_coordinates(robot)
        return np.asarray(np.sum([_MASSLESS * site.inertia(n) * site.unit(n) for n in names], axis=0))

    def terms(self, robot: Robot, site: Site, where: str) -> list[Term]:
        """A compliance and a retardation time per joint."""
        found, slow = list[Term](), 2 * np.pi * np.array([_FASTEST_HZ, START_HZ, _SLOWEST_HZ])
        for name in self.free_coordinates(robot):
            usual = 1 / (site.inertia(name) * slow[1] ** 2)
            low, high = self.compliance.bounds or (0.0, 1e3 * usual)
            start = _first(self.compliance, 0.01 * usual)
            c = Parameter(
                f"{name}.compliance", "rad/(N m)", start, low, high, False, not self.compliance.fixed
            )
            fast, late = self.retardation_time.bounds or (1 / slow[0], 1 / slow[2])
            tau = _first(self.retardation_time, 1 / slow[1])
            time = Parameter(
                f"{name}.retardation_time",
                "s",
                tau,
                fast,
                late,
                free=not self.retardation_time.fixed,
                prior_std=1.0,
            )
            found += [Term(c, compliance=site.unit(name)), Term(time)]
        return found


def _first(values: Values, default: float) -> float:
    """The start value of each joint."""
    return float(np.ravel(values.initial)[0]) if values.initial is not None else default
