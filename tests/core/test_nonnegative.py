"""Least squares with unknowns that are not negative, beside scipy's for many unknowns."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.optimize

from identify.core.nonnegative import nonnegative


@pytest.mark.parametrize("count", [1, 2, 3, 4])
def test_the_optimum_of_scipy(count: int) -> None:
    rng, bound = np.random.default_rng(count), 0
    for _ in range(40):
        columns, wanted = rng.normal(size=(30, count)), rng.normal(size=30)
        found = nonnegative(columns, wanted)
        assert found == pytest.approx(scipy.optimize.nnls(columns, wanted)[0], abs=1e-12)
        free = np.linalg.lstsq(columns, wanted, rcond=None)[0]
        bound += bool(np.max(np.abs(found - free)) > 1e-6)
    assert bound > 10  # where unknowns without a bound would do, nothing was tested


def test_columns_alike() -> None:
    column = np.linspace(1, 2, 20)
    found = nonnegative(np.stack([column, column], axis=1), 3 * column)
    assert found.min() >= 0
    assert found.sum() == pytest.approx(3)
