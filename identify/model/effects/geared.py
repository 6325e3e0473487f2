"""Motors behind gears: the common part of rotor inertia and servo loops."""

from __future__ import annotations

from abc import ABC
from typing import Self

import numpy as np
from pydantic import Field, model_validator

from identify.core.arrays import Array
from identify.core.errors import InputError
from identify.core.parameters import Parameter, Values, parameter, spread
from identify.model.effects.base import Effect
from identify.robot.description import Robot


class Geared(Effect, ABC):
    """Motors of some joints with their gear ratios and rotors."""

    joints: list[int | str] = Field(min_length=1, description="joint numbers (from 1) or names")
    gear_ratio: list[float] = Field(min_length=1, description="motor turns per joint turn, one per joint")
    inertia: Values = Field(
        Values(), description="on the motor side, kg m^2; `fixed: true` where a data sheet says it"
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
        return [robot.joint_number(joint, f"effects.{self.kind}.joints") for joint in self.joints]

    def rotors(self, robot: Robot, where: str) -> tuple[Array, list[Parameter]]:
        """Inertias on the motor side (joints,), kg m^2, and the parameters of them; InputError where they are
        not given.
        """
        if self.inertia.initial is None:
            raise InputError(
                f"{where}.inertia", "no `initial`", "the rotor inertia in kg m^2 from the motor's data sheet"
            )
        inertia = spread(self.inertia, np.zeros(len(self.joints)), f"{where}.inertia")
        names = [f"joint{number}.rotor.inertia" for number in self.numbers(robot)]
        values = zip(names, inertia, strict=True)
        return inertia, [
            parameter(name, "kg m^2", value, self.inertia, f"{where}.inertia") for name, value in values
        ]
