"""Motors behind gears: the common part of rotor inertia and servo loops.

What holds a rotor, a controller or a brake, acts by the motor's torque: where that torque is an input, as
logged, the rotor is free (`Term.holds`, `held_fast`), and only its friction is left.

Motor rotors behind gears: n^2 J on the drive side, held by a servo or a brake.

Kobe (IJAT 15-5, 2021, Fig. 8) and Nagoya (two-link) put the gear's spring between rotor and link.

Servo loops of motors behind gears: position, velocity and current control that hold the robot during the
test.

Kobe (IJAT 15-5, 2021, Fig. 9): the motor's torque comes from a cascade of a proportional position loop, a
proportional-integral velocity loop and a current loop.  What the rotor feels of it is a stiffness that
depends on frequency:

    z(s) = k (s + p) (s + 1/T) w / (s (s + w)),   k velocity gain, p position gain, T integral time, w
    bandwidth of the current loop
"""

from __future__ import annotations

from abc import ABC
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Annotated, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from identify.core.arrays import Array
from identify.core.errors import InputError
from identify.core.parameters import DampingValues, Values, parameter, spread
from identify.model.effects.base import Effect, Term
from identify.model.effects.place import Beside, Place
from identify.model.effects.site import Added, Site
from identify.model.effects.springs import compliance_terms, spring_terms
from identify.robot.description import Robot
from identify.robot.points import Point
from identify.robot.posture import Mechanism
from identify.robot.settings import Ratio

RATIO = 100.0
"""Of gears of which nothing is known: the common one."""
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
    shrink: bool = Field(
        False,
        description=(
            "true: what holds it is given by compliance, zero unless the data ask for more, so that a rotor"
            " that is held fast is inside the space; of `holding_stiffness`, only `bounds` count"
        ),
    )

    @model_validator(mode="after")
    def _shrinks_something(self) -> Self:
        if self.shrink and self.holding_stiffness is None:
            raise ValueError("shrink: nothing holds the rotor; add `holding_stiffness: {}`, or leave it out")
        return self

    def sentence(self) -> str:
        """For example: rotor inertia of joints 1, 2 behind the gear."""
        held = ", held by a spring" * (self.holding_stiffness is not None)
        return f"rotor inertia of {self.which} behind the gear{held}"

    @classmethod
    def instances(cls, robot: Robot, points: Mapping[int, Point]) -> Iterator[Self]:
        """Every joint, as an armature of unknown inertia with the common gear ratio of 100."""
        for number in range(1, len(robot.joints) + 1):
            yield cls(joints=[number], gear_ratio=[RATIO], inertia=Values(initial=1e-4, bounds=(1e-7, 1.0)))

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
        held = places, inertia, self.holding_stiffness, self.holding_damping, keys
        if self.shrink:  # only the data say how large it is, once it moves
            found = [_about_start(term) for term in found]
            springs = [_about_start(term) for term in compliance_terms(*held)]
        else:
            springs = spring_terms(*held)
        return found + [replace(term, holds=names[number // 2]) for number, term in enumerate(springs)]


def _about_start(term: Term) -> Term:
    """The same, a logarithm of which is known to about a factor of e before any data."""
    parameter = term.parameter
    return replace(term, parameter=replace(parameter, prior_std=1.0)) if parameter.log else term


Positive = Annotated[float, Field(gt=0)]
_VELOCITY_HZ = 20.0
"""Without a start value, the velocity loop has this bandwidth with rotor and arm on a stiff gear: controllers
are tuned to their load.
"""


class Servo(Geared):
    """Rotors that a cascaded controller holds at a constant command; each is a coordinate `joint2.rotor`, the
    angle of the gear output that its turning produces.  Joint compliance about rz is then the gear's windup
    between rotor and link.

    z(s) is exact and costs one more coordinate, `joint2.servo`, whose two states are those of the controller:
    the integral and the lag of the current.  With that coordinate eliminated, a symmetric pair of rows leaves
    z(s) at the rotor:

        [ k (w - b1^2/m)    k (b0 + s b1) ]      m = 1/w,   b0^2 = m w p/T,
        [ k (b0 + s b1)    -k m s (s + w) ]      (b1 w - b0)^2 = m w (w - p) (w - 1/T)

    Its inertia is negative, because an integral gives energy; everything stays linear in the velocity gain k.
    The rotor's gyroscopic torques on its carrier are left out (order 1/n), as are friction, sampling and
    command filters.
    """

    kind: Literal["servo"] = "servo"
    position_gain_per_s: Positive | list[Positive] = Field(description="position loop, 1/s")
    integral_time_s: Positive | list[Positive] = Field(description="integral time of the velocity loop, s")
    current_bandwidth_hz: Positive | list[Positive] = Field(description="bandwidth of the current loop, Hz")
    velocity_gain: Values = Field(
        Values(),
        description=(
            "on the motor side, N m s/rad; `fixed: true` where it is known; default start: a bandwidth of"
            " 20 Hz"
        ),
    )

    @model_validator(mode="after")
    def _nested_loops(self) -> Self:
        for key in ("position_gain_per_s", "integral_time_s", "current_bandwidth_hz"):
            value = getattr(self, key)
            if isinstance(value, list) and len(value) != len(self.joints):
                raise ValueError(
                    f"{key}: {len(value)} values for {len(self.joints)} joints; expected one, or one per"
                    " joint"
                )
        position, integral, current = self._loops()
        if np.any(current <= np.maximum(position, integral)):
            raise ValueError(
                "current_bandwidth_hz: slower than an outer loop; expected 2 pi times it above the gain and"
                " 1/integral time"
            )
        return self

    def sentence(self) -> str:
        """For example: servo loops of joints 1, 2 behind the gear."""
        return f"servo loop{'s' if len(self.joints) > 1 else ''} of {self.which} behind the gear"

    @classmethod
    def instances(cls, robot: Robot, points: Mapping[int, Point]) -> Iterator[Self]:
        """Every joint, with usual loops around a rotor of unknown inertia and gain behind the common gear
        ratio of 100.
        """
        for number in range(1, len(robot.joints) + 1):
            yield cls(
                joints=[number],
                gear_ratio=[RATIO],
                inertia=Values(initial=1e-4, bounds=(1e-7, 1.0)),
                position_gain_per_s=30.0,
                integral_time_s=0.03,
                current_bandwidth_hz=500.0,
                velocity_gain=Values(),
            )

    def _loops(self) -> tuple[Array, Array, Array]:
        """p, 1/T and w, 1/s, one per joint (joints,)."""
        values = (
            self.position_gain_per_s,
            1 / np.asarray(self.integral_time_s),
            2 * np.pi * np.asarray(self.current_bandwidth_hz),
        )
        position, integral, current = (
            np.broadcast_to(np.asarray(value, dtype=float), len(self.joints)) for value in values
        )
        return position, integral, current

    def added_coordinates(self, robot: Robot, mechanism: Mechanism) -> list[Added]:
        """A rotor turns its link as the drive coordinate does; the controller's coordinate moves nothing
        else.
        """
        numbers = self.numbers(robot)
        rotors = [Added(f"joint{n}.rotor", robot.links[n].name, {f"joint{n}.rz": 1.0}) for n in numbers]
        return rotors + [Added(f"joint{n}.servo", robot.links[n].name) for n in numbers]

    def free_coordinates(self, robot: Robot) -> list[str]:
        """The rotors and the states of their controllers."""
        return [f"joint{n}.{what}" for what in ("rotor", "servo") for n in self.numbers(robot)]

    def terms(self, robot: Robot, site: Site, where: str) -> list[Term]:
        """Inertia per rotor, then friction; then velocity gain per rotor: n^2 times the rows of rotor and
        controller.
        """
        numbers, squares, values = self.numbers(robot), np.square(self.gear_ratio), self.velocity_gain
        units = [site.unit(f"joint{n}.rotor") for n in numbers]
        rotors = self.rotor_terms(robot, units, where)
        turning = np.array([site.inertia(f"joint{n}.rotor") for n in numbers]) / squares
        own = np.array([term.parameter.initial for term in rotors])
        gains = spread(values, 2 * np.pi * _VELOCITY_HZ * (turning + own), f"{where}.velocity_gain")
        terms = []
        for number, gain, square, *loop in zip(numbers, gains, squares, *self._loops(), strict=True):
            name, key = f"joint{number}.servo", f"{where}.velocity_gain"
            rows = np.array([site.vector(f"joint{number}.rotor"), site.vector(name)])
            blocks = [square * rows.T @ block @ rows for block in _blocks(*loop)]
            gained = parameter(f"{name}.velocity_gain", "N m s/rad", gain, values, key)
            stiffness, damping, mass = blocks
            terms.append(Term(gained, stiffness, damping, mass, holds=f"joint{number}.rotor"))
        return rotors + self.friction_terms(robot, units, squares * (turning + own), where) + terms


def _blocks(position: float, integral: float, current: float) -> tuple[Array, Array, Array]:
    """K, C, M (2, 2) of rotor and controller for a velocity gain of one."""
    own = 1 / current
    b0 = np.sqrt(own * current * position * integral)
    b1 = (b0 + np.sqrt(own * current * (current - position) * (current - integral))) / current
    stiffness = np.array([[current - b1**2 / own, b0], [b0, 0.0]])
    damping = np.array([[0.0, b1], [b1, -own * current]])
    return stiffness, damping, np.diag([0.0, -own])
