"""The gap that any torque at a joint would leave: of noise alone it is 1, however many torques are free."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from identify.discovery.amplitude import torque_gaps
from identify.vibration.costs.target import FrfTarget
from tests.arms import initial
from tests.targets import targets


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
