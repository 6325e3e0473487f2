"""Simulated hammer tests of arms without anything hidden: the modes found beside those of the true arm, by a
second engine.
"""

from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from identify.measured.channel import Channel
from identify.measured.frf_records import FrfFileOptions
from identify.measured.frf_set import FrfSet
from identify.measured.loaders import load_frf_set
from identify.measured.modal_tables import ModalTable
from identify.modal.analysis import analyse
from identify.modal.pairing import pair
from identify.modal.settings import ModalSettings
from tests.shared import shared

pinocchio = pytest.importorskip("pinocchio")
CASES = [(case, posture) for case in ("none_101", "none_102") for posture in (1, 2, 3)]


def true_modes(case: str, posture: int) -> ModalTable:
    """Modes of M s^2 + diag(c) s + diag(k) + K_gravity, with shapes at every measured channel, in
    Pinocchio.
    """
    folder = shared("hidden", case)
    test = json.loads((folder / "test.json").read_text())
    truth = json.loads(shared("hidden", f"{case}.truth.json").read_text())
    model = pinocchio.buildModelFromUrdf(str(folder / "robot.urdf"))
    data = model.createData()
    q = np.radians(test["files"][posture - 1]["posture_deg"])
    mass = np.triu(pinocchio.crba(model, data, q))
    mass = mass + np.triu(mass, 1).T
    gravity = pinocchio.computeGeneralizedGravityDerivatives(model, data, q)
    stiffness = np.diag(truth["k"]) + (gravity + gravity.T) / 2
    upper = -np.linalg.solve(mass, stiffness), -np.linalg.solve(mass, np.diag(truth["c"]))
    poles, vectors = np.linalg.eig(np.block([[np.zeros((6, 6)), np.eye(6)], [upper[0], upper[1]]]))
    kept = np.flatnonzero(poles.imag > 0)
    kept = kept[np.argsort(np.abs(poles[kept]))]
    channels, rows = _sensors(model, data, q, folder / "points.csv")
    frequency, damping = np.abs(poles[kept]) / (2 * np.pi), -poles[kept].real / np.abs(poles[kept])
    return ModalTable(frequency, damping, channels, (rows @ vectors[:6, kept]).T)


def _sensors(model: Any, data: Any, q: np.ndarray, points: Path) -> tuple[tuple[Channel, ...], np.ndarray]:
    """Channels along the link's axes and their Jacobian rows (channels, 6)."""
    pinocchio.computeJointJacobians(model, data, q)
    pinocchio.updateFramePlacements(model, data)
    channels, rows = [], []
    for point in csv.DictReader(points.read_text().splitlines()):
        jacobian = pinocchio.computeFrameJacobian(
            model, data, q, model.getFrameId(point["link"]), pinocchio.LOCAL
        )
        offset = np.array([float(point[key]) for key in ("x_m", "y_m", "z_m")])
        for axis in range(3):
            channels.append(Channel(int(point["node"]), axis + 1))
            rows.append(jacobian[axis] + np.cross(jacobian[3:].T, offset)[:, axis])
    return tuple(channels), np.array(rows)


def measured(case: str, posture: int, windowed: bool = True) -> FrfSet:
    folder = shared("hidden", case)
    test = json.loads((folder / "test.json").read_text())
    decay = test["exponential_window_decay_per_s"] if windowed else 0.0
    path = folder / test["files"][posture - 1]["file"]
    return load_frf_set(path, FrfFileOptions(window_decay_per_s=decay, averages=test["averages"]))


@pytest.mark.parametrize(
    ("case", "posture", "estimator"),
    [
        *((*one, "plscf") for one in CASES),
        *((*one, "lsce") for one in CASES[::3]),
        *(pytest.param(*one, "lsce", marks=pytest.mark.exam) for one in CASES if one[1] != 1),
    ],
)
def test_every_mode_of_the_band_and_no_other(case: str, posture: int, estimator: str) -> None:
    data, truth = measured(case, posture), true_modes(case, posture)
    found = analyse(data, ModalSettings(estimator=estimator))
    paired = pair(truth, found.table)
    in_band = np.sum(truth.frequency_hz <= data.frequency_hz[-1])
    assert len(paired) >= in_band
    assert len(paired.unpaired_b) == 0
    assert np.max(np.abs(paired.frequency_error)) < 0.002
    assert np.max(np.abs(paired.damping_error)) < 0.03
    assert np.min(paired.mac) > 0.99
    assert found.total_error < 0.03


def test_without_the_window_correction_damping_is_wrong() -> None:
    truth = true_modes("none_101", 1)
    paired = pair(truth, analyse(measured("none_101", 1, windowed=False)).table)
    assert len(paired) == 5
    assert np.min(paired.damping_error) > 0.02
    assert np.max(paired.damping_error) > 0.1
