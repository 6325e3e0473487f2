"""How far fits beside errors of what was told are taken."""

from __future__ import annotations

from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from identify.discovery import softly
from identify.discovery.softly import at_likelihood
from identify.fitting.optimizers.gauss_newton import GaussNewton
from identify.vibration.problem import Problem


@pytest.mark.parametrize(
    ("begins", "ends", "tolerances"),
    [(1.2, [1.0], [1e-4]), (40.0, [38.0], [1e-2]), (40.0, [3.0, 1.0], [1e-2, 1e-4])],
    ids=["near", "far", "on the way"],
)
def test_far_from_the_data_a_fit_stops_at_what_tells_nothing(
    begins: float, ends: list[float], tolerances: list[float], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Errors crept on for a dozen steps from 45.5 to 44.8, to make up for a base that gives way."""
    asked, costs = list[float](), list(ends)

    def minimized(
        problem: object, start: np.ndarray, optimizer: GaussNewton, objective: object
    ) -> tuple[np.ndarray, float]:
        asked.append(optimizer.tolerance)
        return start + 1, costs.pop(0)

    objective = SimpleNamespace(costs=lambda x: np.full(len(x), begins))
    monkeypatch.setattr(softly, "minimized", minimized)
    monkeypatch.setattr(
        softly, "FrfLeastSquares", lambda: SimpleNamespace(objective=lambda targets: objective)
    )
    problem = cast(Problem, SimpleNamespace(targets=lambda: None))
    values, cost = at_likelihood(problem, np.zeros(3), GaussNewton(evaluations=30, tolerance=1e-4))
    assert (asked, cost) == (tolerances, ends[-1])
    assert values == pytest.approx(np.full(3, len(ends))), "each goes on from where the last one ended"
