"""Play of a joint: backlash goes with the sign of the torque in the gear, lost motion with the direction of
travel.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

import numpy as np

from identify.core.arrays import Array
from identify.explain.effects.base import Coefficient, MotionEffect, Target
from identify.explain.effects.joint_stiffness import DampedCompliance
from identify.explain.recorded_motion import RecordedMotion

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
