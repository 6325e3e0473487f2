"""What the posterior of FRFs and nuisance parameters says of how its residuals bend."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from identify.core.parameters import Scale
from identify.discovery.decimated import decimated
from identify.fitting.optimizers.base import Search
from identify.model.effects.base import parse_effect
from identify.vibration.costs import frf_least_squares, information
from identify.vibration.costs.frf_least_squares import FrfLeastSquares, PosteriorObjective
from identify.vibration.nuisances.settings import IMPACTS_ALONE
from identify.vibration.problem import Problem, load_problem, with_effects, with_uncertainty
from identify.vibration.study import read_study
from tests.hidden import config_of
from tests.shared import shared

CONFIG = Path(__file__).parents[3] / "configs" / "arm_hammer_test.yaml"
_TEMPERATURE = 3.0


@pytest.fixture(scope="module")
def problem(tmp_path_factory: pytest.TempPathFactory) -> Problem:
    """The shipped study where everything is uncertain, on few lines."""
    text = CONFIG.read_text().replace("../data", str(CONFIG.parents[1] / "data"))
    path = tmp_path_factory.mktemp("study") / "study.yaml"
    path.write_text(f"{text}\nuncertainty: typical\n")
    return decimated(load_problem(read_study(path)))


def _sides(problem: Problem) -> tuple[np.ndarray, np.ndarray]:
    """Values (unknowns,) and others (2, unknowns) on either side of them."""
    scale, rng = Scale(problem.parameters), np.random.default_rng(0)
    x = scale.to_x(problem.initial)
    step = 0.1 * rng.normal(size=len(x))
    return problem.initial, scale.to_values(np.array([x + step, x - step]))


@pytest.mark.parametrize("residual", ["complex", "log"])
def test_bend_is_that_of_every_residual(residual: str, problem: Problem) -> None:
    free, (values, sides) = Scale(problem.parameters).free, _sides(problem)
    cost = FrfLeastSquares.model_validate({"residual": residual})
    objective = PosteriorObjective(cost, problem.targets(), _TEMPERATURE)
    objective.product(values, free)
    expected, likelihood = np.zeros(len(free)), objective._likelihood
    for target in problem.targets().frf:
        h, slopes = target.gradient(values, free)
        here, weight = likelihood.residuals_of(target, h)
        away = sum(likelihood.residuals_of(target, target.predict(side))[0] for side in sides) - 2 * here
        expected += np.einsum("loik,loi->k", np.conj(slopes * weight[..., None]), away).real
    bend = objective.bend(values, free, sides)
    assert bend == pytest.approx(expected / _TEMPERATURE, rel=1e-9, abs=1e-9 * np.abs(expected).max())
    assert np.abs(expected).max() > 1.0


def test_bend_is_not_told_where_impacts_are_simulated(tmp_path: Path) -> None:
    """Every prediction takes long there."""
    config = config_of(shared("hidden", "friction_j2_101"), tmp_path)
    rows = [row for row in config.read_text().splitlines() if "{file: " not in row or "posture1" in row]
    config.write_text("\n".join(rows))
    effect = parse_effect({"kind": "joint-friction", "joints": [2]})
    told = load_problem(read_study(config))
    whole = with_effects(with_uncertainty(told, IMPACTS_ALONE), [*told.file.study.effects, effect], {})
    objective, free = PosteriorObjective(FrfLeastSquares(), (few := decimated(whole)).targets()), np.arange(2)
    assert few.targets().simulated
    objective.product(few.initial, free)
    assert objective.bend(few.initial, free, np.array([few.initial, few.initial])) is None


def test_bend_is_not_told_elsewhere_nor_of_large_data(
    problem: Problem, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Only where derivatives are at hand."""
    free, (values, sides) = Scale(problem.parameters).free, _sides(problem)
    objective = PosteriorObjective(FrfLeastSquares(), problem.targets())
    assert objective.bend(values, free, sides) is None
    objective.product(values, free)
    assert objective.bend(sides[0], free, sides) is None
    assert objective.bend(values, free, sides) is not None
    monkeypatch.setattr(frf_least_squares, "_KEPT_BYTES", 1000)
    objective.product(values, free)
    assert objective.bend(values, free, sides) is None


def test_a_stage_begins_without_what_was_computed_before(problem: Problem) -> None:
    """Or a start would depend, in its last digits, on the one before it, and on who ran that."""
    free, (values, sides) = Scale(problem.parameters).free, _sides(problem)
    objective = PosteriorObjective(FrfLeastSquares(), problem.targets())
    fresh = objective.costs(values[None])
    objective.product(values, free)
    objective._known = values[None], -1.0
    assert objective.costs(values[None]) == -1.0
    begun = objective.at(values)
    assert begun.costs(values[None]) == fresh
    assert begun.bend(values, free, sides) is None


def _soft(problem: Problem, std: float) -> Problem:
    """With a bearing by compliance, known to be small."""
    more = {"kind": "joint-compliance", "joints": [2], "axes": ["rx", "ry"], "shrink": True}
    effects = [*problem.file.study.effects, parse_effect({**more, "compliance_std": std})]
    return with_effects(problem, effects, {})


def test_a_known_compliance_costs_its_square(problem: Problem) -> None:
    """As a residual, with its derivative, and as information of the search scale."""
    soft, std = _soft(problem, 1e-8), 1e-8
    objective = PosteriorObjective(FrfLeastSquares(), soft.targets())
    plain = PosteriorObjective(FrfLeastSquares(), replace(soft.targets(), priors=()))
    number = next(n for n, p in enumerate(soft.parameters) if p.name == "joint2.rx.compliance")
    values, scale = soft.initial.copy(), Scale(soft.parameters)
    values[number] = 3e-8
    other = next(n for n, p in enumerate(soft.parameters) if p.name == "joint2.ry.compliance")
    values[other] = 0.0
    more = objective.costs(values[None])[0] ** 2 - plain.costs(values[None])[0] ** 2
    assert more * objective.count == pytest.approx(9.0, rel=1e-6)
    row = list(scale.free).index(number)
    change = objective.product(values, scale.free) - plain.product(values, scale.free)
    assert change[row, row] == pytest.approx(std**-2)
    assert change[row, -1] == pytest.approx(3e-8 / std**2)
    step = scale.slope(scale.to_x(values))[row]
    assert scale.prior_information()[row] == pytest.approx((step / std) ** 2)


def test_residuals_bend_alike_in_parts_of_their_lines(
    problem: Problem, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Data too large for derivatives at once are taken in parts, and bend all the same."""
    scale, bends = Scale(problem.parameters), []
    x = scale.to_x(problem.initial)
    for most in (200_000_000, 2_000_000):
        monkeypatch.setattr(information, "_MOST_BYTES", most)
        search = Search(PosteriorObjective(FrfLeastSquares(), problem.targets()), scale, 10)
        search.product(x)
        bends.append(search.bend(x, np.full(len(x), 0.05)))
    assert len(information.by_lines(problem.targets().frf, len(x))) > len(problem.targets().frf)
    assert bends[1] == pytest.approx(bends[0], rel=1e-9)


def test_residuals_bend_within_the_bounds(problem: Problem) -> None:
    """Beyond a compliance of zero there is no model: the bend is that along all else."""
    soft = _soft(problem, 1e-8)
    scale = Scale(soft.parameters)
    values = np.where([p.name.endswith(".compliance") for p in soft.parameters], 0.0, soft.initial)
    search = Search(PosteriorObjective(FrfLeastSquares(), soft.targets()), scale, 10)
    x = scale.to_x(values)
    search.product(x)
    rigid = np.array([soft.parameters[n].name.endswith(".compliance") for n in scale.free])
    bend = search.bend(x, np.where(rigid, 0.5, 0.01))
    expected = search.bend(x, np.where(rigid, 0.0, 0.01))
    assert bend is not None and np.count_nonzero(rigid) == 2
    assert np.array_equal(bend, expected)
