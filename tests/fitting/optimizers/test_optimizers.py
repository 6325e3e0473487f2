"""A contract battery: every registered optimizer by problems with known answers; and what is special of
each.
"""

from __future__ import annotations

import contextlib
import logging
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.optimize
from pydantic import ValidationError

from identify.core.parameters import Parameter, Scale
from identify.core.part_file import PartFile
from identify.fitting.memory import Journal
from identify.fitting.objective import Objective
from identify.fitting.optimizers.base import OPTIMIZERS, Ended, Search, minimized, parse_optimizer

KINDS = OPTIMIZERS.names()


class Known(Objective):
    """A sum of squares with its minimum at `truth`, on log scales, for each of n parameters: a bowl, a curved
    valley, or many minima.
    """

    def __init__(self, shape: str, size: int) -> None:
        self.shape, self.truth = shape, np.exp(np.linspace(-0.6, 0.6, size))

    def costs(self, candidates: np.ndarray) -> np.ndarray:
        return np.array([self._rows(np.log(values / self.truth)) for values in candidates]) ** 0.5

    def _rows(self, z: np.ndarray) -> float:
        return float(np.sum(self._residual(z) ** 2))

    def _residual(self, z: np.ndarray) -> np.ndarray:
        if self.shape == "valley":
            return np.concatenate([3 * (z[1:] - z[:-1] ** 2), z])
        if self.shape == "noisy":
            return np.concatenate([3 * (z[1:] - z[:-1] ** 2), z, [1.0]])
        if self.shape == "many":
            return np.concatenate([z, 1.2 * np.sin(3 * z)])
        return z

    def residuals(self, values: np.ndarray, free: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        z, step = np.log(values / self.truth), 1e-6
        columns = [
            (self._residual(z + step * unit) - self._residual(z - step * unit)) / (2 * step)
            for unit in np.eye(len(z))
        ]
        return self._residual(z), (np.array(columns).T / values)[:, free]


def search(shape: str = "bowl", size: int = 3, budget: int = 6000, **settings: Any) -> Search:
    parameters = tuple(Parameter(f"p{n}", "1", 1.0, 1e-2, 1e2) for n in range(size))
    return Search(Known(shape, size), Scale(parameters), budget, **settings)


def run(kind: str, problem: Search, seed: int = 1, **settings: Any) -> Search:
    optimizer = parse_optimizer({"kind": kind, **settings})
    with contextlib.suppress(Ended):
        optimizer.minimize(problem, np.full(len(problem.lower), 0.1), np.random.default_rng(seed))
    return problem


def test_far_from_the_data_gauss_newton_ends_coarsely_and_nearer_does_not() -> None:
    fine, far, near = (run("gauss-newton", search("noisy", 4, far=cost)) for cost in (np.inf, 0.0, 10.0))
    assert far.evaluations < fine.evaluations
    assert near.evaluations == fine.evaluations and near.best_cost == fine.best_cost


@pytest.mark.parametrize("kind", KINDS)
class TestContract:
    @pytest.mark.parametrize(("shape", "within"), [("bowl", 2e-2), ("valley", 5e-2)])
    def test_finds_the_known_answer(self, kind: str, shape: str, within: float) -> None:
        found = run(kind, search(shape))
        assert found.best_cost < within
        assert found.scale.to_values(found.best_x) == pytest.approx(found.objective.truth, rel=within)

    def test_cost_at_the_best_point_is_the_best_cost(self, kind: str) -> None:
        found = run(kind, search("many", 4, 1000))
        assert found.objective.costs(found.scale.to_values(found.best_x)[None])[0] == found.best_cost

    def test_same_seed_same_result_and_no_global_state(self, kind: str) -> None:
        state, handlers = np.random.get_state()[1].copy(), list(logging.root.handlers)
        first, second = (run(kind, search("many", 4, 1500), seed=3) for _ in range(2))
        assert np.array_equal(first.best_x, second.best_x)
        assert first.evaluations == second.evaluations
        assert np.array_equal(np.random.get_state()[1], state)
        assert logging.root.handlers == handlers

    def test_stays_within_bounds(self, kind: str) -> None:
        problem = search()
        problem.objective.truth = np.array([1e-4, 1.0, 1e4])  # two minima are beyond the bounds
        seen: list[np.ndarray] = []
        inner = problem.objective.costs
        problem.objective.costs = lambda values: (seen.append(values.copy()), inner(values))[1]  # type: ignore[method-assign]
        found = run(kind, problem)
        every = np.concatenate(seen)
        assert every.min() >= 1e-2 * (1 - 1e-6)
        assert every.max() <= 1e2 * (1 + 1e-6)
        assert found.scale.to_values(found.best_x) == pytest.approx([1e-2, 1.0, 1e2], rel=0.05)

    def test_budget_is_respected_to_a_generation(self, kind: str) -> None:
        assert run(kind, search("many", 4, 200)).evaluations < 200 + 100

    def test_target_cost_ends_the_search(self, kind: str) -> None:
        found = run(kind, search(target_cost=0.3))
        assert found.best_cost <= 0.3
        assert found.evaluations < 3000

    def test_journal_replays_to_the_same_end(self, kind: str, tmp_path: Path) -> None:
        part = PartFile(tmp_path / "run.part", "key")
        whole = run(kind, search("many", 4, 900, journal=Journal(part)))
        part.keep(len(part.records) // 3)
        kept = len(part.records)
        again = Journal(part)
        resumed = run(kind, search("many", 4, 900, journal=again))
        assert again.replayed == kept > 0
        assert np.array_equal(whole.best_x, resumed.best_x)
        assert whole.evaluations == resumed.evaluations

    def test_candidates_without_a_solution_do_no_harm(self, kind: str) -> None:
        problem = search("bowl")
        inner = problem.objective.costs
        problem.objective.costs = lambda values: np.where(values[:, 0] > 3.0, np.inf, inner(values))  # type: ignore[method-assign]
        assert run(kind, problem).best_cost < 0.1

    def test_unknown_option_is_refused(self, kind: str) -> None:
        with pytest.raises(ValidationError, match="typo"):
            parse_optimizer({"kind": kind, "typo": 1})


@pytest.mark.parametrize("kind", ["differential-evolution", "hybrid", "cma-es", "particle-swarm"])
def test_global_methods_find_the_best_of_many_minima_where_a_local_one_does_not(kind: str) -> None:
    def from_afar(kind: str) -> float:
        problem = search("many", 4, 8000)

        def start() -> np.ndarray:
            return np.array([2.2, -2.0, 1.9, 2.3])

        with contextlib.suppress(Ended):
            parse_optimizer({"kind": kind}).minimize(problem, start(), np.random.default_rng(0))
        return problem.best_cost

    assert from_afar(kind) < 1e-3
    assert from_afar("gauss-newton") > 0.5


def test_scale_is_its_own_inverse_with_fixed_and_linear_parameters() -> None:
    scale = Scale(
        (
            Parameter("k", "N/m", 1e6, 1e4, 1e8),
            Parameter("m", "kg", 2.0, -5.0, 5.0, log=False),
            Parameter("fixed", "kg", 7.0, 0.0, 9.0, free=False),
        )
    )
    values = np.array([[2e6, -1.5, 7.0], [3e5, 4.0, 7.0]])
    assert scale.to_values(scale.to_x(values)) == pytest.approx(values)
    x = scale.to_x(values[0])
    step = 1e-6
    for number in range(2):
        moved = scale.to_values(x + step * np.eye(2)[number]) - scale.to_values(x)
        assert moved[number] / step == pytest.approx(scale.slope(x)[number], rel=1e-4)


def test_hybrid_needs_a_population_method() -> None:
    with pytest.raises(ValidationError, match="not a population method"):
        parse_optimizer({"kind": "hybrid", "method": "nelder-mead"})


def test_unknown_kind_lists_the_known_ones() -> None:
    with pytest.raises(ValueError, match="one of artificial-bee-colony, cma-es"):
        parse_optimizer("simulated-annealing")


def test_an_old_kind_is_refused_with_the_one_that_does_its_work() -> None:
    with pytest.raises(ValueError, match="it is `gauss-newton` now"):
        parse_optimizer("levenberg-marquardt")


@pytest.mark.parametrize("expensive", [False, True])
def test_a_search_knows_the_product_of_its_residuals_and_remembers_what_is_expensive(
    expensive: bool, tmp_path: Path
) -> None:
    def problem() -> Search:
        found = search("valley", 4, journal=Journal(part))
        found.objective.expensive = expensive  # type: ignore[misc]
        return found

    part, x = PartFile(tmp_path / "run.part", "key"), np.array([0.2, -0.4, 0.3, 0.1])
    first = problem()
    product = first.product(x)
    r, j = first.objective.residuals(np.exp(x), first.scale.free)
    j = j * first.scale.slope(x)
    every = np.column_stack([j, r])
    assert product == pytest.approx(every.T @ every, rel=1e-12)
    again = problem()
    rows, slopes = again.residuals(x)
    assert again.journal.replayed == expensive
    assert np.column_stack([slopes, rows]).T @ np.column_stack([slopes, rows]) == pytest.approx(product)
    assert first.evaluations == again.evaluations == 1


def test_a_fit_that_steps_as_large_as_the_last_do_not_bring_near_its_rival_ends() -> None:
    optimizer = parse_optimizer({"kind": "gauss-newton", "evaluations": 40})
    for rival, ended in ((np.inf, False), (1.0, False), (1e-12, True)):
        problem = search("noisy", 4, rival=rival)  # its least cost is above 1
        outcome = minimized(optimizer, problem, np.full(4, 1.5), np.random.default_rng(0))
        assert ("would not reach" in outcome.sentence) == ended


def test_a_product_that_is_not_finite_is_infinite_and_remembered_as_such(tmp_path: Path) -> None:
    part, x = PartFile(tmp_path / "run.part", "key"), np.full(3, 0.1)
    for replayed in (0, 1):
        problem = search(journal=Journal(part))
        problem.objective.expensive = True  # type: ignore[misc]
        problem.objective.residuals = lambda values, free: (np.full(3, np.nan), np.eye(3))  # type: ignore[method-assign]
        assert np.isposinf(problem.product(x)).all()
        assert problem.journal.replayed == replayed


def test_gauss_newton_asks_for_no_derivatives_that_no_step_will_use() -> None:
    """A cost and a product at the start and a cost after each step; a product only between steps."""
    assert run("gauss-newton", search("valley"), evaluations=2).evaluations == 3
    assert run("gauss-newton", search("valley"), evaluations=3).evaluations == 5


class Noisy(Objective):
    """Linear in ten parameters, of which some combinations are hardly seen, and mostly noise."""

    def __init__(self) -> None:
        rng = np.random.default_rng(0)
        left, right = (np.linalg.qr(rng.normal(size=size))[0] for size in ((200, 10), (10, 10)))
        self.slopes = left * np.logspace(3, -1, 10) @ right.T
        self.measured = self.slopes @ rng.uniform(-2, 2, 10) + 30 * rng.normal(size=200)

    def costs(self, candidates: np.ndarray) -> np.ndarray:
        return np.linalg.norm(candidates @ self.slopes.T - self.measured, axis=1)

    def residuals(self, values: np.ndarray, free: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return self.slopes @ values - self.measured, self.slopes[:, free]


@pytest.mark.parametrize("limit", [5.0, 1.0], ids=["few bounds met", "many bounds met"])
def test_gauss_newton_comes_to_bounds_and_noise_in_few_evaluations(limit: float) -> None:
    """Where the trust region of scipy's `trf` is rounded off towards them it does not in a hundred."""
    problem = Noisy()
    parameters = tuple(Parameter(f"p{n}", "1", 0.0, -limit, limit, log=False) for n in range(10))
    found = Search(problem, Scale(parameters), 1000)
    outcome = parse_optimizer({"kind": "gauss-newton"}).minimize(
        found, np.zeros(10), np.random.default_rng(0)
    )
    best = scipy.optimize.lsq_linear(problem.slopes, problem.measured, (-limit, limit), method="bvls")
    at_bounds = int(np.sum(best.active_mask != 0))
    assert at_bounds >= (3 if limit == 1 else 1)
    assert outcome.converged
    assert found.evaluations < 60
    assert found.best_cost**2 == pytest.approx(2 * best.cost, rel=1e-8)


class Bent(Objective):
    """Two numbers of which one is hardly seen, along a narrow valley, a parabola; told: whether it says
    how its residuals bend.
    """

    def __init__(self, *, told: bool) -> None:
        self.told, self.steps = told, 0

    def at(self, values: np.ndarray) -> np.ndarray:
        x, y = values[..., 0], values[..., 1]
        return np.stack([100 * (y - x**2), x - 1], axis=-1)

    def costs(self, candidates: np.ndarray) -> np.ndarray:
        return np.linalg.norm(self.at(candidates), axis=1)

    def residuals(self, values: np.ndarray, free: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        self.steps += 1
        return self.at(values), self._slopes(values)

    def bend(self, values: np.ndarray, free: np.ndarray, sides: np.ndarray) -> np.ndarray | None:
        away = self.at(sides).sum(axis=0) - 2 * self.at(values)
        return np.asarray(self._slopes(values).T @ away) if self.told else None

    def _slopes(self, values: np.ndarray) -> np.ndarray:
        return np.array([[-200 * values[0], 100.0], [1.0, 0.0]])


def test_gauss_newton_follows_a_bent_valley_where_it_is_told_of_it() -> None:
    """In 19 steps instead of 57."""
    parameters = tuple(Parameter(name, "1", -1.0, -5.0, 5.0, log=False) for name in "xy")

    def steps(*, told: bool) -> int:
        problem = Bent(told=told)
        found = Search(problem, Scale(parameters), 2000)
        start = found.scale.to_x(np.array([-1.0, 1.0]))
        parse_optimizer({"kind": "gauss-newton"}).minimize(found, start, np.random.default_rng(0))
        assert found.best_cost < 1e-6
        return problem.steps

    assert steps(told=True) < steps(told=False) / 2
