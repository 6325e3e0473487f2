"""A recorded motion as motion effects see it: positions, velocities, accelerations, and the torque that the
gears carry.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from identify.core.arrays import Array
from identify.robot.inverse_dynamics import RigidArm


@dataclass(frozen=True)
class RecordedMotion:
    """One record, or several in a row.  Arrays over all joints of the robot are (samples, joints), in rad,
    rad/s, rad/s^2, N m at the joint.

    axes: numbers (from 1) of the examined joints; gear_ratio (joints,): motor turns per joint turn; load:
    torque that each gear passes on to the links as far as it is known; motor_torque: as measured, at the
    motor; error: command minus motor position, or None; slow: the speed (rad/s) up to which a joint counts as
    standing.
    """

    time_s: Array
    position: Array
    velocity: Array
    acceleration: Array
    load: Array
    motor_torque: Array
    error: Array | None
    arm: RigidArm
    axes: tuple[int, ...]
    gear_ratio: Array
    slow: float
    relative: bool
    """Whether positions count from where the record began, so that phases of waves differ from record to
    record.
    """
    payload: tuple[str, tuple[float, float, float]]
    """Link that carries the payload and the place (m) of the payload's centre in its frame."""
    starts: tuple[int, ...] = (0,)
    """First sample of each record."""
    cache: dict[object, Array] = field(default_factory=dict, repr=False, compare=False)

    @property
    def records(self) -> list[slice]:
        """The samples of each record."""
        return [slice(*ends) for ends in pairwise((*self.starts, len(self.time_s)))]

    def on(self, axis: int, *values: Array) -> Array:
        """(samples, examined joints, columns) that are zero but on one joint; values (samples,) each."""
        found = np.zeros((len(self.time_s), len(self.axes), len(values)))
        found[:, self.axes.index(axis), :] = np.stack(values, axis=1)
        return found

    def on_all(self, *torques: Array) -> Array:
        """(samples, examined joints, columns) at the motors out of torques (samples, joints) at the
        joints.
        """
        rows = [axis - 1 for axis in self.axes]
        return np.stack([torque[:, rows] / self.gear_ratio[rows] for torque in torques], axis=2)

    def direction(self, axis: int) -> Array:
        """Direction of travel (samples,), -1 to 1, smooth where the joint hardly moves."""
        return np.asarray(np.tanh(2 * self.velocity[:, axis - 1] / self.slow))
