"""`identify simulate` and `identify fit` on studies of motion: files, reports, tables, refusals."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from identify import results
from identify.motion_result import MotionResult
from identify.motion_run import run_motion_fit, run_simulation
from identify.reports.write import write_reports
from tests.motion import arms
from tests.motion.test_simulate import DC
from tests.motion.test_trajectory_fit import COULOMB, FREE, NOISE, SERVO, record


def written(folder: Path) -> Path:
    """A study with a record to fit and one to judge."""
    records = [
        record(folder, "a", 1, seconds=0.8),
        {**record(folder, "b", 2, seconds=0.8), "use": "validate", "phases_s": {"end": [0.7, 0.8]}},
    ]
    arms.study(
        folder,
        arms.one_link(0.0),
        name="small",
        motor=DC,
        gear={"ratio": FREE},
        servo=SERVO,
        noise=NOISE,
        records=records,
        candidates=[COULOMB],
    )
    return folder / "motion.yaml"


def test_a_simulation_is_kept_and_read_again(tmp_path: Path) -> None:
    result, files = run_simulation(written(tmp_path), tmp_path / "out" / "run.h5", tmp_path / "tables")
    again = results.read(files[0], MotionResult)
    assert again.verdict == result.verdict
    assert again.parameters is None
    np.testing.assert_array_equal(again.records["a"].signals["motor_position"].values, result.records["a"].signals["motor_position"].values)
    table = np.genfromtxt(files[1], delimiter=",", names=True, deletechars="")
    assert "joint1.motor_velocity_rad_s" in table.dtype.names
    np.testing.assert_allclose(
        table["joint1.motor_current_A"], result.records["a"].signals["motor_current"].values[:, 0], rtol=1e-6, atol=1e-9
    )


def test_a_fit_is_reported_on_one_page_and_on_paper(tmp_path: Path) -> None:
    result, path = run_motion_fit(written(tmp_path), tmp_path / "run.h5", {"seed": 3})
    assert result.parameters is not None
    assert result.trials is not None
    assert result.seed == 3
    assert list(result.trials.kept) == [1.0, 0.0]
    assert result.gap == pytest.approx(1.0, abs=0.2)
    page, printed = write_reports(path)
    text = page.read_text()
    assert "dry friction" in text
    assert "joint1.gear.ratio" in text
    assert "RMS difference of motor current" in text
    assert printed.read_bytes()[:5] == b"%PDF-"
    assert page.read_bytes() == write_reports(path)[0].read_bytes()


def run(*words: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, "-m", "identify", *words], check=False, capture_output=True, text=True)


def test_the_command_line_refuses_what_it_cannot_do(tmp_path: Path) -> None:
    config = written(tmp_path)
    refused = run("fit", str(config), "--resume", "--no-report")
    assert refused.returncode == 2
    assert "leave the option out" in refused.stderr
    data = json.loads(config.read_text())
    config.write_text(json.dumps({**data, "gaer": 1, "friction": {"coulomb": "much"}}))
    wrong = run("simulate", str(config), "--no-report")
    assert wrong.returncode == 2
    assert "did you mean `gear`" in wrong.stderr
    assert "friction.coulomb" in wrong.stderr
