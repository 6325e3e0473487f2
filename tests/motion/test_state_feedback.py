"""Feedback of twist: its poles where they are to be, and the Nagoya study's records under it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from identify.core.errors import InputError
from identify.motion.problem import load_motion
from identify.motion.state_feedback import TwoInertias
from identify.motion.study import read_motion_study
from tests.motion.test_nagoya import ROOT, gap, study

DRIVE, LINK, SPRING, DAMPER = 300.0, 700.0, 3.0e6, 2500.0
GAINS = {"position_gain": 12.0, "velocity_gain": 12000.0, "velocity_integral": 4.0}
START = ("initial: [2.0e+6, 2.0e+6]", "initial: [3.0e+6, 1.2e+6]")
NOTCHED = "kind: two-degree-of-freedom"
NOTCH = "  notch_width: 0.3\n  notch_depth: 0.3\n"


def _poles(stiffness: float, damping: float) -> np.ndarray:
    """Of drive, spring, link and cascade: the motor's turn and velocity, the link's, and the integral."""
    v = GAINS["velocity_gain"]
    servo = [-v * GAINS["position_gain"], -v, 0.0, 0.0, v * GAINS["velocity_integral"]]
    spring = np.array([SPRING, DAMPER, -SPRING, -DAMPER, 0.0])
    fed_back = np.array([stiffness, damping, -stiffness, -damping, 0.0])
    return np.linalg.eigvals(
        [
            [0, 1, 0, 0, 0],
            (servo - spring - fed_back) / DRIVE,
            [0, 0, 0, 1, 0],
            spring / LINK,
            [-GAINS["position_gain"], -1, 0, 0, 0],
        ]
    )


@pytest.mark.parametrize("ratio", [0.3, 0.7])
def test_the_poles_are_where_they_are_to_be(ratio: float) -> None:
    joint = TwoInertias(
        *(np.array([value, value]) for value in (DRIVE, LINK)), np.array([SPRING, 0.0]), DAMPER
    )
    gains = {name: np.array(value) for name, value in GAINS.items()}
    stiffness, damping = joint.placed(ratio, gains)
    wanted = np.sqrt(SPRING / LINK) * (-ratio + 1j * np.sqrt(1 - ratio**2))
    assert np.abs(_poles(stiffness[0], damping[0]) - wanted).min() < 1e-6 * abs(wanted)
    assert np.abs(_poles(0.0, 0.0) - wanted).min() > 0.3 * abs(wanted)
    assert [stiffness[1], damping[1]] == [0.0, 0.0], "a rigid joint has no twist"


def test_state_feedback_is_that_of_the_generator(tmp_path: Path) -> None:
    """And not that of poles elsewhere."""
    gains = ("velocity_gain: [24000, 8000]", "velocity_gain: [12000, 4000]")
    kind, named = (NOTCHED, "kind: state-feedback"), ("notched2", "feedback1")

    def seen(rest: str) -> float:
        changes = (START, gains, named, kind, (NOTCH, rest))
        return gap(*study("nagoya_two_link_control", tmp_path, *changes), "feedback1")

    assert seen("") < 1.5
    assert seen("  pole_damping: 0.7\n") > 5.0


def test_state_feedback_of_rigid_joints_is_refused(tmp_path: Path) -> None:
    text = (ROOT / "configs" / "nagoya_two_link_control.yaml").read_text()
    gear, rest = text.split("  cubic_stiffness")[0], text[text.index("friction:") :]
    text = (
        (gear + rest)
        .replace("axes: [rz]", "axes: [ry]")
        .replace(NOTCH, "")
        .replace("../data", f"{ROOT}/data")
    )
    config = tmp_path / "config.yaml"
    config.write_text(text)
    load_motion(read_motion_study(config))
    config.write_text(text.replace(NOTCHED, "kind: state-feedback"))
    with pytest.raises(InputError, match="state-feedback, and no joint that is elastic about rz"):
        load_motion(read_motion_study(config))
