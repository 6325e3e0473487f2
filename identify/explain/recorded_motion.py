"""A recorded motion as motion effects see it: positions, velocities, accelerations, and the torque that the
gears carry.

The side of a joint that its link is on: how it moves, and how far the gear is bent.

What a gear carries is what the links behind it need, for the motion of the links.  The motor's motion is
theirs only well below a resonance and against theirs above it, so where a link-side position was recorded,
that is taken.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise

import numpy as np
import scipy

from identify.core.arrays import Array
from identify.measured.conditioning import ConditionedMotion, slow_part
from identify.robot.inverse_dynamics import RigidArm


@dataclass(frozen=True)
class StatedUncertainty:
    """Standard deviations of what is stated of each rigid body, as shares: of its mass; of its centre, of the
    distance of the centre from the link's frame; of its moments of inertia.
    """

    mass: float = 0.0
    centre: float = 0.0
    inertia: float = 0.0


AS_STATED = StatedUncertainty()
"""Bodies without any error."""


def of_drives(joints: Array, coupling: Array | None) -> Array:
    """Motion of the drives C q out of that of the joints q, (samples, joints); a coefficient of zero takes
    nothing, not even of what was not recorded.
    """
    if coupling is None:
        return joints
    parts = np.where(coupling != 0, joints[:, None, :] * coupling, 0.0)
    return np.asarray(parts.sum(axis=2))


def of_joints(drives: Array, coupling: Array | None) -> Array:
    """Motion of the joints out of that of the drives, (samples, joints)."""
    return drives if coupling is None else np.asarray(drives @ np.linalg.inv(coupling).T)


def through_gears(torque: Array, coupling: Array | None) -> Array:
    """Torques in the gears out of those at the joints, (samples, joints), both at the speed of the joints.

    Power is the same: torque . q' = gear . C q', so that gear = C^-T torque.
    """
    return torque if coupling is None else np.asarray(torque @ np.linalg.inv(coupling))


@dataclass(frozen=True)
class RecordedMotion:
    """One record, or several in a row.  Arrays over all joints of the robot are (samples, joints), in rad,
    rad/s, rad/s^2, N m at the joint.

    position, velocity, acceleration: of the drives, turns of the motor over the gear ratio, which are those
    of the joints where no motor turns with another joint; axes: numbers (from 1) of the examined joints;
    gear_ratio (joints,): motor turns per joint turn; load:
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
    names: tuple[str, ...] = ("",)
    """Of the records."""
    stated: StatedUncertainty = AS_STATED
    coupling: Array | None = None
    """How far each drive turns with each joint, (drives, joints), where not each with its own alone."""
    turning: Array | None = None
    """Speed of the drives whose sign is their direction of travel; default: velocity."""
    stated_rotors: Array | None = None
    """Inertias of the rotors (joints,), kg m^2, as far as they are known."""
    links: LoadSide | None = None
    """Motion of the links, where it was recorded."""
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
        carried = [through_gears(torque, self.coupling) for torque in torques]
        return np.stack([torque[:, rows] / self.gear_ratio[rows] for torque in carried], axis=2)

    def of_joint(self, axis: int, *values: Array) -> Array:
        """(samples, examined joints, columns) of angles (samples,) of one joint, as all drives have them that
        turn with it.
        """
        if self.coupling is None:
            return self.on(axis, *values)
        share = self.coupling[[row - 1 for row in self.axes], axis - 1]
        return np.asarray(np.stack(values, axis=1)[:, None, :] * share[None, :, None])

    @cached_property
    def joint_position(self) -> Array:
        """Angles of the joints (samples, joints), rad."""
        return of_joints(self.position, self.coupling)

    @cached_property
    def joint_velocity(self) -> Array:
        """Speeds of the joints (samples, joints), rad/s."""
        return of_joints(self.velocity, self.coupling)

    @property
    def rotor_inertia(self) -> Array:
        """Inertias of the rotors (joints,), kg m^2, zero where nothing is stated."""
        return np.zeros(len(self.gear_ratio)) if self.stated_rotors is None else self.stated_rotors

    @property
    def link_velocity(self) -> Array:
        """Speeds of the links (samples, joints), rad/s: those of the joints where no others are known."""
        return self.joint_velocity if self.links is None else self.links.velocity

    @property
    def link_acceleration(self) -> Array:
        """Accelerations of the links (samples, joints), rad/s^2."""
        if self.links is not None:
            return self.links.acceleration
        return of_joints(self.acceleration, self.coupling)

    @cached_property
    def deflection(self) -> Array | None:
        """How far each gear is bent (samples, joints), rad, slow part alone; None where it was not
        recorded.
        """
        return None if self.links is None else of_drives(self.links.deflection, self.coupling)

    @cached_property
    def deflection_rate(self) -> Array:
        """How fast each gear is bent (samples, joints), rad/s; zero where it was not recorded."""
        if self.links is None:
            return np.zeros_like(self.velocity)
        return self.velocity - of_drives(self.links.velocity, self.coupling)

    @property
    def travel(self) -> Array:
        """Speed of the drives (samples, joints), rad/s, for its sign and for whether they move."""
        return self.velocity if self.turning is None else self.turning

    def waves_travelled(self, axis: int, order: float) -> float:
        """How many of so many waves per turn of a joint it passes between its ends."""
        return float(np.ptp(self.position[:, axis - 1])) * order / (2 * np.pi)

    def direction(self, axis: int) -> Array:
        """Direction of travel (samples,), -1 to 1, smooth where the joint hardly moves."""
        return np.asarray(np.tanh(2 * self.travel[:, axis - 1] / self.slow))


@dataclass(frozen=True)
class LoadSide:
    """Position, velocity, acceleration of the links (samples, joints), rad, s: the motor's where no link-side
    position was recorded; deflection: motor less link, slow part alone, zero there; latency (joints,), s: by
    how much they were taken to be read late.
    """

    position: Array
    velocity: Array
    acceleration: Array
    deflection: Array
    latency: Array

    @property
    def read_late(self) -> Array:
        """Positions (samples, joints) as they were read, to first order in the latency: what a latency does
        beyond that, which bends the gear like a spring, is put right.
        """
        return self.position - self.latency * self.velocity


def load_side(motion: ConditionedMotion, latency: Array | None = None) -> LoadSide:
    """The load side of a conditioned motion; latency (joints,), s: how much later link-side positions were
    read than the motors'.

    Encoders count from zeros of their own, so that a link is on average where its motor is.
    """
    late = np.zeros(motion.position.shape[1]) if latency is None else latency
    histories = motion.link_position, motion.link_velocity, motion.link_acceleration
    if any(history is None for history in histories):
        still = np.zeros_like(motion.position)
        return LoadSide(motion.position, motion.velocity, motion.acceleration, still, late)
    position, velocity, acceleration = (_earlier(motion, history, late) for history in histories)
    known = np.isfinite(position).all(axis=0)
    bent = motion.position - position
    for start, end in _records(motion):
        here = slice(start, end)
        position[here] += bent[here][motion.inside[here]].mean(axis=0)
        apart = motion.position[here] - position[here]
        bent[here] = slow_part(apart, motion.lowpass_hz, motion.sample_rate_hz)
    return LoadSide(
        np.where(known, position, motion.position),
        np.where(known, velocity, motion.velocity),
        np.where(known, acceleration, motion.acceleration),
        np.where(known, bent, 0.0),
        late,
    )


def _records(motion: ConditionedMotion) -> list[tuple[int, int]]:
    return list(pairwise((*motion.starts, len(motion.time_s))))


def _earlier(motion: ConditionedMotion, history: Array | None, latency: Array) -> Array:
    """A history (samples, joints) read that much earlier, by cubic splines, held at the end of each
    record.
    """
    assert history is not None
    found = history.copy()
    for joint in np.flatnonzero(latency):
        for start, end in _records(motion):
            times = motion.time_s[start:end]
            spline = scipy.interpolate.make_interp_spline(times, history[start:end, joint], k=3)
            found[start:end, joint] = spline(np.clip(times + latency[joint], times[0], times[-1]))
    return found
