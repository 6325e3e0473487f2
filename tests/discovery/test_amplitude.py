"""The gap that any torque at a joint would leave: of noise alone it is 1, however many torques are free."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from identify.discovery import amplitude
from identify.discovery.amplitude import torque_gaps
from identify.vibration.costs.target import FrfTarget
from identify.vibration.problem import load_problem
from identify.vibration.study import read_study
from tests.arms import initial
from tests.targets import targets

CONFIG = Path(__file__).parents[2] / "configs" / "arm_hammer_test.yaml"


def _noisy(folder: Path, outputs: list[int]) -> tuple[FrfTarget, np.ndarray]:
    data, parameters = targets(folder, noise=0.02)
    frf = data.frf[0]
    assert frf.noise is not None
    thin = frf.data.pairs(outputs, [0, 1, 2])
    return replace(frf, data=thin, noise=frf.noise[:, outputs], out=frf.out[outputs]), initial(parameters)


def test_of_noise_alone_the_gap_is_one_although_a_torque_explains_a_part(tmp_path: Path) -> None:
    """Three responses to each force, one of whose three degrees of freedom any torque takes."""
    target, values = _noisy(tmp_path, [0, 4, 8])
    gaps = torque_gaps([target], values)
    assert set(gaps) == {f"joint{n}.rz" for n in range(1, 7)}
    assert list(gaps.values()) == pytest.approx([1.0] * 6, abs=0.1)


def test_a_torque_at_a_joint_is_found_there(tmp_path: Path) -> None:
    """A change of one joint's stiffness is a torque at it: nothing of the gap is left there, and much
    elsewhere.
    """
    target, values = _noisy(tmp_path, list(range(9)))
    noise, whole = target.data.frf - target.predict(values), replace(target, record=None)
    changed = values.copy()
    changed[4] *= 1.3
    data = replace(target.data, frf=whole.predict(changed) + noise)
    gaps = torque_gaps([replace(whole, data=data)], values)
    assert gaps.pop("joint3.rz") == pytest.approx(1.0, abs=0.1)
    assert min(gaps.values()) > 1.5


@pytest.mark.parametrize(
    ("levels", "gap", "left", "place"),
    [
        (2.1, 2.9, {"joint1.rz": 2.7, "joint2.rz": 1.1, "joint3.rz": 1.9}, "joint2.rz"),
        (1.0, 2.9, {"joint1.rz": 2.7, "joint2.rz": 1.1, "joint3.rz": 1.9}, ""),
        (2.1, 2.9, {"joint1.rz": 2.7, "joint2.rz": 1.1, "joint3.rz": 1.3}, ""),
        (2.1, 2.9, {"joint1.rz": 2.7, "joint2.rz": 1.6, "joint3.rz": 2.6}, ""),
        (2.1, 1.05, {"joint1.rz": 1.05, "joint2.rz": 1.0, "joint3.rz": 1.05}, ""),
    ],
)
def test_what_depends_on_amplitude_is_placed_where_one_joint_alone_explains_it(
    monkeypatch: pytest.MonkeyPatch, levels: float, gap: float, left: dict[str, float], place: str
) -> None:
    """Not where levels agree, where the next joint does nearly as well, where much is left, or at noise."""
    problem = load_problem(read_study(CONFIG))
    monkeypatch.setattr(amplitude, "level_gap", lambda problem: levels)
    monkeypatch.setattr(amplitude, "torque_gaps", lambda targets, values: left)
    assert amplitude.acting_at(problem, gap) == place
