"""The study that a discovery writes has a name of its own, so that its fit replaces nothing; and what is
said of the time."""

from __future__ import annotations

from pathlib import Path

import pytest

from identify.discovery.loop import with_likelihood
from identify.discovery.new_config import config_text
from identify.discovery.run import spent
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


def test_the_likelihood_it_was_found_by_takes_the_place_of_a_cost_and_what_was_chosen_for_that(
    tmp_path: Path,
) -> None:
    old = "cost: frf-area\noptimizer: {kind: genetic-algorithm}\ntarget_cost: 0.1\n"
    (tmp_path / "study.yaml").write_text(STUDY.format(name="") + old)
    file, _ = with_likelihood(read_study(tmp_path / "study.yaml"))
    (tmp_path / "new.yaml").write_text(config_text(file, [], {}, tmp_path))
    new = read_study(tmp_path / "new.yaml").study
    assert (new.cost.kind, new.optimizer, new.target_cost) == ("frf-least-squares", [], 0.0)


def _named(folder: Path) -> str:
    text = config_text(read_study(folder / "study.yaml"), [], {}, folder)
    assert "# a comment that stays" in text
    (folder / "new.yaml").write_text(text)
    return read_study(folder / "new.yaml").study.name


def test_the_time_is_told_longest_first_and_adds_up() -> None:
    """What no phase was is told as such; phases without a name are part of it."""
    said = spent({"places": 2.0, "reading": 0.5, "thorough refits": 7.0, "": 1.0}, 12.0)
    parts = "thorough refits 7.0 s, all else 2.5 s, places 2.0 s, reading 0.5 s"
    assert said == f"Time: 12.0 s: {parts}."
