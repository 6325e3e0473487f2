"""The study that a discovery writes has a name of its own, so that its fit replaces nothing."""

from __future__ import annotations

from pathlib import Path

import pytest

from identify.discovery.new_config import config_text
from identify.vibration.study import read_study

STUDY = """schema: identify/1   # a comment that stays
{name}robot: {{urdf: robot.urdf}}
measurements: [{{file: a.uff, posture_deg: [0]}}]
"""


@pytest.mark.parametrize(
    ("name", "new"),
    [
        ("arm", "arm_discovered"),
        ("arm_discovered", "arm_discovered2"),
        ("arm_discovered2", "arm_discovered3"),
    ],
)
def test_it_is_named_after_the_study(tmp_path: Path, name: str, new: str) -> None:
    (tmp_path / "study.yaml").write_text(STUDY.format(name=f"name: {name}\n"))
    assert _named(tmp_path) == new


def test_a_study_without_a_name_gets_one(tmp_path: Path) -> None:
    (tmp_path / "study.yaml").write_text(STUDY.format(name=""))
    assert _named(tmp_path) == "study_discovered"


def _named(folder: Path) -> str:
    text = config_text(read_study(folder / "study.yaml"), [], {}, folder)
    assert "# a comment that stays" in text
    (folder / "new.yaml").write_text(text)
    return read_study(folder / "new.yaml").study.name
