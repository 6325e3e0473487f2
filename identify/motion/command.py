"""Commands of motion: joint moves with limited velocity, acceleration and jerk, sampled at the controller's
ticks.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from pydantic import Field

from identify.core.arrays import Array
from identify.core.config import Settings


class Move(Settings):
    """One joint turns by an angle: trapezoidal velocity, smoothed to limit the jerk."""

    joint: int | str = Field(description="number (from 1) or name")
    start_s: float = Field(ge=0, description="when it begins")
    by_deg: float = Field(description="how far it turns")
    speed_deg_s: float = Field(gt=0, description="largest velocity")
    acceleration_deg_s2: float = Field(gt=0, description="largest acceleration")
    smoothing_s: float = Field(
        0.0, ge=0, description="time over which acceleration builds up (moving average of the velocity)"
    )

    @property
    def duration_s(self) -> float:
        """From beginning to standstill."""
        distance, speed = abs(self.by_deg), self.speed_deg_s
        ramp = min(speed / self.acceleration_deg_s2, np.sqrt(distance / self.acceleration_deg_s2))
        return (
            float(distance / (self.acceleration_deg_s2 * ramp) + ramp + self.smoothing_s) if distance else 0.0
        )

    def angle(self, time: Array) -> Array:
        """How far it has turned, rad, at times (n,), s."""
        since = time - self.start_s
        if self.smoothing_s == 0:
            return np.radians(self._powers(since, 2))
        # The mean of the unsmoothed angle over the last smoothing_s, from its integral in closed form.
        area = self._powers(since, 3) - self._powers(since - self.smoothing_s, 3)
        return np.asarray(np.radians(area / self.smoothing_s))

    def _corners(self) -> tuple[float, float, float]:
        """Acceleration, its time and the whole time, unsmoothed, for a positive turn."""
        ramp = min(
            self.speed_deg_s / self.acceleration_deg_s2, np.sqrt(abs(self.by_deg) / self.acceleration_deg_s2)
        )
        return self.acceleration_deg_s2, float(ramp), self.duration_s - self.smoothing_s

    def _powers(self, since: Array, power: int) -> Array:
        """The velocity's corners, integrated: a (t-t0)^n / n! with its sign at each corner."""
        acceleration, ramp, whole = self._corners()
        total = np.zeros_like(since)
        for sign, corner in ((1, 0.0), (-1, ramp), (-1, whole - ramp), (1, whole)):
            total += sign * np.maximum(since - corner, 0.0) ** power / (2 if power == 2 else 6)
        return np.asarray(np.sign(self.by_deg) * acceleration * total)


@dataclass(frozen=True)
class Command:
    """A command at the controller's ticks, (ticks, joints) each: rad, rad/s, rad/s^2."""

    position: Array
    velocity: Array
    acceleration: Array


def tabulated(position: Array, period_s: float) -> Command:
    """A command from its positions (ticks, joints); velocity and acceleration are central differences."""
    velocity = np.gradient(position, period_s, axis=0)
    return Command(position, velocity, np.gradient(velocity, period_s, axis=0))


def moves_command(start: Array, moves: list[tuple[int, Move]], time: Array) -> Command:
    """From `start` (joints,), rad, the moves (joint index, move) at times (n,), which are ticks."""
    position = np.tile(start, (len(time), 1))
    for joint, move in moves:
        position[:, joint] += move.angle(time)
    return tabulated(position, float(time[1] - time[0]))
