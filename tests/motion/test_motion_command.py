"""`identify simulate` and `identify fit` on studies of motion: files, reports, tables, refusals."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from identify.core.errors import InputError
from identify.core.part_file import PartFile
from identify.fitting.fit import Progress
from identify.fitting.memory import Journal
from identify.motion.run import run_motion_fit, run_simulation
from identify.motion.trajectory import TrajectoryObjective
from identify.reports.write import write_reports
from identify.results import file as result_file
from identify.results.motion import MotionResult
from tests.motion import arms
from tests.motion.test_simulate import DC
from tests.motion.test_trajectory_fit import COULOMB, FREE, NOISE, SERVO, STAGE, record
from tests.programs import ran


def written(folder: Path, **keys: object) -> Path:
    """A study with a record to fit and one to judge."""
    records = [
        record(folder, "a", 1),
        {**record(folder, "b", 2), "use": "validate", "phases_s": {"end": [0.35, 0.4]}},
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
        **keys,
    )
    return folder / "motion.yaml"


def test_a_simulation_is_kept_and_read_again(tmp_path: Path) -> None:
    result, files = run_simulation(written(tmp_path), tmp_path / "out" / "run.h5", tmp_path / "tables")
    again = result_file.read(files[0], MotionResult)
    assert again.verdict == result.verdict
    assert again.parameters is None
    np.testing.assert_array_equal(
        again.records["a"].signals["motor_position"].values,
        result.records["a"].signals["motor_position"].values,
    )
    table = np.genfromtxt(files[1], delimiter=",", names=True, deletechars="")
    assert "joint1.motor_velocity_rad_s" in table.dtype.names
    np.testing.assert_allclose(
        table["joint1.motor_current_A"],
        result.records["a"].signals["motor_current"].values[:, 0],
        rtol=1e-6,
        atol=1e-9,
    )


def test_a_fit_is_reported_on_one_page_and_on_paper(tmp_path: Path) -> None:
    result, path = run_motion_fit(written(tmp_path, optimizer=STAGE), tmp_path / "run.h5", {"seed": 3})
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


def test_a_simulation_takes_the_numbers_of_a_fit(tmp_path: Path) -> None:
    """As typed into the study by hand, but for dry friction, which the study itself does not search for."""
    config, fitted = written(tmp_path, optimizer=STAGE), tmp_path / "fit.h5"
    result, _ = run_motion_fit(config, fitted, {})
    assert result.parameters is not None
    before, _ = run_simulation(config, tmp_path / "before.h5")
    after, _ = run_simulation(config, tmp_path / "after.h5", values=fitted)
    assert before.gap > 2 * after.gap
    again = json.loads(config.read_text())
    for name, value in zip(result.parameters.name, result.parameters.value, strict=True):
        _, section, key = name.split(".")
        if section != "friction":
            again[section][key] = float(value)
    (tmp_path / "typed.yaml").write_text(json.dumps(again))
    typed, _ = run_simulation(tmp_path / "typed.yaml", tmp_path / "typed.h5")
    assert typed.gap == pytest.approx(after.gap, rel=1e-6)
    with pytest.raises(InputError, match="no number that this study searches for"):
        run_simulation(config, tmp_path / "none.h5", values=tmp_path / "typed.h5")


def test_a_killed_fit_goes_on_where_it_was(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Killed in the middle of its trials: resumed, it ends where an undisturbed one does; finished, it is not
    run again.
    """
    gradients, residuals = [0], TrajectoryObjective.residuals

    def counted(self: TrajectoryObjective, values: NDArray[np.float64], free: NDArray[np.intp]) -> Any:
        gradients[-1] += 1
        return residuals(self, values, free)

    monkeypatch.setattr(TrajectoryObjective, "residuals", counted)
    config, out, full = written(tmp_path, optimizer=STAGE), tmp_path / "killed.h5", tmp_path / "full.h5"
    undisturbed, _ = run_motion_fit(config, full, {})
    steps = 0

    def kill(*_: object) -> None:
        nonlocal steps
        steps += 1
        if steps == len(undisturbed.history) + 3:  # three steps into the trial of dry friction
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_motion_fit(config, out, {}, Progress(show=kill))
    assert not out.exists()
    part = PartFile.read(tmp_path / "killed.h5.part")
    assert part is not None
    saved = len(part.records)
    assert saved > 0
    with pytest.raises(InputError, match="another config, data or version"):
        run_motion_fit(config, out, {"seed": 9}, resume=True)
    journal = Journal()
    gradients.append(0)
    resumed, _ = run_motion_fit(config, out, {}, Progress(journal=journal), resume=True)
    assert journal.replayed == saved
    assert gradients[1] < 0.7 * gradients[0] / 2  # two runs before it, the second of them killed
    assert undisturbed.parameters is not None
    assert resumed.parameters is not None
    np.testing.assert_array_equal(resumed.parameters.value, undisturbed.parameters.value)
    np.testing.assert_array_equal(resumed.parameters.std, undisturbed.parameters.std)
    assert resumed.trials is not None
    assert undisturbed.trials is not None
    np.testing.assert_array_equal(resumed.trials.gap, undisturbed.trials.gap)
    again, _ = run_motion_fit(config, full, {}, Progress(show=refuse), resume=True)
    assert again.provenance.written == undisturbed.provenance.written


def refuse(*_: object) -> None:
    raise AssertionError("a finished run is not run again")


def test_the_command_line_refuses_what_it_cannot_do(tmp_path: Path) -> None:
    config = written(tmp_path)
    refused = ran("fit", str(config), "--profile", "joint1.gear.ratio", "--no-report", cwd=tmp_path)
    assert refused.returncode == 2
    assert "leave the option out" in refused.stderr
    data = json.loads(config.read_text())
    config.write_text(json.dumps({**data, "gaer": 1, "friction": {"coulomb": "much"}}))
    wrong = ran("simulate", str(config), "--no-report", cwd=tmp_path)
    assert wrong.returncode == 2
    assert "did you mean `gear`" in wrong.stderr
    assert "friction.coulomb" in wrong.stderr
