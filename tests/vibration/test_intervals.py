"""Stated uncertainty under costs that are no likelihood: the intervals carry it as far as it moves their
optimum, whichever cost.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from identify.core.errors import InputError
from identify.core.parameters import Scale
from identify.fitting.fit import fit
from identify.vibration.check import STUDY, run_checks
from identify.vibration.costs.base import parse_cost
from identify.vibration.intervals import _moved, intervals
from identify.vibration.nuisances.stated import stated_uncertainty
from identify.vibration.plan import fit_plan
from identify.vibration.problem import Problem, load_problem
from identify.vibration.study import read_study
from identify.vibration.write_back import WriteBack
from tests.batch import planar

ROOT = Path(__file__).parents[2]
STIFFNESS, DAMPING, INERTIA = 2.0e5, 30.0, 2.0
WHEEL = f"""<robot name="wheel"><link name="base"/><link name="rim"><inertial><mass value="10"/>
<inertia ixx="1.1" iyy="1.2" izz="{INERTIA}" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="hub" type="revolute"><parent link="base"/><child link="rim"/><axis xyz="0 0 1"/>
<limit lower="-3" upper="3" effort="1" velocity="1"/></joint></robot>"""


def _wheel(folder: Path, more: str) -> Problem:
    """A wheel on a spring whose one mode was measured, started where it fits."""
    (folder / "wheel.urdf").write_text(WHEEL)
    circular = np.sqrt(STIFFNESS / INERTIA)
    ratio = DAMPING / (2 * np.sqrt(STIFFNESS * INERTIA))
    (folder / "modes.yaml").write_text(
        f"modes:\n  - {{frequency_hz: {circular / (2 * np.pi):.12g}, damping_percent: {100 * ratio:.12g}}}\n"
    )
    (folder / "config.yaml").write_text(
        "schema: identify/1\nrobot: {urdf: wheel.urdf}\ncost: eigenfrequency\n"
        "measurements: [{modes: modes.yaml, posture_deg: [0]}]\n"
        "effects: [{kind: joint-compliance, axes: [rz], "
        f"stiffness: {{initial: {STIFFNESS}, bounds: [1, 1.0e+9]}}, "
        f"damping: {{initial: {DAMPING}, bounds: [0.01, 1.0e+4]}}}}]\n" + more
    )
    return load_problem(read_study(folder / "config.yaml"))


def test_a_spring_is_as_uncertain_as_the_inertia_on_it(tmp_path: Path) -> None:
    """k = (2 pi f)^2 I and c = 2 zeta (2 pi f) I: both go with I, and I is known to 15 %."""
    plain = _wheel(tmp_path, "")
    exact = intervals(plain, plain.initial).std
    assert exact == pytest.approx([0.01, np.hypot(0.1, 0.005)], rel=1e-3)
    problem = _wheel(tmp_path, "uncertainty: {links: {inertia: 0.15}}\n")
    found = intervals(problem, problem.initial)
    assert found.std == pytest.approx(np.hypot(exact, 0.15), rel=1e-3)
    assert found.joint is not None
    assert found.joint.information @ found.joint.root @ found.joint.root.T == pytest.approx(
        np.eye(len(found.joint.root)), abs=1e-9
    )
    stated = stated_uncertainty(problem, found, problem.initial)
    assert stated is not None
    assert stated.parts[:, 0] == pytest.approx(0.15**2 / (exact**2 + 0.15**2), rel=1e-3)
    assert stated.spread == pytest.approx(1.0), "the data tell nothing of what was not fitted"
    assert len(stated.sentences) == 1 and "held" not in stated.sentences[0]
    told = run_checks(tmp_path / "config.yaml").findings[STUDY]
    [value] = [one.value for one in told if one.check == "stated-uncertainty"]
    assert value == pytest.approx(float(np.mean(stated.parts[:, 0])), rel=1e-3)


def test_what_was_told_stays_where_a_cost_cannot_weigh_it(tmp_path: Path) -> None:
    problem = _wheel(tmp_path, "uncertainty: {links: {inertia: 0.15}}\nstarts: 1\noptimizer: nelder-mead\n")
    found = fit(fit_plan(problem))
    assert np.all(found.values[problem.size :] == 0)
    assert found.values[: problem.size] == pytest.approx([STIFFNESS, DAMPING], rel=1e-3)
    with pytest.raises(InputError, match="eigenfrequency`, which fits no errors"):
        WriteBack(problem.file, tmp_path / "corrected")


def _planar(folder: Path, cost: str) -> Problem:
    """The planar arm, measured without noise, at the truth."""
    planar.write_study(folder, planar.postures(1))
    angles = np.rad2deg(planar.postures(1)[0]).tolist()
    kind = "modes: modes.yaml" if "eigenfrequency" in cost else "file: p1.csv, noise: {relative: 0.02}"
    text = (folder / "study.yaml").read_text()
    more = f"measurements: [{{{kind}, posture_deg: {angles}}}]\ncost: {cost}\nuncertainty:\n"
    links = "{mass: 0.05, centre_m: 0.01, inertia: 0.1}"
    more += f"  links: {links}\n  joints: {{angle_deg: 0.5}}\n  channels: {{gain: 0.02}}\n"
    modes = _modes(planar.postures(1)[0])
    (folder / "modes.yaml").write_text("modes:\n" + "".join(f"  - {one}\n" for one in modes))
    (folder / "config.yaml").write_text(text + more)
    problem = load_problem(read_study(folder / "config.yaml"))
    truth = np.stack([planar.STIFFNESS, planar.DAMPING], axis=1).ravel()
    values = dict(zip([p.name for p in problem.of_effects], truth.tolist(), strict=True))
    return replace(problem, parameters=tuple(p.at(values.get(p.name, 0.0)) for p in problem.parameters))


def _modes(q: np.ndarray) -> list[str]:
    mass, none = planar.mass_matrix(q), np.zeros((3, 3))
    state = np.block(
        [
            [none, np.eye(3)],
            [-np.linalg.solve(mass, np.hstack([np.diag(planar.STIFFNESS), np.diag(planar.DAMPING)]))],
        ]
    )
    values = np.linalg.eigvals(state)
    values = values[values.imag > 0]
    return [
        f"{{frequency_hz: {abs(v) / (2 * np.pi):.12g}, damping_percent: {-100 * v.real / abs(v):.12g}}}"
        for v in values[np.argsort(np.abs(values))]
    ]


COSTS = (
    "eigenfrequency",
    "{kind: eigenfrequency, scale: relative}",
    "frf-area",
    "{kind: frf-area, scale: log, compare: complex}",
    "{kind: normalized-response, excitation: {'2:+X': 0, '2:+Y': -90}}",
    "{kind: frf-least-squares, residual: log}",
)


@pytest.mark.parametrize("cost", COSTS)
def test_errors_move_the_optimum_of_a_cost_as_a_fit_finds(
    cost: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each error put in at a hundredth of what was stated, and the cost's own residuals minimised again."""
    monkeypatch.setattr(planar, "NOISE", 0.0)
    problem = _planar(tmp_path, cost)
    objective = problem.file.study.cost.objective(problem.targets())
    every, own = Scale(problem.parameters), Scale(problem.of_effects)
    strong = np.diag(1e12 / np.sqrt(own.prior_information()))  # beside which the bounds say nothing
    moved = _moved(objective, every, problem.initial, 6, own, strong)
    lasting = list(range(0, moved.shape[1], 3))
    assert len(lasting) >= 8
    for number in lasting:
        values = problem.initial.copy()
        values[problem.size + number] = 0.01
        for _ in range(4):
            residuals, slopes = objective.residuals(values, own.free)
            slope = own.slope(own.to_x(values[: problem.size]))
            step = np.linalg.lstsq(slopes * slope, residuals, rcond=1e-12)[0]
            values[: problem.size] = own.to_values(own.to_x(values[: problem.size]) - step)
        shift = own.to_x(values[: problem.size]) - own.to_x(problem.initial[: problem.size])
        name = problem.nuisances.entries[number].name
        size = float(np.max(np.abs(moved)))
        assert 100 * shift == pytest.approx(moved[:, number], rel=0.1, abs=0.02 * size), name
    found = intervals(problem, problem.initial)
    exact = intervals(_without(problem), problem.initial[: problem.size])
    assert np.all(found.std >= exact.std)
    assert np.max(found.std / exact.std) > 2


def _without(problem: Problem) -> Problem:
    """The same where all is as stated."""
    study = problem.file.study.model_copy(update={"uncertainty": None})
    bare = load_problem(problem.file.model_copy(update={"study": study}))
    return replace(bare, parameters=problem.parameters[: problem.size])


def test_the_likelihood_fits_errors_along_and_no_other_cost() -> None:
    assert parse_cost("frf-least-squares").likelihood
    assert not parse_cost({"kind": "frf-least-squares", "residual": "log"}).likelihood
    assert not parse_cost("eigenfrequency").likelihood


def test_the_published_values_lie_within_the_intervals_of_umons() -> None:
    """Table 2 of the paper against a robot whose inertias are estimates: they make 15 %, noise 1 %."""
    problem = load_problem(read_study(ROOT / "configs" / "umons_tx200_rebalanced.yaml"))
    found = intervals(problem, fit(fit_plan(problem)).values)
    assert problem.reference is not None
    for number in range(6):  # stiffness and damping of joints 1 to 3
        published = problem.reference.parameters[problem.parameters[number].name]
        assert found.low[number] < published < found.high[number]
        assert 0.12 < found.std[number] < 0.25
        assert found.status[number] == "determined"
