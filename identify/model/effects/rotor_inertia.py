"""Motor rotors behind gears: n^2 J on the drive side, held by a servo or a brake.

Kobe (IJAT 15-5, 2021, Fig. 8) and Nagoya (two-link) put the gear's spring between rotor and link.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Literal, Self

import numpy as np
from pydantic import Field

from identify.core.parameters import DampingValues, Parameter, Values, parameter, spread
from identify.model.effects.base import Contribution
from identify.model.effects.geared import Geared
from identify.model.effects.site import Added, Site
from identify.robot.description import Robot
from identify.robot.points import Point
from identify.robot.posture import Mechanism


class RotorInertia(Geared):
    """Rotors of some joints.  Without `holding_stiffness` a rotor turns with its link's drive coordinate
    (rigid gear, armature).

    With it, a rotor is a coordinate of its own, `joint2.rotor`: the angle of the gear output that the rotor's
    turning produces, held to the parent link by the servo's or brake's stiffness; joint compliance about rz
    is then the gear's windup in series.  The rotor's gyroscopic torques on its carrier are left out (order
    1/n).
    """

    kind: Literal["rotor-inertia"] = "rotor-inertia"
    holding_stiffness: Values | None = Field(
        None, description="N m/rad at the gear output; makes each rotor a coordinate of its own"
    )
    holding_damping: DampingValues = Field(DampingValues(), description="N m s/rad at the gear output")

    def sentence(self) -> str:
        """For example: rotor inertia of joints 1, 2 behind their gears."""
        return f"rotor inertia of {self.which} behind the gear"

    @classmethod
    def instances(cls, robot: Robot, points: Mapping[int, Point]) -> Iterator[Self]:
        """Every joint, as an armature of unknown inertia with the common gear ratio of 100."""
        for number in range(1, len(robot.joints) + 1):
            yield cls(joints=[number], gear_ratio=[100.0], inertia=Values(initial=1e-4, bounds=(1e-7, 1.0)))

    def _coordinates(self, robot: Robot) -> list[str]:
        own = "rotor" if self.holding_stiffness else "rz"
        return [f"joint{number}.{own}" for number in self.numbers(robot)]

    def added_coordinates(self, robot: Robot, mechanism: Mechanism) -> list[Added]:
        """A rotor turns its link as the drive coordinate does."""
        if self.holding_stiffness is None:
            return []
        return [
            Added(f"joint{n}.rotor", robot.links[n].name, {f"joint{n}.rz": 1.0}) for n in self.numbers(robot)
        ]

    def free_coordinates(self, robot: Robot) -> list[str]:
        """The rotors' own coordinates, if they have any."""
        return self._coordinates(robot) if self.holding_stiffness else []

    def parameters(self, robot: Robot, site: Site, where: str) -> list[Parameter]:
        """Inertia per rotor, then holding stiffness and damping per rotor."""
        inertia, result = self.rotors(robot, where)
        if self.holding_stiffness is None:
            return result
        names = self._coordinates(robot)
        moved = np.array([site.inertia(name) for name in names]) + np.square(self.gear_ratio) * inertia
        k = spread(self.holding_stiffness, moved * (2 * np.pi * 20.0) ** 2, f"{where}.holding_stiffness")
        c = spread(
            self.holding_damping,
            2 * self.holding_damping.damping_ratio * np.sqrt(k * moved),
            f"{where}.holding_damping",
        )
        for name, stiffness, damping in zip(names, k, c, strict=True):
            result.append(
                parameter(
                    f"{name}.stiffness",
                    "N m/rad",
                    stiffness,
                    self.holding_stiffness,
                    f"{where}.holding_stiffness",
                )
            )
            result.append(
                parameter(
                    f"{name}.damping", "N m s/rad", damping, self.holding_damping, f"{where}.holding_damping"
                )
            )
        return result

    def contributions(self, robot: Robot, site: Site) -> list[Contribution]:
        """n^2 on the rotor's coordinate per unit of inertia, then spring and damper."""
        units = [site.unit(name) for name in self._coordinates(robot)]
        result = [
            Contribution(mass=ratio**2 * unit) for ratio, unit in zip(self.gear_ratio, units, strict=True)
        ]
        if self.holding_stiffness:
            result += [
                part for unit in units for part in (Contribution(stiffness=unit), Contribution(damping=unit))
            ]
        return result
