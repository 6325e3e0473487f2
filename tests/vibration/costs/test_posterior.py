"""What the posterior of FRFs and nuisance parameters says of how its residuals bend."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from identify.core.parameters import Scale
from identify.discovery.decimated import decimated
from identify.model.effects.base import parse_effect
from identify.vibration.costs import frf_least_squares
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
