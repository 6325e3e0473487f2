"""A parameter that ends at its bound is said to be there, with a limit on the other side only."""

from __future__ import annotations

import numpy as np
import pytest

from identify.core.parameters import Parameter, Scale
from identify.fitting.uncertainty import AT_LOWER, AT_UPPER, at_bounds, sandwich


def _parameter(name: str, value: float, *, log: bool = True) -> Parameter:
    return Parameter(name, "N m/rad", value, 1e3 if log else 0.0, 1e7, log=log)


@pytest.mark.parametrize("log", [True, False])
def test_the_interval_of_a_parameter_at_a_bound_has_one_side(log: bool) -> None:
    """Inside: 1.96 standard deviations both ways; at a bound 1.645 (95 % of one side) away from it."""
    low = 1e3 if log else 0.0
    values = np.array([low, 2e5, 1e7])
    scale = Scale(tuple(_parameter(f"k{n}", v, log=log) for n, v in enumerate(values)))
    lower, upper = scale.bounds()
    std = 0.005 * (upper - lower)[0]
    trusted = sandwich(np.eye(3) / std**2, np.eye(3) / std**2, 100, scale, values)
    assert trusted.status == (AT_LOWER, "determined", AT_UPPER)
    x = scale.to_x(values)
    assert scale.to_x(trusted.low) == pytest.approx([x[0], x[1] - 1.96 * std, x[2] - 1.645 * std], rel=1e-3)
    assert scale.to_x(trusted.high) == pytest.approx([x[0] + 1.645 * std, x[1] + 1.96 * std, x[2]], rel=1e-3)
    said = at_bounds(trusted, scale)
    assert said.startswith(f"At a bound: k0 ({low:.4g} N m/rad), k2 (1e+07 N m/rad):")


def test_near_a_bound_is_not_at_it() -> None:
    values = np.array([1.001e3, 2e5])
    scale = Scale(tuple(_parameter(f"k{n}", v) for n, v in enumerate(values)))
    trusted = sandwich(np.eye(2) * 400, np.eye(2) * 400, 100, scale, values)
    assert trusted.status == ("determined", "determined")
    assert at_bounds(trusted, scale) == ""
