"""`identify plan` on the fitted planar arm: information against differences, the choice against all choices,
promised intervals against refits.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import identify
from identify.cli import app
from identify.core.errors import InputError
from identify.core.yaml_input import parse_yaml
from identify.machining.mounted import mounted
from identify.machining.one_limit import limit_at
from identify.machining.tool import read_tool
from identify.model.modes import complex_modes
from identify.planning.candidates import Candidates
from identify.planning.design import Criterion, best_design, total
from identify.planning.information import FreeModel, TestNoise, measurable
from identify.planning.known import known_of
from identify.planning.promise import targets_of
from identify.planning.run import PlanOptions, run_plan
from identify.results import file as result_file
from identify.results.fit import FitResult
from identify.results.plan import PlanResult
from identify.vibration.fitted_model import FittedModel, fitted_model
from tests.batch import planar

FLOOR = 0.004
BAND = np.array([4.0, 64.0, 1.0])


@pytest.fixture(scope="module")
def fit(planar_fit: Path) -> Path:
    return planar_fit


@pytest.fixture(scope="module")
def model(fit: Path) -> FittedModel:
    return fitted_model(result_file.read(fit, FitResult), "fit.h5")


AMONG = Candidates(planar.postures(5, seed=4), ((1, 0), (1, 1), (2, 0), (2, 1)), (1, 2))


def _frfs(q: np.ndarray, k: np.ndarray, c: np.ndarray, hits: list[int], line_hz: np.ndarray) -> np.ndarray:
    """(lines, 4, hits), accelerance: closed form, in the order of the channels 1 and 2 along x and y."""
    _, rows = planar.channels(q)
    s = 2j * np.pi * line_hz[:, None, None]
    z = np.diag(k) + s * np.diag(c) + s**2 * planar.mass_matrix(q)
    force = rows[hits].T
    return np.asarray(
        s**2 * (rows @ np.linalg.solve(z, np.broadcast_to(force, (len(line_hz), *force.shape))))
    )


def test_information_is_that_of_differences_of_a_closed_form(model: FittedModel) -> None:
    free = np.arange(6)
    found = measurable([FreeModel(model, free, model.values)], AMONG, TestNoise(FLOOR), BAND)
    assert found.information.shape == (5, 4, 2, 6, 6)
    names = [parameter.name for parameter in model.system(model.posture).parameters]
    k_at, c_at = (
        [names.index(f"joint{n}.rz.{what}") for n in (1, 2, 3)] for what in ("stiffness", "damping")
    )
    line_hz = np.linspace(4, 64, 60)

    def stacked(values: np.ndarray) -> np.ndarray:
        h = _frfs(AMONG.postures[3], values[k_at], values[c_at], [1], line_hz)[:, 2:, 0]
        return np.concatenate([h.real.ravel(), h.imag.ravel()])

    columns = []
    for parameter in range(6):
        up, down = model.values.copy(), model.values.copy()
        up[parameter] *= 1 + 1e-5
        down[parameter] *= 1 - 1e-5
        columns.append((stacked(up) - stacked(down)) / 2e-5)
    jacobian = np.array(columns).T
    expected = jacobian.T @ jacobian / FLOOR**2 * 61 / 60
    assert found.information[3, 1, 1] == pytest.approx(expected, rel=1e-4, abs=1e-6 * expected.max())
    assert found.information[3, 1, 0] != pytest.approx(expected, rel=0.1)


@pytest.mark.parametrize("targets", [None, np.eye(6)[[4]]])
def test_the_choice_is_the_best_of_all(model: FittedModel, targets: np.ndarray | None) -> None:
    found = measurable([FreeModel(model, np.arange(6), model.values)], AMONG, TestNoise(FLOOR), BAND)
    criterion = Criterion(1e-3 * np.eye(6), targets)
    design = best_design(found.information, (2, 1, 1), criterion, np.random.default_rng(1))
    scores = {
        (q, i, s): float(
            criterion.scores(total(found.information, (np.array(q), np.array([i]), np.array([s]))))
        )
        for q in combinations(range(5), 2)
        for i in range(4)
        for s in range(2)
    }
    assert design.score == pytest.approx(max(scores.values()), rel=1e-9)
    assert design.score > np.median(list(scores.values())) + 0.1
    assert (
        scores[(tuple(design.chosen[0]), int(design.chosen[1][0]), int(design.chosen[2][0]))] == design.score
    )


def test_promised_intervals_are_those_of_refits(model: FittedModel) -> None:
    """Scatter of linear least squares about the truth over many seeds of noise."""
    every = FreeModel(model, np.arange(6), model.values)
    found = measurable([every], AMONG, TestNoise(FLOOR), np.array([4.0, 64.0, 60 / 59]))
    chosen = (np.array([0, 2]), np.array([2, 3]), np.array([0, 1]))
    promised = np.sqrt(np.diag(np.linalg.inv(total(found.information, chosen))))
    names = [parameter.name for parameter in model.system(model.posture).parameters]
    k_at, c_at = (
        [names.index(f"joint{n}.rz.{what}") for n in (1, 2, 3)] for what in ("stiffness", "damping")
    )
    line_hz = np.linspace(4, 64, 60)

    def predicted(x: np.ndarray) -> np.ndarray:
        values = model.values * np.exp(x)
        parts = [
            _frfs(AMONG.postures[q], values[k_at], values[c_at], [2, 3], line_hz).ravel() for q in (0, 2)
        ]
        h = np.concatenate(parts)
        return np.concatenate([h.real, h.imag])

    rng, zero, step = np.random.default_rng(2), np.zeros(6), 1e-5
    jacobian = np.array([(predicted(step * e) - predicted(-step * e)) / (2 * step) for e in np.eye(6)]).T
    truth = predicted(zero)
    scatter = []
    for _ in range(80):
        data = truth + FLOOR * rng.normal(size=truth.shape)
        x = zero
        for _ in range(2):
            x = x + np.linalg.lstsq(jacobian, data - predicted(x), rcond=None)[0]
        scatter.append(x)
    assert np.std(scatter, axis=0) == pytest.approx(promised, rel=0.2)


def test_the_command_writes_sheet_study_and_result(fit: Path, tmp_path: Path) -> None:
    words = ["plan", str(fit), "--postures", "2", "--impacts", "1", "--sensors", "1", "--among", "8"]
    done = CliRunner().invoke(app, [*words, "--out", str(tmp_path / "a.h5"), "--anew"])
    assert done.exit_code == 0, done.output
    assert "times narrower than those of tests of the same size at random" in " ".join(done.output.split())
    assert (tmp_path / "a.pdf").read_bytes().startswith(b"%PDF")
    page = (tmp_path / "a.html").read_text()
    assert "The test on the robot" in page
    assert "by how much the intervals would be wider" in page
    study = parse_yaml((tmp_path / "a.yaml").read_text(), "a.yaml")
    kept = result_file.read(tmp_path / "a.h5", PlanResult)
    assert [one["posture_deg"] for one in study["measurements"]] == kept.posture_deg.tolist()
    again = identify.plan(fit, postures=2, impacts=1, sensors=1, among=8, anew=True, out=tmp_path / "b.h5")
    assert np.array_equal(kept.promised.promised, again.data.promised.promised)
    assert kept.random_ratio > 1
    after = identify.plan(fit, postures=2, impacts=1, sensors=1, among=8, out=tmp_path / "c.h5")
    table = result_file.read(fit, FitResult).parameters
    half = 1.96 * table.std
    assert after.data.promised.now == pytest.approx(half, rel=0.02), (
        "with nothing new, the fit's own intervals"
    )
    assert np.all(after.data.promised.promised < after.data.promised.now)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (PlanOptions(impacts=9), r"--impacts: 9; expected from 1 to 6"),
        (PlanOptions(sensors=3), r"--sensors: 3; expected from 1 to 2"),
        (PlanOptions(noise=-1.0), "--noise: -1; expected a number above 0"),
        (PlanOptions(resolution=0.0), "--resolution: 0"),
        (PlanOptions(force_noise=float("nan")), "--force-noise: nan"),
        (PlanOptions(target=("joint9.rz.stiffness",)), "no free parameter 'joint9.rz.stiffness'"),
    ],
)
def test_a_plan_that_cannot_be_is_refused(fit: Path, tmp_path: Path, options: PlanOptions, said: str) -> None:
    with pytest.raises(InputError, match=said):
        run_plan(fit, options, tmp_path / "x.h5")
    assert not (tmp_path / "x.h5").exists()


def test_a_plan_does_not_take_the_place_of_its_study(fit: Path, tmp_path: Path) -> None:
    study = fit.parent / "study" / "study.yaml"
    before = study.read_text()
    options = PlanOptions(1, 1, 1, among=1, noise=FLOOR, resolution=1.0)
    with pytest.raises(InputError, match=r"study\.yaml: not a file for a plan: an input"):
        run_plan(study, options, study.with_suffix(".h5"))
    assert study.read_text() == before
    _, written = run_plan(study, options, tmp_path / "study.h5")
    assert written[1] == tmp_path / "study.yaml" and written[1].exists()


def test_targets_are_slopes_of_modes_and_depths(fit: Path, tmp_path: Path) -> None:
    """By differences of the model with other parameters."""
    known = known_of(fit, None, None)
    tool = read_tool(fit.with_name("tool.yaml")).study
    posture = planar.postures(3)[2]
    names = ("mode2.frequency", "mode1.damping", "depth", "joint2.rz.stiffness")
    found = targets_of(known, names, tool, posture)

    def values(model: FittedModel) -> list[float]:
        modes = complex_modes(*model.system(posture).matrices(model.values))
        on = mounted(model, tool, posture, "tool")
        return [modes.frequency_hz[1], modes.damping_ratio[0], limit_at(on, tool.spindle_rpm[1])[0]]

    assert [one.value for one in found[:3]] == pytest.approx(values(known.model), rel=1e-9)
    for number, free in enumerate(known.free):
        change = 1e-4 * np.eye(len(known.model.values))[free] * known.step[number]
        up, down = (
            np.array(values(replace(known.model, values=known.model.values + sign * change)))
            for sign in (1, -1)
        )
        slopes = [one.row[number] for one in found[:3]]
        scale = np.array([np.abs(one.row).max() for one in found[:3]])
        assert np.all(np.abs((up - down) / 2e-4 - slopes) < 0.01 * scale)
    assert np.flatnonzero(found[3].row).tolist() == [known.names.index("joint2.rz.stiffness")]


def test_a_plan_for_a_depth_beats_one_for_all_parameters(fit: Path, tmp_path: Path) -> None:
    tool = fit.with_name("tool.yaml")
    size = PlanOptions(postures=2, impacts=1, sensors=1, among=8, anew=True)
    own, _ = run_plan(fit, replace(size, target=("depth",), cutter=tool), tmp_path / "a.h5")
    assert own.promised.name[0] == "depth limit at 9,000 rpm"
    assert own.random_ratio > 1.2
    assert own.promised.random[0] / own.promised.promised[0] == pytest.approx(own.random_ratio, rel=0.3)
    every, _ = run_plan(fit, size, tmp_path / "b.h5")
    rows = [*every.promised.name]
    assert "depth limit at 9,000 rpm" not in rows
    with pytest.raises(InputError, match=r"--cutter tool\.yaml"):
        run_plan(fit, replace(size, target=("depth",)), tmp_path / "x.h5")
    with pytest.raises(InputError, match="no mode 9"):
        run_plan(fit, replace(size, target=("mode9.frequency",)), tmp_path / "x.h5")
    with pytest.raises(InputError, match="--at: 2 angles; expected 3"):
        run_plan(fit, replace(size, target=("mode1.frequency",), at_deg=(1.0, 2.0)), tmp_path / "x.h5")
