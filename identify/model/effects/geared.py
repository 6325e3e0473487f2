"""Motors behind gears: the common part of rotor inertia and servo loops.

What holds a rotor, a controller or a brake, acts by the motor's torque: where that torque is an input, as
logged, the rotor is free (`Term.holds`, `held_fast`), and only its friction is left.
"""

from __future__ import annotations

from abc import ABC
from collections.abc import Mapping, Sequence
from typing import Self

import numpy as np
from pydantic import Field, model_validator

from identify.core.arrays import Array
from identify.core.errors import InputError
from identify.core.parameters import Values, parameter, spread
from identify.model.effects.base import Effect, Term
from identify.model.effects.place import Beside, Place
from identify.robot.description import Robot
from identify.robot.points import Point
from identify.robot.settings import Ratio

_CORNER_HZ = 1.0
"""Without a start value, friction and inertia weigh the same at this frequency: a free drive runs out within
some tenths of a second.
"""


class Geared(Effect, ABC):
    """Motors of some joints with their gear ratios and rotors."""

    joints: list[int | str] = Field(min_length=1, description="joint numbers (from 1) or names")
    gear_ratio: list[Ratio] = Field(min_length=1, description="motor turns per joint turn, one per joint")
    inertia: Values = Field(
        Values(), description="on the motor side, kg m^2; `fixed: true` where a data sheet says it"
    )

    friction: Values | None = Field(
        None,
        description="viscous friction of each motor, N m s/rad at the gear output; makes each rotor a"
        " coordinate of its own, `joint2:motor` of measurements; default start: a corner at 1 Hz",
    )

    @model_validator(mode="after")
    def _one_ratio_per_joint(self) -> Self:
        if len(self.gear_ratio) != len(self.joints):
            raise ValueError(
                f"gear_ratio: {len(self.gear_ratio)} ratios for {len(self.joints)} joints; expected one per"
                " joint"
            )
        return self

    @property
    def which(self) -> str:
        """For example: joints 1, 2."""
        return f"joint{'s' if len(self.joints) > 1 else ''} {', '.join(map(str, self.joints))}"

    def numbers(self, robot: Robot) -> list[int]:
        """Joint numbers, from 1."""
        return robot.joint_numbers(self.joints, f"effects.{self.kind}.joints")

    def places(self, robot: Robot, points: Mapping[int, Point]) -> list[Place]:
        """Beside the springs of its drives."""
        return [Beside(tuple(f"joint{number}.rz" for number in self.numbers(robot)))]

    def rotor_terms(self, robot: Robot, units: Sequence[Array], where: str) -> list[Term]:
        """The rotors' inertias on the motor side, kg m^2: n^2 on the coordinate of each, whose matrix (n, n)
        is in `units`; InputError where they are not given.
        """
        key = f"{where}.inertia"
        if self.inertia.initial is None:
            raise InputError(key, "no `initial`", "the rotor inertia in kg m^2 from the motor's data sheet")
        names = [f"joint{number}.rotor.inertia" for number in self.numbers(robot)]
        starts = spread(self.inertia, np.zeros(len(self.joints)), key)
        return [
            Term(parameter(name, "kg m^2", start, self.inertia, key), mass=ratio**2 * unit)
            for name, start, ratio, unit in zip(names, starts, self.gear_ratio, units, strict=True)
        ]

    def friction_terms(self, robot: Robot, units: Sequence[Array], moved: Array, where: str) -> list[Term]:
        """The friction of rotors whose coordinates have the matrices (n, n) `units` and move the inertias
        (rotors,), kg m^2 at the gear output; none where none is stated.
        """
        if self.friction is None:
            return []
        key, names = f"{where}.friction", [f"joint{number}.rotor.friction" for number in self.numbers(robot)]
        starts = spread(self.friction, 2 * np.pi * _CORNER_HZ * moved, key)
        return [
            Term(parameter(name, "N m s/rad", start, self.friction, key), damping=unit)
            for name, start, unit in zip(names, starts, units, strict=True)
        ]
