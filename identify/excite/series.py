"""Periodic motion as Fourier series that begin and end at rest, always within limits of joints.

    q_j(t) = c_j + s_j sum_k [a_jk sin(k w t) - b_jk cos(k w t)] / (k w),   w = 2 pi / period

(Swevers, Ganseman, Tuekel, De Schutter and Van Brussel, IEEE T-RA 13-5, 1997).  Speed and acceleration are
zero at t = 0 where sum_k a_jk = 0 and sum_k k b_jk = 0, on which coefficients are projected.  Of each joint
the shape is free, the size s_j a share of the largest that keeps angle, speed and acceleration, and the
centre c_j somewhere in the room that is then left: no combination of numbers leaves the limits.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from identify.core.arrays import Array
from identify.excite.limits import Limits

_FINE, _BETWEEN = 100, 5e-4
"""Samples per fastest harmonic at which a motion is held to its limits, and how much it gains between
them.
"""
_LEAST = 0.1
"""Least share of the largest size."""


@dataclass(frozen=True)
class PeriodicMotion:
    """Angles, speeds, accelerations (samples, joints), rad, s, at times (samples,) of one period."""

    time_s: Array
    position: Array
    velocity: Array
    acceleration: Array


@dataclass(frozen=True)
class Series:
    """sine, cosine (harmonics, joints): coefficients of the angle, rad; centre (joints,)."""

    period_s: float
    centre: Array
    sine: Array
    cosine: Array

    def at(self, time_s: Array) -> PeriodicMotion:
        """The motion at times (samples,)."""
        turns = 2 * np.pi / self.period_s * np.arange(1, len(self.sine) + 1)
        waves = time_s[:, None] * turns
        sine, cosine = np.sin(waves), np.cos(waves)
        position = self.centre + sine @ self.sine + cosine @ self.cosine
        velocity = (cosine * turns) @ self.sine - (sine * turns) @ self.cosine
        acceleration = -(sine * turns**2) @ self.sine - (cosine * turns**2) @ self.cosine
        return PeriodicMotion(time_s, position, velocity, acceleration)

    def sampled(self, samples: int) -> PeriodicMotion:
        """At evenly spaced times of one period."""
        return self.at(np.arange(samples) * self.period_s / samples)

    def towards(self, posture: Array, share: float) -> Series:
        """The same motion shrunk about a posture (joints,) to a share."""
        centre = posture + share * (self.centre - posture)
        return Series(self.period_s, centre, share * self.sine, share * self.cosine)


def count_of(limits: Limits, harmonics: int) -> int:
    """How many free numbers describe a motion."""
    return len(limits.moving) * (2 * harmonics + 2)


def series_of(free: Array, limits: Limits, period_s: float, harmonics: int) -> Series:
    """The motion that free numbers (`count_of`,) of any size stand for."""
    parts = free.reshape(len(limits.moving), 2 * harmonics + 2)
    order = np.arange(1.0, harmonics + 1)
    a = parts[:, :harmonics] - parts[:, :harmonics].mean(axis=1, keepdims=True)
    b = parts[:, harmonics : 2 * harmonics]
    b = b - np.outer(b @ order, order) / (order @ order)
    turns = 2 * np.pi / period_s * order
    size, room = (1 / (1 + np.exp(-np.clip(parts[:, -2:], -30, 30)))).T
    centre = limits.posture.copy()
    sine, cosine = np.zeros((2, harmonics, len(centre)))
    sine[:, limits.moving], cosine[:, limits.moving] = (a / turns).T, -(b / turns).T
    shape = Series(period_s, np.zeros_like(centre), sine, cosine).sampled(_FINE * harmonics)
    low, high = shape.position.min(axis=0), shape.position.max(axis=0)
    low, high = low - _BETWEEN * (high - low), high + _BETWEEN * (high - low)
    for n, joint in enumerate(limits.moving):
        most = min(
            (limits.high[joint] - limits.low[joint]) / (high[joint] - low[joint]),
            limits.speed[joint] / np.abs(shape.velocity[:, joint]).max(),
            limits.acceleration[joint] / np.abs(shape.acceleration[:, joint]).max(),
        ) / (1 + _BETWEEN)
        scale = most * (_LEAST + (1 - _LEAST) * size[n])
        sine[:, joint] *= scale
        cosine[:, joint] *= scale
        first = limits.low[joint] - scale * low[joint]
        last = limits.high[joint] - scale * high[joint]
        centre[joint] = first + room[n] * (last - first)
    return Series(period_s, centre, sine, cosine)
