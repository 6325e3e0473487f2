"""What a drive may have wrong about its own torque: a constant, and the torque constant."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from identify.core.arrays import Array
from identify.explain.effects.base import Coefficient, MotionEffect, Target
from identify.explain.recorded_motion import RecordedMotion


class TorqueOffset(MotionEffect):
    """A constant torque: a sensing offset, or friction that differs with the direction of travel."""

    kind: ClassVar[str] = "torque-offset"
    says: ClassVar[str] = (
        "constant torque at motor {axis} (a sensing offset, or friction that differs with direction)"
    )
    target: ClassVar[Target] = "torque"
    coefficients = (Coefficient("torque", "N m"),)

    def columns(self, scene: RecordedMotion, parameters: Array) -> Array:
        """Ones."""
        return scene.on(self.axis, np.ones(len(scene.time_s)))


class TorqueConstant(MotionEffect):
    """The torque is stated too high or too low by a share: a wrong torque constant, or all masses wrong by
    it.
    """

    kind: ClassVar[str] = "torque-constant"
    says: ClassVar[str] = "torque constant of motor {axis} off by a share"
    of_load: ClassVar[bool] = True
    of_bodies: ClassVar[bool] = True
    target: ClassVar[Target] = "torque"
    coefficients = (Coefficient("share", "1"),)

    def possible(self, values: Array) -> bool:
        """A motor that pushes the way it is told to."""
        return bool(values[0] > -1)

    def columns(self, scene: RecordedMotion, parameters: Array) -> Array:
        """The load at the motor."""
        return scene.on(self.axis, scene.load[:, self.axis - 1] / scene.gear_ratio[self.axis - 1])
