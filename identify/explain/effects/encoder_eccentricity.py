"""An encoder disc that is not centred on its shaft: an error of one wave per turn of the joint."""

from __future__ import annotations

from typing import ClassVar

from identify.core.arrays import Array
from identify.explain.effects.base import Coefficient, MotionEffect, Target
from identify.explain.effects.harmonics import cosine_and_sine
from identify.explain.recorded_motion import RecordedMotion


class EncoderEccentricity(MotionEffect):
    """The first harmonic of the joint; the offset of the encoders takes its mean."""

    kind: ClassVar[str] = "encoder-eccentricity"
    target: ClassVar[Target] = "deflection"
    coefficients = (Coefficient("cosine", "rad"), Coefficient("sine", "rad"))

    def sentence(self) -> str:
        """What this instance is."""
        return f"eccentric link-side encoder of joint {self.axis} (one wave per turn)"

    def columns(self, scene: RecordedMotion, parameters: Array) -> Array:
        """Cosine and sine of the joint angle."""
        return scene.of_joint(self.axis, *cosine_and_sine(scene.joint_position[:, self.axis - 1], 1.0))
