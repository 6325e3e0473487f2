"""The posterior where only errors of links move is the whole one where nothing else errs; instruments that
may err count as noise.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from identify.core.arrays import Array, Index
from identify.discovery.thinned import thinned
from identify.vibration.costs.frf_least_squares import FrfLeastSquares, PosteriorObjective
from identify.vibration.costs.of_links import LinksObjective, of_links
from identify.vibration.problem import Problem, load_problem
from identify.vibration.study import read_study

CONFIG = Path(__file__).parents[3] / "configs" / "arm_hammer_test.yaml"
_LINKS = "links: {mass: 0.05, centre_m: 0.01, inertia: 0.1}"
_SOFTNESS = 30.0


def _problem(folder: Path, uncertainty: str, effects: str = "") -> Problem:
    """The shipped study with a statement, on few lines."""
    text = CONFIG.read_text().replace("../data", str(CONFIG.parents[1] / "data"))
    text = text.replace("effects:\n", f"effects:\n{effects}", 1)
    path = folder / "study.yaml"
    path.write_text(f"{text}\nuncertainty: {{{uncertainty}}}\n")
    return thinned(load_problem(read_study(path)))


def _of_links_alone(problem: Problem) -> tuple[Index, Array]:
    """Free unknowns, and values (4, unknowns) with errors of links."""
    free = [
        n
        for n, p in enumerate(problem.parameters)
        if p.free and (not p.nuisance or p.name.startswith("link"))
    ]
    values = np.repeat(problem.initial[None], 4, axis=0)
    own = [n for n in free if problem.parameters[n].nuisance]
    values[:, own] = np.random.default_rng(0).normal(size=(4, len(own)))
    return np.array(free), values


@pytest.mark.parametrize(
    "effects",
    ["", "  - {kind: time-delay}\n", "  - {kind: joint-relaxation, joints: [2]}\n"],
    ids=["in coordinates", "as read", "by compliance"],
)
def test_it_is_the_posterior_where_nothing_else_errs(effects: str, tmp_path: Path) -> None:
    problem = _problem(tmp_path, _LINKS, effects)
    free, values = _of_links_alone(problem)
    targets = problem.targets()
    whole = PosteriorObjective(FrfLeastSquares(), targets, _SOFTNESS)
    links = LinksObjective(targets, _SOFTNESS)
    assert links.costs(values) == pytest.approx(whole.costs(values), rel=1e-9)
    assert np.ptp(links.costs(values)) > 1e-3  # the errors are seen
    one, other = (objective.residuals(values[0], free) for objective in (links, whole))
    assert one[0] @ one[0] == pytest.approx(other[0] @ other[0], rel=1e-9)
    gradients = [slopes.T @ rows for rows, slopes in (one, other)]
    assert gradients[0] == pytest.approx(gradients[1], rel=1e-7, abs=1e-7 * np.abs(gradients[1]).max())
    products = [slopes.T @ slopes for _, slopes in (one, other)]
    assert products[0] == pytest.approx(products[1], rel=1e-7, abs=1e-7 * np.abs(products[1]).max())


@pytest.mark.parametrize(
    "instruments",
    ["channels: {gain: 0.05}", "points: {direction_deg: 3.0}", "impacts: {direction_deg: 3.0}"],
)
def test_instruments_that_may_err_count_as_noise(instruments: str, tmp_path: Path) -> None:
    exact = _problem(tmp_path, _LINKS)
    stated = _problem(tmp_path, f"{_LINKS}, {instruments}")
    costs = [
        float(LinksObjective(problem.targets(), 1.0).costs(problem.initial[None])[0])
        for problem in (exact, stated)
    ]
    assert costs[1] < 0.8 * costs[0]


def test_where_links_are_exact_there_is_nothing_to_lead(tmp_path: Path) -> None:
    problem = _problem(tmp_path, "channels: {gain: 0.05}")
    product = LinksObjective(problem.targets(), 1.0).product(problem.initial, np.arange(3))
    assert product.shape == (4, 4)
    assert np.diag(product).min() > 0


def test_it_is_not_for_data_without_a_statement() -> None:
    assert not of_links(load_problem(read_study(CONFIG)).targets())
