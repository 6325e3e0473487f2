"""A dynamic stiffness that was measured at a place and that no other effect says: rational in s.

    kappa(s) = k + s c + sum_i s k_i c_i / (k_i + s c_i)

on each coordinate: a spring, a damper and Maxwell branches (a spring in series with a damper, which relaxes
in the time c_i / k_i).  With enough branches this comes near any passive law that rises with frequency:
hysteretic and fractional damping, rubber, a pad with several relaxation times (generalised Maxwell model).
What joins spring and damper of a branch is a coordinate of its own, with a mass that resonates far above what
is measured.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Annotated, ClassVar, Literal, Self

import numpy as np
from pydantic import AfterValidator, Field, model_validator

from identify.core.arrays import Array
from identify.core.parameters import Parameter, Values, parameter
from identify.model.effects.base import Effect, Term
from identify.model.effects.place import Beside, Place, Release
from identify.model.effects.site import Added, Site
from identify.model.effects.springs import START_HZ, stiffness_unit
from identify.robot.description import Robot
from identify.robot.points import Point
from identify.robot.posture import Mechanism

_FAST_HZ = 1e4
"""Where the mass between spring and damper of a branch resonates with the default stiffness of its branch."""
_SPAN = 1e4


def _different(names: list[str]) -> list[str]:
    if len(set(names)) < len(names):
        raise ValueError("a coordinate is named twice")
    return names


class MeasuredImpedance(Effect):
    """Springs, dampers and Maxwell branches on coordinates, each with its own values.

    Coordinates that no other effect frees are released; on free ones it acts beside what they have, and
    brings no spring, because the data could not tell two springs apart.
    """

    last_resort: ClassVar[bool] = True
    RENAMED: ClassVar[Mapping[str, str]] = {"lean": "misalignment"}
    kind: Literal["measured-impedance"] = "measured-impedance"
    at: Annotated[list[str], AfterValidator(_different)] = Field(
        min_length=1, description="coordinates, such as joint4.ry or base.rx"
    )
    released: bool = Field(True, description="false: another effect frees them already")
    branches: int = Field(1, ge=0, le=4, description="Maxwell branches on each coordinate")
    misalignment: dict[str, float] = Field(
        {},
        description="what moves with a unit of a single coordinate, whose axis it turns: {joint4.rx: 0.01}",
    )
    stiffness: Values = Field(Values(), description="k, N/m or N m/rad")
    damping: Values = Field(Values(), description="c, N s/m or N m s/rad")
    branch_stiffness: Values = Field(
        Values(), description="k_i, branch by branch for each coordinate in turn"
    )
    branch_damping: Values = Field(Values(), description="c_i, likewise")

    @model_validator(mode="after")
    def _one_axis(self) -> Self:
        body, _, axis = self.at[0].partition(".")
        if self.misalignment and (len(self.at) > 1 or not self.released):
            raise ValueError("misalignment: turns the axis of a single coordinate that is released here")
        alike = [f"{body}.{axis[:1]}{other}" for other in "xyz"]
        if not set(self.misalignment) <= set(alike) - {self.at[0]}:
            raise ValueError(f"misalignment: expected some of {', '.join(alike)} but not {self.at[0]} itself")
        return self

    @property
    def settings_found(self) -> int:
        """How many misalignments it has."""
        return len(self.misalignment)

    def sentence(self) -> str:
        """For example: measured dynamic stiffness of joint 4 (rx, ry), 2 relaxation times."""
        bodies = list(dict.fromkeys(name.partition(".")[0] for name in self.at))
        axes = [", ".join(n.partition(".")[2] for n in self.at if n.startswith(f"{b}.")) for b in bodies]
        names = ", ".join(
            f"{body.replace('joint', 'joint ')} ({own})" for body, own in zip(bodies, axes, strict=True)
        )
        times = f"{self.branches} relaxation time{'s' if self.branches != 1 else ''}"
        turns = ", ".join(turned(name, by) for name, by in self.misalignment.items())
        axis = f" about an axis turned by {turns}" if self.misalignment else ""
        return f"measured dynamic stiffness of {names}{axis}, {times}"

    @classmethod
    def instances(cls, robot: Robot, points: Mapping[int, Point]) -> Iterator[Self]:
        """The locked axes of every joint; discovery makes one only where it has measured a law that no other
        effect has.
        """
        for number in range(1, len(robot.joints) + 1):
            for axis in ("rx", "ry", "tx", "ty", "tz"):
                yield cls(at=[f"joint{number}.{axis}"])

    def variants(self) -> list[Self]:
        """Each of its coordinates alone; one relaxation time more or less."""
        alone = [self.model_copy(update={"at": [name]}) for name in self.at] if len(self.at) > 1 else []
        counts = [n for n in (self.branches - 1, self.branches + 1) if 1 <= n <= 3]
        return [*alone, *(self.model_copy(update={"branches": n}) for n in counts)]

    def _branch(self, name: str, number: int) -> str:
        return f"{name}.branch_{number + 1}"

    def added_coordinates(self, robot: Robot, mechanism: Mechanism) -> list[Added]:
        """What joins spring and damper of each branch; an axis that is misaligned takes others along."""
        own = [Added(name, _link(robot, name), self.misalignment) for name in self.at if self.misalignment]
        return own + [
            Added(self._branch(name, number), _link(robot, name))
            for name in self.at
            for number in range(self.branches)
        ]

    def free_coordinates(self, robot: Robot) -> list[str]:
        """Those of its place, if it releases them, and its own."""
        own = [self._branch(name, n) for name in self.at for n in range(self.branches)]
        return [*(self.at if self.released else []), *own]

    def places(self, robot: Robot, points: Mapping[int, Point]) -> list[Place]:
        """Its coordinates."""
        names = tuple(self.at)
        return [Release(names) if self.released else Beside(names)]

    def consistent_mass(self, robot: Robot, site: Site) -> Array | None:
        """A mass between spring and damper of each branch that no measurement sees."""
        total = np.zeros((len(site.coordinates),) * 2)
        for name in self.at:
            if name not in site.detached:
                small = site.inertia(name) * (START_HZ / _FAST_HZ) ** 2
                for number in range(self.branches):
                    total += small * site.unit(self._branch(name, number))
        return total

    def terms(self, robot: Robot, site: Site, where: str) -> list[Term]:
        """k and c of each coordinate, then k_i and c_i of its branches."""
        result = []
        for place, name in enumerate(self.at):
            size = site.inertia(name) * (2 * np.pi * START_HZ) ** 2
            if self.released:
                k = self._parameter(f"{name}.stiffness", size, place, "stiffness", where)
                result.append(Term(k, stiffness=site.unit(name)))
                c = self._parameter(f"{name}.damping", _damper(size, 0.03), place, "damping", where)
                result.append(Term(c, damping=site.unit(name)))
            for number in range(self.branches):
                result += self._maxwell(site, name, size, place * self.branches + number, where)
        return result

    def starts_beside(self, stiffness: Mapping[str, float]) -> dict[str, float]:
        """Values of the branches, by name, as by default but beside springs of known stiffness (by
        coordinate).
        """
        found: dict[str, float] = {}
        for name in self.at:
            for number in range(self.branches):
                own = self._branch(name, number)
                found[f"{own}.stiffness"], found[f"{own}.damping"] = self._start(stiffness[name], number)
        return found

    def _start(self, stiffness: float, number: int) -> tuple[float, float]:
        """k and c of a branch beside a spring: they relax at frequencies around the middle of where robots
        resonate.
        """
        relax = 2 * np.pi * START_HZ * 8.0 ** (number - (self.branches - 1) / 2)
        return 0.2 * stiffness, 0.2 * stiffness / relax

    def _maxwell(self, site: Site, name: str, size: float, place: int, where: str) -> list[Term]:
        """One branch."""
        number = place % self.branches
        own = self._branch(name, number)
        spring = site.vector(name) - site.vector(own)
        start = self._start(size, number)
        k = self._parameter(f"{own}.stiffness", start[0], place, "branch_stiffness", where)
        c = self._parameter(f"{own}.damping", start[1], place, "branch_damping", where)
        return [Term(k, stiffness=np.outer(spring, spring)), Term(c, damping=site.unit(own))]

    def _parameter(self, name: str, default: float, place: int, what: str, where: str) -> Parameter:
        values: Values = getattr(self, what)
        given = values.initial if isinstance(values.initial, (float, int)) else None
        if isinstance(values.initial, list):
            given = values.initial[place]
        start = default if given is None else float(given)
        if values.bounds is None:
            values = values.model_copy(update={"bounds": (start / _SPAN, start * _SPAN)})
        unit = stiffness_unit(".".join(name.split(".")[:2]))
        if what.endswith("damping"):
            force, _, length = unit.partition("/")
            unit = f"{force} s/{length}"
        return parameter(name, unit, start, values, f"{where}.{what}")


def turned(name: str, by: float, interval: str = "") -> str:
    """For example: 0.27° towards joint4.rx."""
    way = "towards" if by > 0 else "away from"
    return f"{np.degrees(np.arctan(abs(by))):.2f}{interval}° {way} {name}"


def _damper(stiffness: float, ratio: float) -> float:
    return 2 * ratio * stiffness / (2 * np.pi * START_HZ)


def _link(robot: Robot, name: str) -> str:
    """The link that a coordinate belongs to."""
    body, _, _ = name.partition(".")
    if body.startswith("joint") and body[5:].isdigit():
        return robot.links[int(body.removeprefix("joint"))].name
    return robot.links[0].name
