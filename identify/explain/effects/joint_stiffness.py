"""The gear as a spring: compliance, with a damper beside it (torque = k d + c d'), or one that falls with
load (Nagoya Eq. 8: torque = k1 d + k3 d^3).

Where the torque is that of the links' accelerations, these are differentiated twice; a deflection is a
difference of two positions as they were recorded.  So the errors are those of the torque, and what is left is
made orthogonal to the deflection: the stiffness is that of torque = k d by least squares, which noise of the
accelerations does not make larger, whatever `lowpass_hz` lets through of it.

Play of a joint: backlash goes with the sign of the torque in the gear, lost motion with the direction of
travel.

The link-side encoder is read later than the motor-side one: a moving joint looks deflected by speed times
latency.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import ClassVar, Self

import numpy as np

from identify.core.arrays import Array
from identify.explain.effects.base import Coefficient, MotionEffect, NonlinearParameter, Target
from identify.explain.recorded_motion import RecordedMotion


class _Spring(MotionEffect):
    """A compliance as the first coefficient."""

    positive: ClassVar[bool] = True
    target: ClassVar[Target] = "deflection"

    def instruments(self, scene: RecordedMotion, parameters: Array) -> Array | None:
        """The deflection as it was recorded, in place of the torque."""
        return None if scene.deflection is None else scene.on(self.axis, scene.deflection[:, self.axis - 1])


class JointCompliance(_Spring):
    """The motor side leads the link side by torque over stiffness."""

    kind: ClassVar[str] = "joint-compliance"
    says: ClassVar[str] = "compliance of joint {axis}: deflection in proportion to torque"
    coefficients = (Coefficient("compliance", "rad/(N m)"),)

    def reading(self, values: Array) -> str:
        """Stiffness."""
        return f"stiffness {1 / values[0]:.4g} N m/rad"

    def columns(self, scene: RecordedMotion, parameters: Array) -> Array:
        """The torque in the gear."""
        return scene.on(self.axis, scene.load[:, self.axis - 1])


class DampedCompliance(_Spring):
    """A spring with a damper beside it: torque = k d + c d', so that d = torque / k - (c / k) d'."""

    kind: ClassVar[str] = "damped-compliance"
    says: ClassVar[str] = "compliance of joint {axis} with a damper: deflection that follows torque late"
    coefficients = (Coefficient("compliance", "rad/(N m)"), Coefficient("relaxation time", "s"))
    replaces: ClassVar[str] = "joint-compliance"

    @classmethod
    def instances(cls, scene: RecordedMotion) -> Iterator[Self]:
        """Where the deflection was recorded."""
        if scene.deflection is not None:
            yield from super().instances(scene)

    def possible(self, values: Array) -> bool:
        """A spring that does not push back and a damper that does not drive."""
        return bool(values[0] > 0 and values[1] > 0)

    def reading(self, values: Array) -> str:
        """Stiffness and damper."""
        return f"stiffness {1 / values[0]:.4g} N m/rad, damper {values[1] / values[0]:.3g} N m s/rad"

    def columns(self, scene: RecordedMotion, parameters: Array) -> Array:
        """The torque in the gear, and how fast the gear is bent."""
        joint = self.axis - 1
        return scene.on(self.axis, scene.load[:, joint], -scene.deflection_rate[:, joint])

    def instruments(self, scene: RecordedMotion, parameters: Array) -> Array | None:
        """The deflection and how fast it changes."""
        joint = self.axis - 1
        assert scene.deflection is not None
        return scene.on(self.axis, scene.deflection[:, joint], -scene.deflection_rate[:, joint])


class HardeningStiffness(_Spring):
    """A spring that hardens: torque = d / c + k3 d^3, with c the compliance at no load and `torque` where k3
    has doubled its stiffness.
    """

    kind: ClassVar[str] = "hardening-stiffness"
    says: ClassVar[str] = "stiffness of joint {axis} that hardens with load (cubic)"
    coefficients = (Coefficient("compliance at no load", "rad/(N m)"),)
    replaces: ClassVar[str] = "joint-compliance"

    def parameters(self, scene: RecordedMotion) -> tuple[NonlinearParameter, ...]:
        """The torque at which linear and cubic part are alike, both k1 d."""
        top = float(np.abs(scene.load[:, self.axis - 1]).max())
        return (NonlinearParameter("torque", "N m", 0.05 * top, 20 * top, log=True),)

    def reading(self, values: Array) -> str:
        """k1 and k3."""
        k1 = 1 / values[0]
        return f"k1 {k1:.4g} N m/rad, k3 {k1**3 / values[1] ** 2:.4g} N m/rad^3"

    def columns(self, scene: RecordedMotion, parameters: Array) -> Array:
        """The d of d + d^3 / T^2 = torque, by Cardano's formula (one real root)."""
        u = scene.load[:, self.axis - 1] / parameters[0]
        root = np.cbrt(np.abs(u) / 2 + np.sqrt(u**2 / 4 + 1 / 27))
        return scene.on(self.axis, parameters[0] * np.sign(u) * (root - 1 / (3 * root)))


_SMOOTH = 0.004
"""Share of the largest torque over which the flank changes."""


class Backlash(MotionEffect):
    """The motor side leads by half the backlash on the flank that carries the torque."""

    kind: ClassVar[str] = "backlash"
    says: ClassVar[str] = "backlash of joint {axis}: the deflection jumps where the torque changes its sign"
    positive: ClassVar[bool] = True
    target: ClassVar[Target] = "deflection"
    coefficients = (Coefficient("half width", "rad"),)

    def columns(self, scene: RecordedMotion, parameters: Array) -> Array:
        """Sign of the torque in the gear."""
        load = scene.load[:, self.axis - 1]
        return scene.on(self.axis, np.tanh(load / max(_SMOOTH * float(np.abs(load).max()), 1e-12)))


class LostMotion(MotionEffect):
    """The motor side leads by half the lost motion in the direction of travel: friction behind the gear's
    compliance, or hysteresis.
    """

    kind: ClassVar[str] = "lost-motion"
    says: ClassVar[str] = (
        "lost motion (hysteresis) of joint {axis}: the deflection jumps where the direction of travel changes"
    )
    positive: ClassVar[bool] = True
    target: ClassVar[Target] = "deflection"
    coefficients = (Coefficient("half width", "rad"),)

    def humbler(self, scene: RecordedMotion) -> Sequence[Sequence[MotionEffect]]:
        """A damper in the gear, which holds back whichever way it is bent."""
        return ((DampedCompliance(self.axis),),) if scene.deflection is not None else ()

    def columns(self, scene: RecordedMotion, parameters: Array) -> Array:
        """Direction of travel, which a standing joint keeps."""
        speed = scene.travel[:, self.axis - 1]
        moving = np.abs(speed) > scene.slow
        last = np.maximum.accumulate(np.where(moving, np.arange(len(speed)), -1))
        return scene.on(self.axis, np.where(last >= 0, np.sign(speed[last]), 0.0))


class SensorLatency(MotionEffect):
    """Latency of the link-side reading against the motor-side one."""

    kind: ClassVar[str] = "sensor-latency"
    says: ClassVar[str] = (
        "latency of the link-side sensor of joint {axis} (deflection in proportion to speed)"
    )
    target: ClassVar[Target] = "deflection"
    coefficients = (Coefficient("latency", "s"),)

    def reading(self, values: Array) -> str:
        """Milliseconds."""
        return f"{1e3 * values[0]:.3g} ms"

    def columns(self, scene: RecordedMotion, parameters: Array) -> Array:
        """Speed of the link."""
        return scene.of_joint(self.axis, scene.link_velocity[:, self.axis - 1])
