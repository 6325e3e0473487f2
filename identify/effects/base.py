"""What an effect is: where it sits, what its parameters are and how it enters M, C and K; and the registry of all kinds."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from identify.errors import InputError
from identify.registry import Registry, parse_kind
from identify.robot.description import Robot
from identify.robot.engine import Engine
from identify.robot.posture import Mechanism

Array = NDArray[np.float64]

EFFECTS = Registry(
    "effect",
    "identify.effects",
    {
        "added-mass": "identify.effects.added_mass:AddedMass",
        "base-compliance": "identify.effects.base_compliance:BaseCompliance",
        "joint-compliance": "identify.effects.joint_compliance:JointCompliance",
        "rotor-inertia": "identify.effects.rotor_inertia:RotorInertia",
    },
)


@dataclass(frozen=True)
class Parameter:
    """One number to identify: value = initial unless fitted; searched on a log scale where `log`; not at all where not `free`."""

    name: str
    unit: str
    initial: float
    lower: float
    upper: float
    log: bool = True
    free: bool = True


@dataclass(frozen=True)
class Contribution:
    """What one unit of a parameter adds to the matrices over all coordinates, each (n, n), symmetric, or None."""

    stiffness: Array | None = None
    damping: Array | None = None
    mass: Array | None = None


@dataclass(frozen=True)
class Site:
    """A mechanism ready for effects to act on: its engine, and every coordinate by name with its motion in the engine's coordinates.

    shapes (engine coordinates, n) maps all coordinates, those that effects added too, to the engine's.  Where links
    were detached for the test, their coordinates and frames are absent and contribute nothing.
    """

    engine: Engine
    coordinates: tuple[str, ...]
    shapes: Array
    mass: Array = field(repr=False)
    detached: frozenset[str] = frozenset()

    def unit(self, coordinate: str) -> Array:
        """(n, n) with a single one on the diagonal, at `coordinate`; zero where that is detached."""
        matrix = np.zeros((len(self.coordinates),) * 2)
        if coordinate in self.coordinates:
            index = self.coordinates.index(coordinate)
            matrix[index, index] = 1.0
        return matrix

    def inertia(self, coordinate: str) -> float:
        """The inertia that the coordinate moves when all others are locked, kg or kg m^2."""
        if coordinate not in self.coordinates:
            known = ", ".join(dict.fromkeys(name.split(".")[0] for name in self.coordinates))
            raise InputError("effects", f"coordinate {coordinate} does not exist on this robot", f"one on {known}")
        index = self.coordinates.index(coordinate)
        return float(self.mass[index, index])

    def jacobian(self, frame: str, point: Array, where: str) -> Array:
        """(6, n): motion of a point (3,) of a frame, in the frame's axes, per coordinate."""
        if frame in self.detached:
            return np.zeros((6, len(self.coordinates)))
        return self.engine.jacobian(frame, point, where) @ self.shapes

    def weight_stiffness(self, frame: str, point: Array, where: str) -> Array:
        """(n, n) per kg: gravity stiffness of a point mass at a point (3,) of a frame."""
        if frame in self.detached:
            return np.zeros((len(self.coordinates),) * 2)
        return self.shapes.T @ self.engine.weight_stiffness(frame, point, where) @ self.shapes


class Effect(BaseModel, ABC):
    """Settings of one effect as written in the config.  The physics is in the four methods; nothing in an effect changes after reading.

    Positions in the config start with `effects.N`; `kind` is the name in the registry.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)
    kind: str

    @abstractmethod
    def sentence(self) -> str:
        """What this instance is, as an engineer would say it."""

    @classmethod
    @abstractmethod
    def places(cls, robot: Robot) -> Iterator[Self]:
        """One instance for each place where the effect can sit on a robot, for discovery."""

    def attach(self, mechanism: Mechanism, robot: Robot) -> Mechanism:
        """The mechanism with the bodies that this effect adds."""
        return mechanism

    def added_coordinates(self, robot: Robot) -> dict[str, str]:
        """Further coordinates: name -> the engine coordinate whose motion each repeats (a rotor turns its link), or '' for none."""
        return {}

    @abstractmethod
    def released(self, robot: Robot) -> list[str]:
        """The coordinates that this effect lets move."""

    @abstractmethod
    def parameters(self, robot: Robot, site: Site, where: str) -> list[Parameter]:
        """The numbers to identify, in a fixed order; `site` (the first posture) scales defaults."""

    @abstractmethod
    def contributions(self, robot: Robot, site: Site) -> list[Contribution]:
        """What each parameter adds per unit, in the order of `parameters`."""


class Values(BaseModel):
    """Start, bounds and freedom of a group of parameters; a list gives one number per place, a number serves all."""

    model_config = ConfigDict(extra="forbid", frozen=True)
    initial: float | list[float] | None = Field(None, description="start value, or one per place; default: from the robot's inertia")
    bounds: tuple[float, float] | None = Field(None, description="smallest and largest value; default: a factor of 1000 either side")
    fixed: bool = Field(False, description="true: kept at `initial`, not fitted")


class DampingValues(Values):
    """Values of viscous dampers, which may be given as a damping ratio of the coordinate on its own."""

    damping_ratio: float = Field(0.03, gt=0, description="start value as c = 2 zeta sqrt(k m), m the inertia the coordinate moves")


def parse_effect(data: Any) -> Effect:
    """An effect from its mapping in the config, by `kind`; raises ValueError for pydantic to report with its key."""
    if isinstance(data, Effect):
        return data
    effect: Effect = parse_kind(EFFECTS, data)
    return effect
