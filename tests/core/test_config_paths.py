"""Paths of a measurement mean the same files from another folder, one or several."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from identify.core.config_paths import relocate_measurement


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
    relocate_measurement(one, tmp_path / "studies", tmp_path / "reports")
    assert one == {"file": moved, "repeats": ["../studies/again.uff"], "posture_deg": [0.0]}
