"""A fitted motion compensated for the reports' tests: one record with a recorded torque and position, and one
of validation.
"""

from __future__ import annotations

import dataclasses

import numpy as np

from identify.results.file import LAYOUT
from identify.results.motion import MotionResult, RecordResult, Trace, TrajectoryComparison, TrialTable
from tests.reports.sample import frf_result

_JOINTS = ("joint1", "joint2")


def motion_result() -> MotionResult:
    """Two joints, two trials, of which one stayed."""
    fitted = frf_result(10, 2)
    return MotionResult(
        layout=LAYOUT,
        kind="motion",
        key="made up",
        name="made_up_motion",
        seed=3,
        verdict=(
            "The motion was simulated.",
            "The residual is 1.04 times the noise.",
            "Friction explains the most.",
        ),
        notes=("the record <b> is short",),
        effects=("Coulomb friction of all joints",),
        joints=_JOINTS,
        step_s=0.001,
        period_s=0.01,
        seconds=3.5,
        realtime_factor=12.0,
        gap=1.04,
        gap_validation=1.11,
        converged=True,
        parameters=fitted.parameters,
        correlation=fitted.correlation,
        starts=fitted.starts,
        history=fitted.history,
        trials=TrialTable(
            ("none", "coulomb-friction", "hardening"),
            np.array([0.0, 1.0, 1.0]),
            np.array([5.0, 1.04, 4.9]),
            np.array([5.1, 1.11, 5.2]),
            np.array([1.0, 1.0, 0.0]),
        ),
        records={name: _record(name, use) for name, use in (("a", "fit"), ("b", "validate"))},
        provenance=dataclasses.replace(fitted.provenance, config="name: made_up_motion\n"),
    )


def _record(name: str, use: str) -> RecordResult:
    t = np.linspace(0, 2, 201)
    position = np.stack([0.5 * np.sin(2 * np.pi * t), 0.2 * np.cos(2 * np.pi * t)], axis=1)
    torque = np.stack([40 * np.cos(2 * np.pi * t), 15 * np.sin(4 * np.pi * t)], axis=1)
    return RecordResult(
        name=name,
        use=use,
        file=f"{name}.csv",
        sha256="ab" * 32,
        start_deg=np.array([0.0, 11.5]),
        time_s=t,
        signals={
            "command_position": Trace("rad", 1.01 * position),
            "motor_position": Trace("rad", position),
            "link_position": Trace("rad", 1.001 * position),
            "command_velocity": Trace("rad/s", np.gradient(position, t, axis=0)),
            "motor_velocity": Trace("rad/s", np.gradient(position, t, axis=0)),
            "motor_torque": Trace("N m", torque),
        },
        comparisons={"motor_torque": _compared(t, torque)},
        phases=("whole record", "acceleration"),
        phase_s=np.array([[0.0, 2.0], [0.0, 0.5]]),
        gap=1.04,
    )


def _compared(t: np.ndarray, torque: np.ndarray) -> TrajectoryComparison:
    measured = torque + np.random.default_rng(2).normal(0, 0.5, torque.shape)
    return TrajectoryComparison(
        unit="N m",
        time_s=t,
        measured=measured,
        initial=1.2 * torque,
        simulated=torque,
        noise=0.5,
        rms=np.full((2, 2), 0.52),
        rms_initial=np.full((2, 2), 3.1),
    )
