"""Does the promise come true?  Records of the planned motion are simulated with noise and evaluated as a
measurement would be: speed and acceleration by the low-pass of `identify fit`, least squares, intervals.

Torques are those of the engine, not of the columns that the motion was chosen by.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from identify.core.arrays import Array, Mask
from identify.core.interruption import check
from identify.core.thresholds import SIGMAS_95
from identify.excite.information import Experiment, noise_of, rotors_of, true_values
from identify.excite.series import PeriodicMotion, Series
from identify.excite.study import ExciteStudy
from identify.joints.arm_motion import weighted_least_squares
from identify.joints.intervals import in_time
from identify.measured.conditioning import condition
from identify.measured.records import MotionRecord
from identify.model.laws.gear import per_joint_turn
from identify.robot.description import Robot
from identify.robot.inverse_dynamics import RigidArm

_TRUTH = {"rad": 1e-4, "rad/(N m)": 1e-7}
"""What zeros, waves and compliances of drives are in the rehearsal of transmission errors."""


@dataclass(frozen=True)
class Rehearsal:
    """Of each parameter (p,): 1.96 standard deviations of the values found, mean error, and shares of the
    runs whose own interval, and whose promised one, hold the truth.
    """

    scatter: Array
    error: Array
    held: Array
    kept: Array


def rehearsed(
    study: ExciteStudy, robot: Robot, experiment: Experiment, series: Series, promised: Array, draws: int
) -> Rehearsal:
    """So many runs of the motion with noise, each evaluated."""
    samples = round(study.period_s * study.sample_rate_hz)
    clean = series.at(np.arange(samples * study.periods + 1) / study.sample_rate_hz)
    truth = experiment.expected
    if experiment.chosen is None:
        truth = np.array([_TRUTH[unit] for unit in experiment.units])
    signal = _signal(study, robot, experiment, clean, truth)
    rng, found, halves = np.random.default_rng([study.seed, 2]), [], []
    for _ in range(draws):
        check()
        values, half = _evaluated(study, robot, experiment, clean, signal, rng)
        found.append(values)
        halves.append(half)
    off = np.array(found) - truth
    return Rehearsal(
        SIGMAS_95 * off.std(axis=0, ddof=1),
        off.mean(axis=0),
        (np.abs(off) <= halves).mean(axis=0),
        (np.abs(off) <= promised).mean(axis=0),
    )


def _signal(
    study: ExciteStudy, robot: Robot, experiment: Experiment, clean: PeriodicMotion, truth: Array
) -> Array:
    """(samples, rows): what is recorded of the motion but for noise: torques, or deflections."""
    rows = list(experiment.rows)
    arm = RigidArm(robot, clean.position, clean.velocity, clean.acceleration)
    if experiment.chosen is None:
        return _deflections(study, experiment, clean, arm.torque, truth)
    per = len(robot.joints)
    values = dict(
        zip(experiment.chosen.names, true_values(study, robot, experiment.chosen.names), strict=True)
    )
    coulomb, viscous = (np.array([values[f"joint{row + 1}.{what}"] for row in rows]) for what in ("fc", "fv"))
    speed = clean.velocity[:, rows]
    rotors = rotors_of(study, per)[rows] * clean.acceleration[:, rows]
    return np.asarray(arm.torque[:, rows] + rotors + coulomb * np.sign(speed) + viscous * speed)


def _deflections(
    study: ExciteStudy, experiment: Experiment, clean: PeriodicMotion, load: Array, truth: Array
) -> Array:
    """Zero, wind-up and waves of each joint, written again from Nagoya Eqs. 8 to 10."""
    each, found = len(truth) // len(experiment.rows), []
    for place, row in enumerate(experiment.rows):
        zero, compliance, *waves = truth[place * each : (place + 1) * each]
        ratio = (study.drives.gear_ratio or [])[row]
        total = zero + compliance * load[:, row]
        for order, (a, b) in zip(study.drives.orders, zip(waves[::2], waves[1::2], strict=True), strict=True):
            angle = per_joint_turn(order, ratio) * clean.position[:, row]
            total = total + np.hypot(a, b) * np.cos(angle - np.arctan2(b, a))
        found.append(total)
    return np.stack(found, axis=1)


def _evaluated(
    study: ExciteStudy,
    robot: Robot,
    experiment: Experiment,
    clean: PeriodicMotion,
    signal: Array,
    rng: np.random.Generator,
) -> tuple[Array, Array]:
    """Values (p,) and half intervals of one noisy run."""
    count = len(robot.joints)
    stir = np.radians(noise_of(study.noise.position_deg, count, "noise.position_deg"))
    position = clean.position + stir * rng.normal(size=clean.position.shape)
    recorded = np.zeros_like(position)
    recorded[:, list(experiment.rows)] = signal + experiment.noise * rng.normal(size=signal.shape)
    signals = {"motor_position": position, "motor_torque": recorded}
    record = MotionRecord("rehearsal", study.sample_rate_hz, clean.time_s, signals, "rehearsal", "")
    seen = condition(record, study.lowpass_hz)
    moved = PeriodicMotion(seen.time_s, seen.position, seen.velocity, seen.acceleration)
    columns, used = experiment.columns(moved)
    used = used & seen.inside[:, None]
    target = recorded[:, list(experiment.rows)]
    if experiment.chosen is not None:
        target = target - (rotors_of(study, count) * seen.acceleration)[:, list(experiment.rows)]
    return _least_squares(columns, target, used)


def _least_squares(columns: Array, target: Array, used: Mask) -> tuple[Array, Array]:
    values, weights = weighted_least_squares(columns, target, used)
    left = np.where(used, target - columns @ values, 0.0)
    _, half = in_time(columns * weights[None, :, None], left * weights, used)
    return values, half
