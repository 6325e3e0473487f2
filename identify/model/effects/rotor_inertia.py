"""Motor rotors behind gears: n^2 J on the drive side, held by a servo or a brake.

Kobe (IJAT 15-5, 2021, Fig. 8) and Nagoya (two-link) put the gear's spring between rotor and link.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Literal, Self

import numpy as np
from pydantic import Field

from identify.core.parameters import DampingValues, Values
from identify.model.effects.base import Term
from identify.model.effects.geared import Geared
from identify.model.effects.site import Added, Site
from identify.model.effects.springs import spring_terms
from identify.robot.description import Robot
from identify.robot.points import Point
from identify.robot.posture import Mechanism


class RotorInertia(Geared):
    """Rotors of some joints.  Without `holding_stiffness` and `friction` a rotor turns with its link's drive
    coordinate (rigid gear, armature).

    With either, a rotor is a coordinate of its own, `joint2.rotor`: the angle of the gear output that the
    rotor's turning produces.  The servo's or brake's stiffness holds it to the parent link (without one it is
    held fast), but where its torque is an input.  Joint compliance about rz is then the gear's windup in
    series.  The rotor's gyroscopic torques on its carrier are left out (order 1/n).
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
        own = "rotor" if self._turns_by_itself else "rz"
        return [f"joint{number}.{own}" for number in self.numbers(robot)]

    @property
    def _turns_by_itself(self) -> bool:
        return self.holding_stiffness is not None or self.friction is not None

    def added_coordinates(self, robot: Robot, mechanism: Mechanism) -> list[Added]:
        """A rotor turns its link as the drive coordinate does."""
        if not self._turns_by_itself:
            return []
        return [
            Added(f"joint{n}.rotor", robot.links[n].name, {f"joint{n}.rz": 1.0}) for n in self.numbers(robot)
        ]

    def free_coordinates(self, robot: Robot) -> list[str]:
        """The rotors' own coordinates, if they have any."""
        return self._coordinates(robot) if self._turns_by_itself else []

    def held_fast(self, robot: Robot) -> list[str]:
        """All, as by brakes, where nothing is said of what holds them."""
        return [] if self.holding_stiffness else self.free_coordinates(robot)

    def terms(self, robot: Robot, site: Site, where: str) -> list[Term]:
        """Inertia per rotor, then friction per rotor, then holding stiffness and damping per rotor."""
        names = self._coordinates(robot)
        units = [site.unit(name) for name in names]
        rotors = self.rotor_terms(robot, units, where)
        own = np.square(self.gear_ratio) * [term.parameter.initial for term in rotors]
        inertia = np.array([site.inertia(name) for name in names]) + own
        found = rotors + self.friction_terms(robot, units, inertia, where)
        if self.holding_stiffness is None:
            return found
        keys = f"{where}.holding_stiffness", f"{where}.holding_damping"
        places = [(name, "N m/rad", unit) for name, unit in zip(names, units, strict=True)]
        springs = spring_terms(places, inertia, self.holding_stiffness, self.holding_damping, keys)
        return found + [replace(term, holds=names[number // 2]) for number, term in enumerate(springs)]
