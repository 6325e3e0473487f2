"""A wrist motor that turns with two joints: its friction found where stated, asked for where not."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from identify.core.errors import InputError
from identify.joints.study import JointFile, bench_of, read_joint_study
from identify.results.joints import CurveResult
from identify.robot.coupling import checked_coupling
from identify.robot.read import read_robot
from tests.motion.hidden_drive import PAYLOAD_KG, RATIO, ZERO_DEG, Hidden, move, study

COUPLING = np.eye(5)
COUPLING[4, 3] = 0.9
"""Motor 5 turns 0.9 times with joint 4."""
COULOMB, VISCOUS, ROTOR = 6.0, 4.0, 3e-4 * RATIO[4] ** 2


def _records(folder: Path, share: float) -> Path:
    """A run of the arm whose motor 5 turns `share` times with joint 4, torques at the joints."""
    coupling = np.eye(5)
    coupling[4, 3] = share
    motion = move(61, 5, PAYLOAD_KG, 16.0)
    speed, acceleration = motion.v @ coupling.T, motion.a @ coupling.T
    drive = np.zeros_like(speed)
    drive[:, 4] = COULOMB * np.sign(speed[:, 4]) + VISCOUS * speed[:, 4] + ROTOR * acceleration[:, 4]
    own = 2.0 * np.sign(motion.v) + 3.0 * motion.v
    torque = motion.rigid + own + drive @ coupling
    torque += np.random.default_rng(2).normal(scale=0.3, size=torque.shape)
    names, columns = ["time_s"], [motion.time]
    for joint in range(5):
        names += [f"position{joint + 1}", f"torque{joint + 1}"]
        columns += [np.degrees(motion.q[:, joint]) - ZERO_DEG[joint], torque[:, joint]]
    np.savetxt(
        folder / "run.csv", np.column_stack(columns), delimiter=",", header=",".join(names), comments=""
    )
    study(folder, 5, Hidden())  # for the robot's description
    config = folder / "joints.yaml"
    config.write_text(
        f"schema: identify-joints/1\nrobot: {{dh: robot.yaml}}\ngear_ratio: {RATIO.tolist()}\n"
        f"joint_zero_deg: {ZERO_DEG.tolist()}\nstationary_below_deg_per_s: 0.5\n"
        "signals:\n  motor_position: {at: 'position{joint}', unit: deg}\n"
        "  motor_torque: {at: 'torque{joint}', unit: N m}\n"
        "curves: [{kind: base-parameters, files: [run.csv], joints: [3, 4, 5]}]\n"
    )
    return config


def _found(config: Path, coupling: Any = None) -> CurveResult:
    text = config.read_text()
    if coupling is not None:
        text += f"coupling: {np.asarray(coupling).tolist()}\n"
    path = config.with_name("used.yaml")
    path.write_text(text)
    file: JointFile = read_joint_study(path)
    return file.study.curves[0].identify(bench_of(file))


def _values(found: CurveResult) -> dict[str, tuple[float, float, float]]:
    v = found.values
    return {name: (v.value[n], v.low_95[n], v.high_95[n]) for n, name in enumerate(v.name)}


def test_a_stated_coupling_gives_the_friction_of_joints_and_of_the_motor(tmp_path: Path) -> None:
    found = _found(_records(tmp_path, 0.9), COUPLING)
    values = _values(found)
    for name, truth in (
        ("motor5.fc", COULOMB),
        ("motor5.fv", VISCOUS),
        ("motor5.ia", ROTOR),
        ("joint5.fc", 2.0),
        ("joint4.fc", 2.0),
    ):
        value, low, high = values[name]
        slack = 0.3 * (high - low) + 0.02 * truth
        assert low - slack < truth < high + slack, (name, value, low, high)
        assert high - low < 0.8 * truth
    assert not [note for note in found.notes if "coupling" in note]


def test_a_coupling_that_is_not_stated_is_asked_for(tmp_path: Path) -> None:
    """Without it the friction of joint 4 is far off; the note names motor, joint and sense."""
    found = _found(_records(tmp_path, 0.9))
    assert abs(_values(found)["joint4.fc"][0] - 2.0) > 1.0
    asked = [note for note in found.notes if "state `coupling`" in note]
    assert len(asked) == 1
    assert "motor 5 also turns +1 times with joint 4" in asked[0]


def test_a_wrist_without_coupling_is_not_asked_for_one(tmp_path: Path) -> None:
    found = _found(_records(tmp_path, 0.0))
    assert not [note for note in found.notes if "coupling" in note]


@pytest.mark.parametrize(
    ("matrix", "said"),
    [
        ([[1, 0], [0, 1]], "5 rows of 5"),
        (np.diag([1, 1, 1, 1, -1]).tolist(), "ones on the diagonal"),
        ((np.eye(5) + np.eye(5, k=1) * 0 + np.ones((5, 5)) - np.eye(5)).tolist(), "without an inverse"),
    ],
)
def test_couplings_that_cannot_be(tmp_path: Path, matrix: list[list[float]], said: str) -> None:
    _records(tmp_path, 0.0)
    from identify.robot.settings import RobotSettings

    robot = read_robot(RobotSettings(dh=Path("robot.yaml")), tmp_path)
    with pytest.raises(InputError, match=said):
        checked_coupling(matrix, robot)
