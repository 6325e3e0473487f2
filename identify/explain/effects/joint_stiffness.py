"""The gear as a spring: compliance, and compliance that falls with load (Nagoya Eq. 8: torque = k1 d + k3
d^3).
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from identify.core.arrays import Array
from identify.explain.effects.base import Coefficient, MotionEffect, NonlinearParameter, Target
from identify.explain.recorded_motion import RecordedMotion


class JointCompliance(MotionEffect):
    """The motor side leads the link side by torque over stiffness."""

    kind: ClassVar[str] = "joint-compliance"
    positive: ClassVar[bool] = True
    target: ClassVar[Target] = "deflection"
    coefficients = (Coefficient("compliance", "rad/(N m)"),)

    def sentence(self) -> str:
        """What this instance is."""
        return f"compliance of joint {self.axis}: deflection in proportion to torque"

    def reading(self, values: Array) -> str:
        """Stiffness."""
        return f"stiffness {1 / values[0]:.4g} N m/rad"

    def columns(self, scene: RecordedMotion, parameters: Array) -> Array:
        """The torque in the gear."""
        return scene.on(self.axis, scene.load[:, self.axis - 1])


class HardeningStiffness(MotionEffect):
    """A spring that hardens: torque = d / c + k3 d^3, with c the compliance at no load and `torque` where k3
    has doubled its stiffness.
    """

    kind: ClassVar[str] = "hardening-stiffness"
    positive: ClassVar[bool] = True
    target: ClassVar[Target] = "deflection"
    coefficients = (Coefficient("compliance at no load", "rad/(N m)"),)
    replaces: ClassVar[str] = "joint-compliance"

    def sentence(self) -> str:
        """What this instance is."""
        return f"stiffness of joint {self.axis} that hardens with load (cubic)"

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
