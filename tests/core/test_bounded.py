"""The bounded quadratic against another solver."""

from __future__ import annotations

import numpy as np
import pytest
import scipy

from identify.core import bounded
from identify.core.bounded import bounded_step


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


@pytest.mark.parametrize("patience", [bounded._PATIENCE, 1, 0])
@pytest.mark.parametrize("seed", range(4))
def test_unknowns_of_many_sizes_that_hide_each_other(
    seed: int, patience: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """By the conditions of an optimum: slopes of nothing where free, outwards where held; whether all are
    exchanged at once, or one at a time from somewhere or from the start.
    """
    monkeypatch.setattr(bounded, "_PATIENCE", patience)
    rng, count = np.random.default_rng(seed), 60
    common = rng.normal(size=(2 * count, 8)) @ rng.normal(size=(8, count))
    root = (common + 0.01 * rng.normal(size=(2 * count, count))) * np.exp(4 * rng.normal(size=count))
    curvature, slope = root.T @ root, root.T @ rng.normal(size=2 * count)
    size = np.sqrt(np.diag(curvature))
    curvature += 1e-5 * np.diag(size**2)
    lower = np.where(rng.random(count) < 0.5, 0.0, -1 / size)
    upper = np.where(rng.random(count) < 0.5, 3 / size, np.inf)
    found = bounded_step(curvature, slope, lower, upper)
    left = (slope - curvature @ found) / size
    assert np.abs(left[(found > lower) & (found < upper)]).max() < 1e-6
    assert left[found == lower].max() < 1e-6
    assert left[found == upper].min(initial=0.0) > -1e-6
    assert np.sum(found == lower) > 10
