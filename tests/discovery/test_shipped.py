"""The study that is shipped with two effects hidden in its data finds both, with their true values, and
nothing else.
"""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from identify.discovery.run import run_discover
from identify.fitting.selection.workbench import Story

ROOT = Path(__file__).parents[2]


@pytest.mark.exam
def test_the_shipped_study_finds_what_is_hidden_in_it(tmp_path: Path) -> None:
    truth = json.loads((ROOT / "data" / "hidden_effects" / "truth.json").read_text())
    result, _ = run_discover(
        ROOT / "configs" / "hidden_effects.yaml", tmp_path / "found.h5", {}, Story(), workers=1
    )
    assert sorted(result.added.sentence) == [
        "tilt compliance of joint 2 (rx, ry)",
        "time delay of all responses",
    ]
    assert result.before.gap > 5
    assert result.after.gap < 1.2
    assert result.after.gap_validation < 1.4
    values = dict(zip(result.after.parameters.name, result.after.parameters.value, strict=True))
    tilt, delay = truth["effects"]
    assert sorted(values[f"joint2.{axis}.stiffness"] for axis in ("rx", "ry")) == pytest.approx(
        sorted(tilt["stiffness"]), rel=0.03
    )
    assert values["responses.delay"] == pytest.approx(delay["seconds"], abs=2e-5)
    for number, stiffness in enumerate(truth["k"], start=1):
        assert values[f"joint{number}.rz.stiffness"] == pytest.approx(stiffness, rel=0.03)
