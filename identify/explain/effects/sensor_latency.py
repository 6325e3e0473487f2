"""The link-side encoder is read later than the motor-side one: a moving joint looks deflected by speed times
latency.
"""

from __future__ import annotations

from typing import ClassVar

from identify.core.arrays import Array
from identify.explain.effects.base import Coefficient, MotionEffect, Target
from identify.explain.recorded_motion import RecordedMotion


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
