"""Batches of fits: killed workers, broken inputs, interruption and resumption, on data from closed forms
written in the tests.
"""

from __future__ import annotations

import json
import signal
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from identify.__main__ import main
from identify.batch.loop import BatchIndex
from identify.batch.run import run_batch
from identify.cli import app
from identify.core.errors import InputError, InputErrors
from identify.reports.batch import tables as batch_tables
from identify.results import file as result_file
from identify.results import fit as results
from identify.results.batch import BatchResult
from tests.batch import planar
from tests.batch.conftest import Opener, always, in_this_process, kill_one

POSTURES, KILLS = 4, 2


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a batch of a few postures of an arm whose joint 2 gets stiffer with joint 3."""
    folder = tmp_path_factory.mktemp("batch")
    planar.write_study(folder, planar.postures(POSTURES), planar.with_posture)
    planar.write_batch(folder, ["joint: true"])
    return folder


@pytest.fixture(scope="module")
def undisturbed(study: Path) -> BatchResult:
    """The batch, fitted in peace in this process."""
    seen: list[dict[str, int]] = []
    with in_this_process():
        result, written = run_batch(
            study / "batch.yaml",
            study / "calm.h5",
            progress=lambda index: seen.append(_read(index.path)["counts"]),
        )
    assert written[0] == study / "calm.h5"
    done = [counts["done"] for counts in seen]
    assert done == sorted(done), "the index can be read while the batch runs"
    return result


def _read(path: Path) -> dict[str, dict[str, int]]:
    return dict(json.loads(path.read_text()))


def test_it_finds_that_a_stiffness_depends_on_posture(undisturbed: BatchResult) -> None:
    d = undisturbed.dependence
    assert [name for name, depends in zip(d.parameter, d.depends, strict=True) if depends] == [
        "joint2.rz.stiffness"
    ]
    row = d.parameter.index("joint2.rz.stiffness")
    assert d.trend_joint[row] == 3
    assert d.slope_per_rad[row] == pytest.approx(0.15, abs=0.02)
    assert "an effect is missing from the model" in undisturbed.notes[0]
    assert any("one set of parameters does not describe" in note for note in undisturbed.notes)
    truth = np.array([planar.with_posture(np.deg2rad(q))[1] for q in undisturbed.jobs.posture_deg])
    column = undisturbed.parameters.name.index("joint2.rz.stiffness")
    away = np.log(undisturbed.parameters.value[:, column] / truth) / undisturbed.parameters.std[:, column]
    assert np.abs(away).max() < 4
    assert undisturbed.jobs.gap == pytest.approx(np.ones(POSTURES), abs=0.15)


def test_results_and_summary_are_files_that_reports_read(undisturbed: BatchResult, study: Path) -> None:
    kept = result_file.read(study / "calm.h5", BatchResult)
    assert kept.verdict == undisturbed.verdict
    assert np.array_equal(kept.parameters.value, undisturbed.parameters.value)
    for row, name in enumerate(kept.jobs.name):
        one = result_file.read(study / "calm" / f"{name}.h5", results.FitResult)
        assert np.array_equal(one.parameters.value, kept.parameters.value[row])
        assert one.measurements[name].modes.frequency_hz == pytest.approx(kept.modes.frequency_hz[row])
    assert kept.joint_file == "joint.h5"
    assert len(batch_tables.job_table(kept).rows) == POSTURES


def test_killed_workers_lose_nothing(opener: Opener, undisturbed: BatchResult, study: Path) -> None:
    """Workers are killed while the batch runs, each time one more fit has ended; every result is whole and
    equal to the undisturbed one.
    """
    rng, kills = np.random.default_rng(4), []
    with opener() as executor, always(executor):
        out = study / f"killed_{executor.about.split()[0]}.h5"

        def kill(index: BatchIndex) -> None:
            if sum(kills) < KILLS and index.counts()["done"] >= sum(kills):
                kills.append(kill_one(executor, rng))

        result, written = run_batch(study / "batch.yaml", out, progress=kill)
    assert sum(kills) >= 2
    assert result.jobs.state == ("done",) * POSTURES, result.jobs.error
    for table in ("parameters", "modes", "dependence"):
        assert _equal(getattr(undisturbed, table), getattr(result, table)), table
    assert _read(written[1])["counts"] == {"waiting": 0, "running": 0, "done": POSTURES + 1, "failed": 0}
    for name in _read(written[1])["jobs"]:
        one = result_file.read(out.with_suffix("") / f"{name}.h5", results.FitResult)
        calm = result_file.read(study / "calm" / f"{name}.h5", results.FitResult)
        assert np.array_equal(one.parameters.std, calm.parameters.std, equal_nan=True)
        assert np.array_equal(one.history[:, :4], calm.history[:, :4])
    assert not list(written[1].parent.glob(".*")), "nothing half-written is left"


def _equal(one: object, other: object) -> bool:
    """Whether two tables are the same, number by number."""
    pairs = [(value, getattr(other, name)) for name, value in vars(one).items()]
    return all(
        np.array_equal(a, b, equal_nan=getattr(a, "dtype", np.dtype(bool)).kind == "f") for a, b in pairs
    )


def test_broken_inputs_are_told_and_the_rest_is_fitted(at_once: None, tmp_path: Path) -> None:
    """A third of the inputs are broken, each in its own way."""
    folder = tmp_path / "broken"
    planar.write_study(folder, planar.postures(12, seed=5)[:8])
    (folder / "p2.csv").unlink()
    (folder / "p4.csv").write_bytes(b"\x00\xff not a table")
    text = (folder / "p6.csv").read_text()
    (folder / "p6.csv").write_text(text[: len(text) // 2].rsplit(",", 1)[0])
    table = (folder / "postures.csv").read_text().splitlines()
    table[8] = table[8].rsplit(",", 1)[0] + ","
    (folder / "postures.csv").write_text("\n".join(table))
    lines = ["measurements:", "  - {file: p1.csv, name: typo, posture_deg: [1, 2, 3], outputz: [1]}"]
    config = planar.write_batch(folder, lines)
    out = tmp_path / "out.h5"
    done = CliRunner().invoke(app, ["batch", str(config), "--out", str(out), "--no-report"])
    assert done.exit_code == 4, done.output
    assert "Failed fits" in done.output
    result = result_file.read(out, BatchResult)
    state = dict(zip(result.jobs.name, result.jobs.state, strict=True))
    assert [name for name, s in state.items() if s == "failed"] == ["typo", "p2", "p4", "p6", "p8"]
    assert [name for name, s in state.items() if s == "done"] == ["p1", "p3", "p5", "p7"]
    said = dict(zip(result.jobs.name, result.jobs.error, strict=True))
    for name, part in (
        ("typo", "did you mean `outputs`"),
        ("p2", "p2.csv"),
        ("p4", "p4.csv"),
        ("p6", "p6.csv"),
        ("p8", "2 angles; expected 3"),
    ):
        assert part in said[name], said[name]
    assert result.jobs.attempts[0] == 2
    failures = batch_tables.failure_table(result)
    assert failures is not None and len(failures.rows) == 5


def test_an_interrupted_batch_goes_on_and_computes_nothing_twice(
    study: Path,
    undisturbed: BatchResult,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """Ctrl-C as soon as two fits have ended, while a worker is at the third."""
    out = tmp_path / "stop.h5"
    changed = BatchIndex.changed

    def interrupted(index: BatchIndex) -> None:
        changed(index)
        if index.counts()["done"] == 2:
            signal.raise_signal(signal.SIGINT)

    with monkeypatch.context() as patch:
        patch.setattr(BatchIndex, "changed", interrupted)
        words = ["batch", str(study / "batch.yaml"), "--out", str(out), "--workers", "1", "--no-report", "-q"]
        patch.setattr(sys, "argv", ["identify", *words])
        with pytest.raises(SystemExit) as done:
            main()
    assert done.value.code == 130
    assert capsys.readouterr().err.endswith("interrupted; resume with `--resume`\n")
    assert not out.exists()
    index = out.with_suffix("") / "index.json"
    jobs: dict[str, Any] = _read(index)["jobs"]
    kept = {
        name: (out.with_suffix("") / f"{name}.h5").stat().st_mtime_ns
        for name, job in jobs.items()
        if job["state"] == "done"
    }
    assert len(kept) == 2
    with in_this_process():
        resumed, _ = run_batch(study / "batch.yaml", out, resume=True)
    assert (
        f"{len(set(kept) - {'joint'})} {'was' if 'joint' in kept else 'were'} kept from before"
        in resumed.verdict[0]
    )
    for name, changed in kept.items():
        assert (out.with_suffix("") / f"{name}.h5").stat().st_mtime_ns == changed, "nothing is computed twice"
    assert np.array_equal(resumed.parameters.value, undisturbed.parameters.value)


def test_a_changed_input_is_fitted_again(at_once: None, tmp_path: Path) -> None:
    planar.write_study(tmp_path, planar.postures(2))
    config = planar.write_batch(tmp_path)
    run_batch(config, tmp_path / "out.h5")
    (tmp_path / "p2.csv").write_text(
        planar.frf_csv(planar.postures(2)[1], planar.constant, np.random.default_rng(99))
    )
    again, _ = run_batch(config, tmp_path / "out.h5", resume=True)
    assert "1 was kept" in again.verdict[0]


def test_all_failed_is_an_error(at_once: None, tmp_path: Path) -> None:
    planar.write_study(tmp_path, planar.postures(2))
    config = planar.write_batch(tmp_path)
    for name in ("p1.csv", "p2.csv"):
        (tmp_path / name).unlink()
    with pytest.raises(InputError, match=r"none of the 2 fits completed; p1: .*p1\.csv"):
        run_batch(config, tmp_path / "out.h5")


def test_a_wrong_base_study_is_told_at_once(tmp_path: Path) -> None:
    planar.write_study(tmp_path, planar.postures(1))
    base = tmp_path / "study.yaml"
    base.write_text(base.read_text().replace("starts:", "stars:"))
    with pytest.raises(InputErrors, match="did you mean `starts`"):
        run_batch(planar.write_batch(tmp_path), tmp_path / "out.h5")
