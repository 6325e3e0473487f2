"""The bounded quadratic against another solver."""

from __future__ import annotations

import numpy as np
import pytest
import scipy

from identify.discovery.sparse.bounded import bounded_step


@pytest.mark.parametrize("seed", range(20))
def test_the_step_is_that_of_another_solver(seed: int) -> None:
    rng = np.random.default_rng(seed)
    size = int(rng.integers(3, 25))
    root = rng.normal(size=(size + 3, size))
    curvature, slope = root.T @ root, 5 * rng.normal(size=size)
    lower = np.where(rng.random(size) < 0.5, 0.0, -rng.random(size))
    upper = lower + np.where(rng.random(size) < 0.3, np.inf, rng.random(size) + 0.1)
    factor = scipy.linalg.cholesky(curvature)
    wanted = scipy.linalg.solve_triangular(factor, slope, trans="T")
    told = scipy.optimize.lsq_linear(factor, wanted, (lower, upper), tol=1e-14).x
    found = bounded_step(curvature, slope, lower, upper)
    assert np.all((lower <= found) & (found <= upper))
    assert found == pytest.approx(told, abs=1e-5)
    free = np.linalg.solve(curvature, slope)
    assert np.abs(found - free).max() > 1e-3, "bounds that hold nothing test nothing"
