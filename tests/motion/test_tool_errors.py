"""What a tracker's axes and the zeros of drives may be off by is not taken for an effect."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from identify.motion.judging import judging
from identify.motion.missing.noise import with_noise
from identify.motion.problem import MotionProblem, load_motion
from identify.motion.study import read_motion_study
from identify.motion.tool_errors import ToolErrors
from identify.robot.engine_motion import MovingArm
from tests.generator import hidden_motion
from tests.motion import arms


def test_errors_and_noise_of_a_tool_are_white_together(tmp_path: Path) -> None:
    """Over draws of the errors, what is compared has the variance of the noise in every direction."""
    problem = arms.study(tmp_path, arms.three_links())
    rng, tool, std, noise = np.random.default_rng(4), ("fore", np.array([0.3, 0.0, 0.0])), 1e-3, 1e-4
    angles = np.cumsum(rng.normal(size=(40, 3)), axis=0) / 10
    rigid = MovingArm(problem.robot)
    seen = rigid.frame_position(angles, *tool)
    seen[7] = np.nan
    errors = ToolErrors.of(rigid, angles, tool, seen, std)
    draws, moved = 4000, np.array([rigid.frame_motion(row, *tool)[2][:3] for row in angles])
    turned = np.cross(rng.normal(scale=std, size=(draws, 1, 3)), np.nan_to_num(seen))
    zeros = np.einsum("sij,dj->dsi", moved, rng.normal(scale=std, size=(draws, 3)))
    both = turned + zeros + rng.normal(scale=noise, size=(draws, 40, 3))
    left = errors.beyond(both + np.array([3.0, -2.0, 0.1]), noise)
    assert np.isnan(left[:, 7]).all() and np.isfinite(left[:, 8]).all()
    rows = left[:, errors.known].reshape(draws, -1) / noise
    spread = np.linalg.eigvalsh(rows.T @ rows / draws)
    assert spread[:3] == pytest.approx(np.zeros(3), abs=1e-9)  # the mean is not compared
    assert spread[3] > 0.6 and spread[-1] < 1.4
    before = (both[:, errors.known] - both[:, errors.known].mean(axis=1, keepdims=True)).reshape(draws, -1)
    assert np.linalg.eigvalsh(before.T @ before / draws)[-1] / noise**2 > 100


def test_a_tracker_that_stands_askew_leaves_no_gap(tmp_path: Path) -> None:
    """By a third of a milliradian; by far more than its axes are known to, it does."""
    rng = np.random.default_rng(3)
    case = hidden_motion.drawn(rng, "", False)
    case.tracker, case.heavier = True, np.zeros(2)
    hidden_motion.write(case, tmp_path, rng, ["one"])
    problem = with_noise(load_motion(read_motion_study(tmp_path / "motion.yaml")))[0]

    def gap(turn: float) -> float:
        turned = []
        for record in problem.records:
            assert record.tool is not None
            axis = np.cross([turn, -turn, turn], record.tool)
            turned.append(replace(record, tool=record.tool + axis))
        askew: MotionProblem = replace(problem, records=tuple(turned))
        return float(judging(askew).costs(askew.initial[None])[0])

    assert gap(3e-4) < 1.02 * gap(0.0)
    assert gap(3e-2) > 1.5 * gap(0.0)
