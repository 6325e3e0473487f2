"""Paths of a measurement mean the same files from another folder, one or several."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from identify.core.config_paths import relocate
from identify.vibration.study import MeasurementSettings, Study


@pytest.mark.parametrize(
    ("file", "moved"),
    [
        ("p1.uff", "../studies/p1.uff"),
        ("p1/*.csv", "../studies/p1/*.csv"),
        (["a.uff", "/data/b.uff"], ["../studies/a.uff", "/data/b.uff"]),
    ],
)
def test_a_measurement_moves(file: Any, moved: Any, tmp_path: Path) -> None:
    one = {"file": file, "repeats": ["again.uff"], "posture_deg": [0.0]}
    relocate(MeasurementSettings, one, tmp_path / "studies", tmp_path / "reports")
    assert one == {"file": moved, "repeats": ["../studies/again.uff"], "posture_deg": [0.0]}


def test_every_path_of_a_study_moves_and_what_several_keys_share_once(tmp_path: Path) -> None:
    shared = {"file": "a.uff", "modes": "a.yaml"}
    data = {
        "name": "arm.urdf",
        "robot": {"urdf": "arm.urdf"},
        "reference": "published.csv",
        "registration": {"pairs": "pairs.csv", "length_unit": "mm"},
        "like": {"result": "other.h5"},
        "measurements": [shared, shared],
    }
    relocate(Study, data, tmp_path / "studies", tmp_path / "reports")
    there = {"file": "../studies/a.uff", "modes": "../studies/a.yaml"}
    assert data == {
        "name": "arm.urdf",
        "robot": {"urdf": "../studies/arm.urdf"},
        "reference": "../studies/published.csv",
        "registration": {"pairs": "../studies/pairs.csv", "length_unit": "mm"},
        "like": {"result": "../studies/other.h5"},
        "measurements": [there, there],
    }
