"""Angular transmission error: the gear's output waves about its input, so many waves per turn of the joint
(Nagoya Eq. 9).

An encoder disc that is not centred on its shaft: an error of one wave per turn of the joint.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np

from identify.core.arrays import Array
from identify.explain.effects.base import Coefficient, MotionEffect, NonlinearParameter, Target
from identify.explain.effects.harmonics import LAG, cosine_and_sine, lags, late, strongest_orders
from identify.explain.recorded_motion import RecordedMotion
from identify.model.laws.gear import per_joint_turn

_LEAST, _MOST = 0.5, 4.2
"""Orders that are searched, as waves per turn of the motor: half a turn to four; slower waves look like
anything else that is slow.
"""
WAVES = 3


@dataclass(frozen=True)
class AngularTransmissionError(MotionEffect):
    """One harmonic of the transmission error; number tells several on one joint apart."""

    number: int = 1
    kind: ClassVar[str] = "angular-transmission-error"
    says: ClassVar[str] = "angular transmission error of the gear of joint {axis}"
    target: ClassVar[Target] = "deflection"
    harmonic: ClassVar[bool] = True
    coefficients = (Coefficient("cosine", "rad"), Coefficient("sine", "rad"))

    @classmethod
    def instances(cls, scene: RecordedMotion) -> Iterator[Self]:
        """Up to three waves on every examined joint that passes one of the shortest."""
        for axis in scene.axes:
            shortest = per_joint_turn(_MOST, float(scene.gear_ratio[axis - 1]))
            if scene.waves_travelled(axis, shortest) > 1:
                yield from (cls(axis, number) for number in range(1, WAVES + 1))

    @property
    def name(self) -> str:
        """`joint3.angular-transmission-error.1`."""
        return f"{super().name}.{self.number}"

    @property
    def needs(self) -> str:
        """The harmonic before this one."""
        return f"{super().name}.{self.number - 1}" if self.number > 1 else ""

    def reading(self, values: Array) -> str:
        """Amplitude and order."""
        return (
            f"amplitude {np.degrees(np.hypot(*values[:2])) * 3600:.3g} arcsec, {values[2]:.4g} waves per"
            " joint turn"
        )

    def parameters(self, scene: RecordedMotion) -> tuple[NonlinearParameter, ...]:
        """The order, waves per turn of the joint, of which it passes one at least, and the lag of its
        reading.
        """
        ratio = float(scene.gear_ratio[self.axis - 1])
        longest = max(per_joint_turn(_LEAST, ratio), 1 / scene.waves_travelled(self.axis, 1.0))
        return (NonlinearParameter("order", "1/turn", longest, per_joint_turn(_MOST, ratio)), LAG)

    def columns(self, scene: RecordedMotion, parameters: Array) -> Array:
        """Waves over the joint's angle."""
        return scene.on(self.axis, *cosine_and_sine(late(scene, self.axis - 1, parameters[1]), parameters[0]))

    def starts(self, scene: RecordedMotion, residual: Array) -> list[Array]:
        """The orders that the residual shows most, for several lags."""
        order = self.parameters(scene)[0]
        joint = scene.axes.index(self.axis)
        angles = {lag: late(scene, self.axis - 1, lag) for lag in lags(5)}
        return [
            np.array([found, lag])
            for lag, angle in angles.items()
            for found in strongest_orders(angle, residual[:, joint], order.lower, order.upper)
        ]


class EncoderScale(MotionEffect):
    """The encoder counts another angle per turn than is stated, which an eccentricity may be mistaken for."""

    kind: ClassVar[str] = "encoder-scale"
    says: ClassVar[str] = "scale of the link-side encoder of joint {axis}"
    target: ClassVar[Target] = "deflection"
    looked_for: ClassVar[bool] = False
    coefficients = (Coefficient("share", "1"),)

    def columns(self, scene: RecordedMotion, parameters: Array) -> Array:
        """The joint angle."""
        return scene.of_joint(self.axis, scene.joint_position[:, self.axis - 1])


class EncoderEccentricity(MotionEffect):
    """The first harmonic of the joint; the offset of the encoders takes its mean."""

    kind: ClassVar[str] = "encoder-eccentricity"
    says: ClassVar[str] = "eccentric link-side encoder of joint {axis} (one wave per turn)"
    target: ClassVar[Target] = "deflection"
    coefficients = (Coefficient("cosine", "rad"), Coefficient("sine", "rad"))

    def humbler(self, scene: RecordedMotion) -> Sequence[Sequence[MotionEffect]]:
        """A wrong scale: over a small part of a turn, one wave per turn is little but a slope."""
        return ((EncoderScale(self.axis),),)

    def columns(self, scene: RecordedMotion, parameters: Array) -> Array:
        """Cosine and sine of the joint angle."""
        return scene.of_joint(self.axis, *cosine_and_sine(scene.joint_position[:, self.axis - 1], 1.0))
