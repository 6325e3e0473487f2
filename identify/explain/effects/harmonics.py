"""Waves over an angle: the columns, and which order a residual shows.

Torque that waves with the motor's angle: cogging and the poles and slots of the motor, a whole number of
waves per turn.

Angular transmission error: the gear's output waves about its input, so many waves per turn of the joint
(Nagoya Eq. 9).

An encoder disc that is not centred on its shaft: an error of one wave per turn of the joint.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np
from numpy.polynomial.legendre import legfit, legval

from identify.core.arrays import Array
from identify.explain.effects.base import Coefficient, MotionEffect, NonlinearParameter, Target
from identify.explain.recorded_motion import RecordedMotion
from identify.model.laws.gear import harmonic, per_joint_turn

_ORDERS = 2
_SLOW = 12
"""Degree of the polynomial that takes out what is slow, before waves are looked for."""
_LAG = 0.01
LAG = NonlinearParameter("lag", "s", -_LAG, _LAG)
"""How much later the harmonic was read than the angle."""


def lags(count: int) -> list[float]:
    """Lags (s) to search from."""
    return [float(lag) for lag in np.linspace(-0.8 * _LAG, 0.8 * _LAG, count)]


def late(scene: RecordedMotion, joint: int, lag: float) -> Array:
    """Angle (samples,) of a joint (from 0) a lag (s) before each sample."""
    return np.asarray(scene.position[:, joint] - lag * scene.velocity[:, joint])


def cosine_and_sine(angle: Array, order: float) -> tuple[Array, Array]:
    """Cosine and sine of that order of an angle (samples,)."""
    return harmonic(angle, order)


def strongest_orders(angle: Array, residual: Array, lower: float, upper: float) -> list[float]:
    """The orders (waves per turn) whose waves explain most of a residual (samples,), strongest first; none
    for a joint that stood.

    What is slow is taken out first.
    The grid is fine against the resolution 2 pi / travel, so that a search from there stays on the same peak.
    """
    travel = float(np.ptp(angle))
    if travel == 0 or not upper > lower:
        return []
    orders = np.arange(lower, upper, 1.0 / travel)
    time = np.linspace(-1.0, 1.0, len(residual))
    centred = residual - legval(time, legfit(time, residual, _SLOW))
    # Waves of all orders are those of every so many, times those of the few between.
    between = int(np.sqrt(len(orders))) + 1
    fine = np.exp(1j * np.outer(angle, (orders - lower)[:between]))
    coarse = np.exp(1j * np.outer(orders[::between], angle)) * centred
    power = np.abs(coarse @ fine).ravel()[: len(orders)]
    found: list[float] = []
    while len(found) < _ORDERS and power.max() > 0:
        peak = int(np.argmax(power))
        found.append(float(orders[peak]))
        power[np.abs(orders - orders[peak]) < 4 * np.pi / travel] = 0.0
    return found


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
