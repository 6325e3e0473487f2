"""A fit of records that begin before the impact says so; the records come from a generator in time."""

from __future__ import annotations

from pathlib import Path

from identify.vibration.run import run_fit
from tests.generator.cases import hide
from tests.generator.generate import generate
from tests.generator.makes import MAKES
from tests.generator.spec import TestSpec
from tests.hidden import config_of


def test_records_that_begin_before_the_impact_are_noticed_and_fitted(tmp_path: Path) -> None:
    arm = MAKES["compact"](5).at_points([5, 9, 12, 14])
    spec = TestSpec(
        arm=arm, seed=5, binary=True, linear=True, duration_s=0.6, window_decay_per_s=0.693, postures=2
    )
    generate(hide(spec, "none"), tmp_path / "none")
    config = config_of(tmp_path / "none", tmp_path, extra="starts: 1")
    plain, _ = run_fit(config, tmp_path / "plain.h5", {})
    [note] = [one for one in plain.notes if "pre-trigger" in one]
    assert "add `- {kind: pre-trigger}`" in note
    known = tmp_path / "known.yaml"
    known.write_text(config.read_text().replace("starts: 1", "  - kind: pre-trigger\nstarts: 1"))
    fitted, _ = run_fit(known, tmp_path / "known.h5", {})
    assert fitted.gap < plain.gap - 0.05
    assert not [one for one in fitted.notes if "pre-trigger" in one]
