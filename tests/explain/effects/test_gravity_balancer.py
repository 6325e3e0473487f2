"""The balancer by virtual work: its torque is the force along the cylinder times the change of its length."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from identify.explain.effects.rigid_body import BalancerPreload, GravityBalancer
from tests.explain.moved import RATIO, moved


@pytest.mark.parametrize("stiffness", [0.0, 4e3])
def test_pull_of_a_cylinder_between_two_anchors(stiffness: float) -> None:
    """Anchors 0.2 m and 0.6 m from the axis, force 5 kN at 0.5 m; torque = F dL/dq at the motor."""
    one = moved()
    scene = replace(
        one,
        position=np.repeat(one.position, 2, axis=1),
        axes=(2,),
        gear_ratio=np.full(2, RATIO),
        load=np.repeat(one.load, 2, axis=1),
    )
    angle, offset, far, near = scene.position[:, 1], 0.4, 0.6, 0.2

    def length(q: np.ndarray) -> np.ndarray:
        anchor = near * np.stack([np.cos(q - offset), np.sin(q - offset)], axis=1)
        return np.asarray(np.linalg.norm(anchor - [far, 0.0], axis=1))

    arm = (length(angle + 1e-6) - length(angle - 1e-6)) / 2e-6
    torque = (5e3 + stiffness * (length(angle) - 0.5)) * arm / RATIO
    spring = GravityBalancer(2).columns(scene, np.zeros(0))[:, 0]
    preload = BalancerPreload(2).columns(scene, np.array([offset, near / far]))[:, 0]
    columns = np.column_stack([spring, preload])
    found = np.linalg.lstsq(columns, torque, rcond=None)[0]
    assert np.abs(columns @ found - torque).max() < 1e-6 * np.abs(torque).max()
    assert np.hypot(*found[:2]) == pytest.approx(stiffness * near * far, abs=1e-4 * 4e3)
    assert found[2] == pytest.approx((5e3 - stiffness * 0.5) * near, rel=1e-6)
