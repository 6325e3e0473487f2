"""Optimizers without gradients under stated uncertainty: nuisance parameters are eliminated from the cost
that they search.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from identify.fitting.fit import Fit, fit
from identify.fitting.optimizers.gauss_newton import GaussNewton
from identify.fitting.optimizers.nelder_mead import NelderMead
from identify.vibration.costs.eliminated import EliminatedObjective
from identify.vibration.costs.frf_least_squares import PosteriorObjective
from identify.vibration.plan import fit_plan
from identify.vibration.problem import Problem, load_problem
from identify.vibration.study import read_study
from tests.generator.dirt import CAREFUL, soil
from tests.generator.generate import generate
from tests.generator.makes import MAKES
from tests.generator.spec import TestSpec
from tests.hidden import config_of

NELDER_MEAD = "optimizer: {kind: nelder-mead, evaluations: 400, tolerance: 1.0e-4}"


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> str:
    """Three stiffnesses of an arm that is not as stated, by one posture and six channels."""
    folder, arm = tmp_path_factory.mktemp("eliminated"), MAKES["random"](3)
    spec = TestSpec(arm=arm.at_points([6, 14]), seed=3, postures=1, linear=True, band_hz=(2.5, 40.0))
    generate(soil(spec, CAREFUL), folder / "case")
    text = config_of(folder / "case", folder, extra="uncertainty: careful\nstarts: 1").read_text()
    k, c = arm.stiffness, arm.damping
    initial = (k[:3] * [1.15, 0.9, 1.1]).tolist()
    parts = (([1, 2, 3], f"{initial}", c[:3]), ([4, 5, 6], f"{k[3:].tolist()}, fixed: true", c[3:]))
    effects = [
        f"  - {{kind: joint-compliance, joints: {joints}, axes: [rz], stiffness: {{initial: {stiff}}},"
        f" damping: {{initial: {damping.tolist()}, fixed: true}}}}\n"
        for joints, stiff, damping in parts
    ]
    first, last = text.index("effects:\n") + len("effects:\n"), text.index("uncertainty:")
    return text[:first].replace("[3, 80]", "[3, 40]") + "".join(effects) + text[last:]


def _problem(study: str, folder: Path, more: str = "") -> Problem:
    path = folder / "case.yaml"
    path.write_text(f"{study}\n{more}\n")
    return load_problem(read_study(path))


@pytest.fixture(scope="module")
def best(study: str, tmp_path_factory: pytest.TempPathFactory) -> Fit:
    """What Gauss-Newton finds."""
    return fit(fit_plan(_problem(study, tmp_path_factory.mktemp("best"))))


def test_the_simplex_finds_what_gauss_newton_finds(study: str, best: Fit, tmp_path: Path) -> None:
    problem = _problem(study, tmp_path, NELDER_MEAD)
    plan = fit_plan(problem)
    searched = [stage for stage in plan.stages if isinstance(stage.optimizer, NelderMead)]
    assert [type(stage.objective) for stage in searched[1:]] == [EliminatedObjective] * 2
    assert isinstance(plan.stages[-1].optimizer, GaussNewton)
    found = fit(plan)
    assert found.values[: problem.size] == pytest.approx(best.values[: problem.size], rel=1e-3)
    assert found.cost == pytest.approx(best.cost, rel=1e-4)


def test_the_cost_is_least_where_gauss_newton_ends(study: str, best: Fit, tmp_path: Path) -> None:
    """Linearised there; and it rises less than with errors held."""
    problem = _problem(study, tmp_path, NELDER_MEAD)
    plan, values = fit_plan(problem), best.values
    stage = next(one for one in plan.stages if isinstance(one.objective, EliminatedObjective))
    objective, size = stage.objective.at(values), problem.size
    free = [n for n in range(size) if problem.parameters[n].free]
    cost = float(objective.costs(values[None])[0])
    assert cost == pytest.approx(float(plan.objective.costs(values[None])[0]), rel=1e-4)
    for number in free:
        for step in (0.99, 1.01):
            other = values.copy()
            other[number] *= step
            assert objective.costs(other[None])[0] > cost
            assert objective.costs(other[None])[0] < plan.objective.costs(other[None])[0]


def test_the_cost_is_the_least_of_the_linear_problem(study: str, tmp_path: Path) -> None:
    """By least squares over all rows; and its gradient by differences."""
    problem = _problem(study, tmp_path)
    targets, size = problem.targets(), problem.size
    whole = problem.file.study.cost.objective(targets)
    assert isinstance(whole, PosteriorObjective)
    rng, values = np.random.default_rng(0), problem.initial.copy()
    values[size:] = 0.3 * rng.normal(size=len(values) - size)
    objective = EliminatedObjective(whole, values)
    there = values.copy()
    there[0] *= 1.05
    r, j = [], []
    for target in targets.frf:
        _, slopes = target.gradient_pairs(values, whole.errors)
        e = (target.predict_pairs(there) - target.measured) / target.sigma
        slopes = (slopes / target.sigma[..., None]).reshape(-1, len(whole.errors))
        r += [e.real.ravel(), e.imag.ravel()]
        j += [slopes.real, slopes.imag]
    rows = np.concatenate([*j, np.eye(len(whole.errors))])
    right = np.concatenate([*r, values[size:]])
    left = right - rows @ np.linalg.lstsq(rows, right)[0]
    cost = float(objective.costs(there[None])[0])
    assert cost == pytest.approx(np.linalg.norm(left) / np.sqrt(whole.count), rel=1e-8)
    free = np.array([n for n in range(size) if problem.parameters[n].free])
    residuals, slopes = objective.residuals(there, free)
    assert residuals @ residuals == pytest.approx(cost**2 * whole.count, rel=1e-6)
    for column, number in enumerate(free):
        step = np.zeros(len(values))
        step[number] = 1e-5 * there[number]
        sides = objective.costs(np.array([there + step, there - step])) ** 2 * whole.count
        difference = (sides[0] - sides[1]) / (2 * step[number])
        assert 2 * slopes[:, column] @ residuals == pytest.approx(difference, rel=1e-4)
    assert np.isinf(objective.costs(np.full((1, len(values)), np.nan))).all()
