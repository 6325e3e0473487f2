"""From conditioned motions to what is to be explained: torque, deflection and tracking error of the examined
joints.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise

import numpy as np

from identify.core.arrays import Array, Mask
from identify.core.errors import InputError
from identify.explain.effects.base import Target
from identify.explain.recorded_motion import (
    AS_STATED,
    RecordedMotion,
    StatedUncertainty,
    load_side,
    of_drives,
    through_gears,
)
from identify.explain.regression import Fit, RegressionProblem
from identify.measured.conditioning import ConditionedMotion, slow_part
from identify.robot.description import Robot
from identify.robot.inverse_dynamics import RigidArm

UNITS: dict[Target, str] = {"torque": "N m", "deflection": "rad", "tracking": "rad"}


@dataclass(frozen=True)
class Known:
    """What is known before anything is explained: gear ratio and rotor inertia (joints,), kg m^2 at the
    motor.

    joints: numbers (from 1) of the joints to explain; slow: rad/s up to which a joint stands; payload: link
    and place (m) of its centre; relative: positions count from where each record began.
    """

    robot: Robot
    gear_ratio: Array
    rotor_inertia: Array
    joints: tuple[int, ...]
    slow: float
    payload: tuple[str, tuple[float, float, float]]
    relative: bool = False
    stated: StatedUncertainty = AS_STATED
    coupling: Array | None = None
    """How far each drive turns with each joint (drives, joints), where not each with its own alone."""
    by_links: bool = True
    """Whether links move as they were recorded, where they were; else as their motors."""


def scene_of(motion: ConditionedMotion, known: Known, latency: Array | None = None) -> RecordedMotion:
    """A motion with the torques that its rigid links need; InputError where a joint was not recorded.

    latency (joints,), s: how much later link-side positions were read than the motors'.
    """
    for what, values in (("motor_position", motion.position), ("motor speed", motion.velocity)):
        if not np.isfinite(values).all():
            joint = int(np.argmin(np.isfinite(values).all(axis=0))) + 1
            fix = "the rigid bodies need the motion of all joints"
            raise InputError(
                f"record {motion.name}", f"no {what} of joint {joint}", "one of every joint", fix
            )
    recorded = known.by_links and motion.link_position is not None
    links = load_side(motion if recorded else replace(motion, link_position=None), latency)
    arm = RigidArm(known.robot, links.position, links.velocity, links.acceleration)
    return RecordedMotion(
        time_s=motion.time_s,
        position=of_drives(motion.position, known.coupling),
        velocity=of_drives(motion.velocity, known.coupling),
        acceleration=of_drives(motion.acceleration, known.coupling),
        load=through_gears(arm.torque, known.coupling),
        motor_torque=motion.torque,
        error=_error(motion, known.coupling),
        stated=known.stated,
        coupling=known.coupling,
        arm=arm,
        axes=known.joints,
        gear_ratio=known.gear_ratio,
        slow=known.slow,
        relative=known.relative,
        payload=known.payload,
        starts=motion.starts,
        names=motion.names or (motion.name,),
        turning=None if motion.turning is None else of_drives(motion.turning, known.coupling),
        stated_rotors=known.rotor_inertia,
        links=links if recorded else None,
    )


def _error(motion: ConditionedMotion, coupling: Array | None) -> Array | None:
    """Command minus motor position from its own mean, as command and encoder may count from different
    zeros.
    """
    if motion.command_position is None:
        return None
    error = of_drives(motion.command_position - motion.position, coupling)
    for start, end in pairwise((*motion.starts, len(error))):
        error[start:end] -= error[start:end][motion.inside[start:end]].mean(axis=0)
    return np.asarray(error)


def torque_problem(motion: ConditionedMotion, scene: RecordedMotion, known: Known) -> RegressionProblem:
    """Measured motor torque less that of the known rigid links and rotors; samples at which a joint stands do
    not count.

    A standing joint's friction may be anything up to the torque that breaks it loose, so such samples say
    nothing about it.
    """
    rows = [joint - 1 for joint in known.joints]
    rotor = known.gear_ratio * known.rotor_inertia * scene.acceleration
    left = motion.torque - through_gears(scene.arm.torque, known.coupling) / known.gear_ratio - rotor
    return RegressionProblem(
        motion.name,
        scene,
        _finite(left[:, rows], known.joints, motion, "motor torque"),
        _moving(motion, scene),
        datum="none",
    )


def deflection_problem(motion: ConditionedMotion, scene: RecordedMotion, known: Known) -> RegressionProblem:
    """Motor-side minus link-side position; each joint of each record has its own datum, as encoders have.

    Samples at which a joint stands do not count: it keeps the hysteresis and the wave at which it stopped,
    many times over.
    """
    if motion.link_position is None:
        raise ValueError("no link-side position")
    rows = [joint - 1 for joint in known.joints]
    link = motion.link_position
    if scene.links is not None:
        link = np.where(np.isfinite(link), scene.links.read_late, np.nan)
    bent = of_drives(motion.position - link, known.coupling)
    left = _finite(bent[:, rows], known.joints, motion, "link_position")
    slow, moving = slow_part_of(motion, scene), _moving(motion, scene)
    return RegressionProblem(motion.name, scene, left, moving, datum="constant", slow_part=slow)


def tracking_problem(motion: ConditionedMotion, scene: RecordedMotion, known: Known) -> RegressionProblem:
    """Command minus motor position; each joint of each record has a datum of its own, and the line that an
    integrator makes of it.
    """
    if scene.error is None:
        raise ValueError("no command")
    rows = [joint - 1 for joint in known.joints]
    left = _finite(scene.error[:, rows], known.joints, motion, "command_position")
    return RegressionProblem(
        motion.name, scene, left, np.broadcast_to(motion.inside[:, None], left.shape), datum="line"
    )


def loaded(problem: RegressionProblem, fit: Fit) -> RegressionProblem:
    """The problem with the torques in the gears as the fit knows them: rigid links, and whatever else passes
    through the gears.
    """
    scene = problem.scene
    load = through_gears(scene.arm.torque, scene.coupling).copy()
    rows = [joint - 1 for joint in scene.axes]
    for effect in fit.effects:
        if effect.in_gear:
            load[:, rows] += fit.share(problem, effect) * scene.gear_ratio[rows]
    if problem.bodies is not None:
        load[:, rows] += (problem.bodies @ fit.body_errors) * scene.gear_ratio[rows]
    return replace(problem, scene=replace(scene, load=load), remembered={})


def curved(problem: RegressionProblem, fit: Fit) -> RegressionProblem:
    """A deflection without the second order of the sensors' latencies T as the fit knows them, - a T^2 / 2.

    Acceleration goes with torque, so that it would look like stiffness.  Where links were read earlier by the
    latency, that is done (`identify.explain.recorded_motion`).
    """
    if problem.scene.links is not None:
        return problem
    target, scene = problem.target.copy(), problem.scene
    for effect in fit.effects:
        if effect.kind == "sensor-latency":
            bent = scene.link_acceleration[:, effect.axis - 1] * fit.of(effect)[0] ** 2 / 2
            target += scene.of_joint(effect.axis, bent)[:, :, 0]
    return replace(problem, target=target, searched={})


def slow_part_of(motion: ConditionedMotion, scene: RecordedMotion) -> Callable[[Array], Array] | None:
    """What counts where loads are those of links: a gear that is bent by accelerations is bent by those above
    the low-pass too, of which nothing is known.
    """
    if scene.links is None:
        return None
    return partial(_slow_of_each, scene.records, motion.lowpass_hz, motion.sample_rate_hz)


def _slow_of_each(records: Sequence[slice], lowpass_hz: float, rate: float, values: Array) -> Array:
    return np.concatenate([slow_part(values[record], lowpass_hz, rate) for record in records])


def _moving(motion: ConditionedMotion, scene: RecordedMotion) -> Mask:
    """Samples (samples, examined joints) at which a drive moves, away from the ends of the record; InputError
    for one that stands at all of them.
    """
    rows = [joint - 1 for joint in scene.axes]
    moving = np.asarray((np.abs(scene.travel[:, rows]) > scene.slow) & motion.inside[:, None])
    for standing in np.flatnonzero(~np.any(moving, axis=0)):
        fix = "leave it out of `joints`, or take another record"
        found = f"joint {scene.axes[standing]} stands all the time"
        raise InputError(f"record {motion.name}", found, "motion of every joint in `joints`", fix)
    return moving


def _finite(values: Array, joints: Sequence[int], motion: ConditionedMotion, what: str) -> Array:
    missing = [joint for joint, column in zip(joints, values.T, strict=True) if not np.isfinite(column).all()]
    if missing:
        raise InputError(
            f"record {motion.name}",
            f"no {what} of joint {missing[0]}",
            "one of every joint in `joints`",
            "correct `joints`",
        )
    return values
