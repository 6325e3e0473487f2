"""The arms of the published studies at their true numbers, against records of the independent generator
(Pinocchio, Runge-Kutta).
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from identify.motion.changed import with_numbers
from identify.motion.command import Command
from identify.motion.problem import MotionProblem, load_motion
from identify.motion.recording import PreparedRecord
from identify.motion.study import read_motion_study
from identify.motion.trajectory import TrajectoryObjective

Array = NDArray[np.float64]
ROOT = Path(__file__).parents[2]
KEYS = {
    "motor.viscous": "viscous_motor_n_m_s_rad",
    "gear.ratio": "gear_ratio",
    "servo.position_gain": "position_gain_v_rad",
    "servo.derivative_gain": "derivative_gain_v_s_rad",
    "servo.integral_gain": "integral_gain_v_rad_s",
    "friction.coulomb": "coulomb_n_m",
    "friction.creep_velocity": "creep_velocity_rad_s",
    "rz.stiffness": "stiffness_n_m_rad",
    "rz.damping": "damping_n_m_s_rad",
    "gear.cubic_stiffness": "cubic_n_m_rad3",
    "gear.transmission_error.0.amplitude": "te_amplitude_rad",
    "gear.transmission_error.0.phase": "te_phase_rad",
    "friction.viscous": "viscous_n_m_s_rad",
    "friction.stribeck": "stribeck_n_m",
    "friction.stribeck_velocity": "stribeck_velocity_rad_s",
}


def at_truth(name: str) -> tuple[MotionProblem, Array]:
    """The study with all candidate effects, and the true values of its parameters."""
    problem = load_motion(read_motion_study(ROOT / "configs" / f"{name}.yaml"))
    free = {
        key: number
        for candidate in problem.file.study.candidates
        for key, number in candidate.numbers.items()
    }
    problem = with_numbers(problem, free, {})
    return problem, truth_of(problem, name)


def truth_of(problem: MotionProblem, name: str) -> Array:
    """The true values of the problem's parameters."""
    truth = json.loads((ROOT / "data" / name / "truth.json").read_text())
    names = [p.name.split(".", 1) for p in problem.parameters]
    return np.array([truth[KEYS[key]][int(joint[5:]) - 1] for joint, key in names])


def beginning(record: PreparedRecord, seconds: float, period_s: float) -> PreparedRecord:
    """The first seconds of a record."""
    ticks, command, measured = round(seconds / period_s) + 1, record.command, record.measured
    assert measured is not None
    inside = measured.time_s < seconds + period_s / 2
    signals = {quantity: rows[inside] for quantity, rows in measured.signals.items()}
    return replace(
        record,
        command=Command(command.position[:ticks], command.velocity[:ticks], command.acceleration[:ticks]),
        torque=record.torque[:ticks],
        measured=replace(measured, time_s=measured.time_s[inside], signals=signals),
    )


def gaps(problem: MotionProblem, values: Sequence[Array], records: Sequence[str], seconds: float) -> Array:
    """Of values side by side, each (parameters,), on the first seconds of records."""
    period = problem.file.study.servo.period_s
    chosen = [beginning(r, seconds, period) for r in problem.records if r.settings.name in records]
    return TrajectoryObjective(problem, chosen, problem.file.study.noise).costs(np.array(values))


def test_kawasaki_is_explained_by_its_truth_and_not_without_coulomb_friction() -> None:
    problem, values = at_truth("kawasaki_rs010l")
    records = ("pos1_q2", "pos2_q1", "pos2_q3")
    dry = np.array(["coulomb" in p.name for p in problem.parameters])
    true, without = gaps(problem, [values, np.where(dry, 0.1, values)], records, 5.0)
    assert true < 1.3
    assert without > 2.5


@pytest.mark.parametrize("record", ["slow1", "slow2"])
def test_elastic_joints_of_nagoya_are_explained_by_their_truth(record: str) -> None:
    """Hardening, transmission error and friction; without the transmission error the link angles are many
    times the noise off.
    """
    problem, values = at_truth("nagoya_two_link")
    ripple = np.array(["amplitude" in p.name for p in problem.parameters])
    true, without = gaps(problem, [values, np.where(ripple, 1e-6, values)], [record], 2.0)
    assert true < 2.2
    assert without > 4.0
