"""Servo loops of motors behind gears: position, velocity and current control that hold the robot during the
test.

Kobe (IJAT 15-5, 2021, Fig. 9): the motor's torque comes from a cascade of a proportional position loop, a
proportional-integral velocity loop and a current loop.  What the rotor feels of it is a stiffness that
depends on frequency:

    z(s) = k (s + p) (s + 1/T) w / (s (s + w)),   k velocity gain, p position gain, T integral time, w
    bandwidth of the current loop
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Annotated, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from identify.core.arrays import Array
from identify.core.parameters import Values, parameter, spread
from identify.model.effects.base import Term
from identify.model.effects.geared import Geared
from identify.model.effects.site import Added, Site
from identify.robot.description import Robot
from identify.robot.points import Point
from identify.robot.posture import Mechanism

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
                gear_ratio=[100.0],
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
