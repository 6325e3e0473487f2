"""What a motion effect is: a named contribution to a measured time history, with linear coefficients and,
inside its columns, nonlinear parameters.

The history it adds to is its target: the motor's `torque`, the `deflection` (motor-side minus link-side
position) or the `tracking` error (command minus motor position).
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import ClassVar, Literal, Self

import numpy as np

from identify.core.arrays import Array
from identify.core.registry import Registry
from identify.explain.recorded_motion import RecordedMotion

Target = Literal["torque", "deflection", "tracking"]

MOTION_EFFECTS = Registry(
    "motion effect",
    "identify.motion_effects",
    {
        name: f"identify.explain.effects.{module}:{cls}"
        for name, module, cls in (
            ("acceleration-lag", "servo_terms", "AccelerationLag"),
            ("angular-transmission-error", "harmonics", "AngularTransmissionError"),
            ("backlash", "joint_stiffness", "Backlash"),
            ("balancer-preload", "rigid_body", "BalancerPreload"),
            ("coulomb-friction", "friction", "CoulombFriction"),
            ("damped-compliance", "joint_stiffness", "DampedCompliance"),
            ("encoder-eccentricity", "harmonics", "EncoderEccentricity"),
            ("gear-coupling", "motor_coupling", "GearCoupling"),
            ("gravity-balancer", "rigid_body", "GravityBalancer"),
            ("hardening-stiffness", "joint_stiffness", "HardeningStiffness"),
            ("integral-action", "servo_terms", "IntegralAction"),
            ("joint-compliance", "joint_stiffness", "JointCompliance"),
            ("link-first-moment", "rigid_body", "LinkFirstMoment"),
            ("link-inertia", "rigid_body", "LinkInertia"),
            ("load-dependent-friction", "friction", "LoadDependentFriction"),
            ("lost-motion", "joint_stiffness", "LostMotion"),
            ("motor-coupling", "motor_coupling", "MotorCoupling"),
            ("payload-mass", "rigid_body", "PayloadMass"),
            ("position-lag", "servo_terms", "PositionLag"),
            ("rotor-inertia", "motor_coupling", "RotorInertia"),
            ("sensor-latency", "joint_stiffness", "SensorLatency"),
            ("servo-compliance", "servo_terms", "ServoCompliance"),
            ("stribeck-friction", "friction", "StribeckFriction"),
            ("torque-constant", "friction", "TorqueConstant"),
            ("torque-offset", "friction", "TorqueOffset"),
            ("torque-ripple", "harmonics", "TorqueRipple"),
            ("viscous-friction", "friction", "ViscousFriction"),
        )
    },
    "identify.explain.effects.base:MotionEffect",
)


@dataclass(frozen=True)
class Coefficient:
    """A factor of a column: its name and unit."""

    name: str
    unit: str


@dataclass(frozen=True)
class NonlinearParameter:
    """A parameter inside the columns, searched between bounds, on a log scale where `log`."""

    name: str
    unit: str
    lower: float
    upper: float
    log: bool = False


@dataclass(frozen=True)
class MotionEffect(ABC):
    """One effect at one place; axis: number of the joint (from 1) that it belongs to."""

    axis: int
    kind: ClassVar[str]
    says: ClassVar[str]
    """What an instance is, as an engineer would say it, with its fields: `friction of joint {axis}`."""
    target: ClassVar[Target]
    coefficients: ClassVar[tuple[Coefficient, ...]]
    nonlinear: ClassVar[tuple[NonlinearParameter, ...]] = ()
    replaces: ClassVar[str] = ""
    """The simpler kind at the same joint that this one contains: it takes its place."""
    follows: ClassVar[str] = ""
    """The kind at the same joint that must be there before this one, which refines it, is tried."""
    in_gear: ClassVar[bool] = False
    """Whether its torque passes through the gear, so that it bends it."""
    of_bodies: ClassVar[bool] = False
    """Whether it is an error of the rigid bodies, or looks like one."""
    positive: ClassVar[bool] = False
    """Whether the first coefficient cannot be negative: friction that drives, a spring that leads, are
    something else.
    """
    harmonic: ClassVar[bool] = False
    """Whether coefficients come as pairs of cosine and sine over an angle, whose phase is a matter of where
    the angle counts from.
    """
    looked_for: ClassVar[bool] = True
    """Whether it is in the catalogue; else it is what another may be mistaken for, and has no name."""
    of_load: ClassVar[bool] = False
    """Whether its columns are made of the torque in the gears, which must be known first."""

    @property
    def name(self) -> str:
        """`joint2.coulomb-friction`."""
        return f"joint{self.axis}.{self.kind}"

    @property
    def needs(self) -> str:
        """Name of the effect that must be there before this one; empty: none."""
        return f"joint{self.axis}.{self.follows}" if self.follows else ""

    @property
    def supersedes(self) -> str:
        """Name of the effect whose place this one takes; empty: none."""
        return f"joint{self.axis}.{self.replaces}" if self.replaces else ""

    def sentence(self) -> str:
        """What this instance is, as an engineer would say it."""
        return self.says.format(**vars(self))

    @classmethod
    def instances(cls, scene: RecordedMotion) -> Iterator[Self]:
        """One instance for each place where the effect can sit: by default every examined joint."""
        for axis in scene.axes:
            yield cls(axis)

    def parameters(self, scene: RecordedMotion) -> tuple[NonlinearParameter, ...]:
        """The nonlinear parameters, with the bounds that suit the place."""
        return self.nonlinear

    @abstractmethod
    def columns(self, scene: RecordedMotion, parameters: Array) -> Array:
        """(samples, examined joints, coefficients): what one unit of each coefficient adds, with the
        nonlinear parameters (s,) inside.
        """

    def instruments(self, scene: RecordedMotion, parameters: Array) -> Array | None:
        """(samples, examined joints, coefficients): what the residual is made orthogonal to, for columns that
        have errors of their own; None: to the columns, as least squares does.
        """
        return None

    def humbler(self, scene: RecordedMotion) -> Sequence[Sequence[MotionEffect]]:
        """Effects that, together, may look like this one, so that it must show more than they do."""
        return ()

    def expected_size(self, scene: RecordedMotion) -> Array:
        """One over the standard deviation that each coefficient (c,) has before the data speak; zero: it may
        be anything.
        """
        return np.zeros(len(self.coefficients))

    def possible(self, values: Array) -> bool:
        """Whether it can be what it is called with these coefficients and nonlinear parameters."""
        return not (self.positive and values[0] < 0)

    def reading(self, values: Array) -> str:
        """What the coefficients and nonlinear parameters (in this order) mean in the field's own terms, or
        nothing.
        """
        return ""

    def starts(self, scene: RecordedMotion, residual: Array) -> Sequence[Array]:
        """Nonlinear parameters (s,) to search from, by default spread over the bounds; residual (samples,
        examined joints): what might be explained.
        """
        parameters = self.parameters(scene)
        if not parameters:
            return [np.zeros(0)]
        return [
            np.array([between(parameter, share) for parameter in parameters]) for share in (0.25, 0.5, 0.75)
        ]


def between(parameter: NonlinearParameter, share: float) -> float:
    """The value at that share of the way from the lower to the upper bound."""
    if parameter.log:
        return float(parameter.lower * (parameter.upper / parameter.lower) ** share)
    return parameter.lower + share * (parameter.upper - parameter.lower)
