"""Forces that act at once: the model predicts their joint response, with exact derivatives."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.targets import targets

PHASORS = (1.0 + 0j, -1j, 0j)


def test_the_joint_response_stands_in_the_first_column(tmp_path: Path) -> None:
    each, parameters = targets(tmp_path)
    apart = each.frf[0]
    at_once = replace(apart, data=replace(apart.data, simultaneous_inputs=PHASORS))
    values = np.array([parameter.initial for parameter in parameters]) * np.linspace(
        0.8, 1.2, len(parameters)
    )
    h, mixed = apart.predict(values), at_once.predict(values)
    assert mixed[..., 0] == pytest.approx(h[..., 0] - 1j * h[..., 1], rel=1e-12)
    assert mixed[..., 1:] == pytest.approx(h[..., 1:])
    free = np.arange(len(parameters))
    slopes, together = apart.gradient(values, free)[1], at_once.gradient(values, free)
    assert together[0] == pytest.approx(mixed, rel=1e-9, abs=1e-14)
    assert together[1][:, :, 0] == pytest.approx(slopes[:, :, 0] - 1j * slopes[:, :, 1], rel=1e-12)
