"""Start values on other scales."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from identify.vibration.problem import load_problem
from identify.vibration.scales import scaled_drives
from identify.vibration.study import read_study

STUDY = Path(__file__).parents[2] / "configs" / "arm_hammer_test.yaml"


def test_all_drives_are_stiffer_or_softer_and_may_fall_along_the_arm() -> None:
    problem = load_problem(read_study(STUDY))
    names = [p.name for p in problem.parameters]
    starts = np.array(scaled_drives(problem)) / problem.initial
    stiff = starts[:, [names.index(f"joint{n}.rz.stiffness") for n in range(1, 7)]]
    assert [1.0] * 6 in np.round(stiff, 12).tolist(), "as they were"
    assert stiff.max() == pytest.approx(np.exp(4.0)), "20 times, and 2.7 times more at one end"
    assert stiff.min() == pytest.approx(np.exp(-4.0))
    falls = np.log(stiff[:, 0] / stiff[:, 5])
    assert sorted(set(np.round(falls, 9))) == [-2.0, 0.0, 2.0]
    damping = starts[:, [names.index(f"joint{n}.rz.damping") for n in range(1, 7)]]
    assert damping == pytest.approx(np.sqrt(stiff))
