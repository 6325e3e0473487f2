"""Directions of coupled springs against their eigenvectors, and their intervals against draws."""

from __future__ import annotations

import re

import numpy as np
import pytest

from identify.vibration.notes import _sentence

STIFF, SOFT = 9000.0, 400.0


def _matrix(angle_deg: float) -> np.ndarray:
    c, s = np.cos(np.radians(angle_deg)), np.sin(np.radians(angle_deg))
    soft, stiff = np.array([c, s]), np.array([-s, c])
    full = SOFT * np.outer(soft, soft) + STIFF * np.outer(stiff, stiff)
    return np.array([full[0, 0], full[1, 1], full[0, 1]])


@pytest.mark.parametrize("angle", [-75.0, -20.0, 0.0, 33.0, 89.0])
def test_the_soft_direction_and_its_interval(angle: float) -> None:
    root = np.array([[30.0, 0.0, 0.0], [10.0, 25.0, 0.0], [5.0, -8.0, 12.0]])
    said = _sentence("joint3.rx_ry.stiffness", "N m/rad", _matrix(angle), root)
    assert said.startswith("joint3 turns most easily about a direction")
    assert said.endswith("from its x axis towards y: 400 N m/rad there, 9000 N m/rad across it.")
    told, half = map(float, re.findall(r"(-?[\d.]+)° ± ([\d.]+)°", said)[0])
    assert told == pytest.approx(angle, abs=0.06)
    drawn = _matrix(angle) + np.random.default_rng(0).normal(size=(4000, 3)) @ root.T
    full = drawn[:, [0, 2, 2, 1]].reshape(-1, 2, 2)
    soft = np.linalg.eigh(full)[1][:, :, 0]
    off = np.degrees(np.arctan2(soft[:, 1], soft[:, 0])) - angle
    off = (off + 90) % 180 - 90
    assert half == pytest.approx(1.96 * off.std(), rel=0.08)


def test_a_direction_that_is_open_is_not_told() -> None:
    said = _sentence("base.tx_ty.stiffness", "N/m", np.array([500.0, 500.1, 0.0]), 20 * np.eye(3))
    assert said.startswith("base is most compliant along a direction across its z axis that the data do not")
