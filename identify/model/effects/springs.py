"""A spring and a viscous damper on each of a list of coordinates: the common part of joint and base
compliance; start values and bounds.
"""

from __future__ import annotations

from typing import Annotated, Literal, TypeVar

import numpy as np
from pydantic import AfterValidator, Field

from identify.core.parameters import DampingValues, Parameter, Values, parameter, spread
from identify.model.effects.base import Contribution, Effect
from identify.model.effects.site import Site
from identify.robot.description import Robot

Axis = Literal["tx", "ty", "tz", "rx", "ry", "rz"]
Joints = Literal["all"] | list[int | str]
T = TypeVar("T", bound=str)


def unique(axes: list[T]) -> list[T]:
    """The axes, none of them twice; ValueError otherwise, for pydantic."""
    if len(set(axes)) < len(axes):
        raise ValueError("an axis is named twice")
    return axes


AxisList = Annotated[list[Axis], AfterValidator(unique)]
START_HZ = 20.0
"""Without a start value, each coordinate on its own resonates here: the middle of where robots do."""


class Springs(Effect):
    """Spring and damper per released coordinate; a subclass says which coordinates."""

    stiffness: Values = Field(Values(), description="N/m or N m/rad")
    damping: DampingValues = Field(DampingValues(), description="N s/m or N m s/rad")

    def parameters(self, robot: Robot, site: Site, where: str) -> list[Parameter]:
        """A stiffness and a damping per coordinate, in that order."""
        names = self.free_coordinates(robot)
        inertia = np.array([site.inertia(name) for name in names])
        k = spread(self.stiffness, inertia * (2 * np.pi * START_HZ) ** 2, f"{where}.stiffness")
        c = spread(self.damping, 2 * self.damping.damping_ratio * np.sqrt(k * inertia), f"{where}.damping")
        result = []
        for name, stiffness, damping in zip(names, k, c, strict=True):
            force = "N" if name.split(".")[-1].startswith("t") else "N m"
            per = "m" if force == "N" else "rad"
            result.append(
                parameter(
                    f"{name}.stiffness", f"{force}/{per}", stiffness, self.stiffness, f"{where}.stiffness"
                )
            )
            result.append(
                parameter(f"{name}.damping", f"{force} s/{per}", damping, self.damping, f"{where}.damping")
            )
        return result

    def contributions(self, robot: Robot, site: Site) -> list[Contribution]:
        """One on the diagonal of K and of C per coordinate."""
        units = [site.unit(name) for name in self.free_coordinates(robot)]
        return [part for unit in units for part in (Contribution(stiffness=unit), Contribution(damping=unit))]


def joint_coordinates(robot: Robot, joints: Joints, axes: list[Axis], where: str) -> list[str]:
    """joint1.rz and so on, joint by joint; an unknown joint is an InputError."""
    numbers = (
        range(1, len(robot.joints) + 1)
        if joints == "all"
        else [robot.joint_number(joint, where) for joint in joints]
    )
    return [f"joint{number}.{axis}" for number in numbers for axis in axes]
