"""Torque that waves with the motor's angle: cogging and the poles and slots of the motor, a whole number of
waves per turn.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np

from identify.core.arrays import Array
from identify.explain.effects.base import Coefficient, MotionEffect, Target
from identify.explain.effects.harmonics import LAG, cosine_and_sine, lags, late
from identify.explain.recorded_motion import RecordedMotion

ORDERS = (4, 6, 8, 12, 16)
"""Waves per turn of the motor that are tried: the usual numbers of poles and their multiples."""


@dataclass(frozen=True)
class TorqueRipple(MotionEffect):
    """A harmonic of `order` per motor turn whose size may change with speed, as the servo loop lets more or
    less of it through.
    """

    order: int = 1
    kind: ClassVar[str] = "torque-ripple"
    says: ClassVar[str] = "torque ripple of motor {axis}, {order} waves per motor turn"
    target: ClassVar[Target] = "torque"
    harmonic: ClassVar[bool] = True
    coefficients = (
        Coefficient("cosine", "N m"),
        Coefficient("sine", "N m"),
        Coefficient("cosine per speed", "N m s/rad"),
        Coefficient("sine per speed", "N m s/rad"),
    )
    nonlinear = (LAG,)

    @classmethod
    def instances(cls, scene: RecordedMotion) -> Iterator[Self]:
        """Every order at every examined joint, of which it passes a wave: less is like any other curve."""
        turns = scene.gear_ratio
        every = ((axis, order) for axis in scene.axes for order in ORDERS)
        yield from (
            cls(*one) for one in every if scene.waves_travelled(one[0], one[1] * turns[one[0] - 1]) >= 1
        )

    @property
    def name(self) -> str:
        """`joint1.torque-ripple.8`."""
        return f"{super().name}.{self.order}"

    def reading(self, values: Array) -> str:
        """Amplitude over speed."""
        still, rising = np.hypot(*values[:2]), np.hypot(*values[2:4])
        return (
            f"amplitude {still:.3g} N m and {rising * np.pi / 180:.3g} N m per deg/s, {1e3 * values[4]:.3g}"
            " ms late"
        )

    def columns(self, scene: RecordedMotion, parameters: Array) -> Array:
        """Waves over the motor's angle, and times speed."""
        joint = self.axis - 1
        cosine, sine = cosine_and_sine(
            scene.gear_ratio[joint] * late(scene, joint, parameters[0]), self.order
        )
        speed = np.abs(scene.velocity[:, joint])
        return scene.on(self.axis, cosine, sine, speed * cosine, speed * sine)

    def starts(self, scene: RecordedMotion, residual: Array) -> list[Array]:
        """Every lag that a harmonic can tell apart."""
        return [np.array([lag]) for lag in lags(9)]
