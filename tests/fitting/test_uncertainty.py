"""The sandwich against linear problems whose covariance is known, and what the data are said to determine."""

from __future__ import annotations

import numpy as np
import pytest

from identify.core.parameters import Parameter, Scale
from identify.fitting.uncertainty import (
    Uncertainty,
    inseparable,
    joint_uncertainty,
    propagated_uncertainty,
    sandwich,
    statuses,
)

LOG = Scale((Parameter("k", "N m/rad", 1e5, 1e-3, 1e13),))
LINE = Scale(tuple(Parameter(name, "", 0.0, -1e4, 1e4, log=False) for name in ("offset", "slope")))


@pytest.mark.parametrize(
    ("std", "status"), [(0.34, "determined"), (0.36, "weak"), (0.98, "weak"), (1.02, "not determined")]
)
def test_determined_is_known_within_a_factor_of_two(std: float, status: str) -> None:
    """Two standard deviations either way: exp(2 x 0.3466) = 2."""
    assert statuses(LOG, np.array([1e5]), np.array([std])) == (status,)


def _fit(seed: int, level: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A straight line through 40 points whose noise is said to be 1: values, residuals, and rows on the
    search scale.
    """
    time = np.linspace(-1, 3, 40)
    columns = np.column_stack([np.ones(40), time])
    measured = columns @ [5.0, -2.0] + level * np.random.default_rng(seed).normal(size=40)
    values = np.linalg.lstsq(columns, measured, rcond=None)[0]
    return values, columns @ values - measured, columns * LINE.slope(LINE.to_x(values))


@pytest.mark.parametrize("level", [1.0, 4.0])
def test_the_interval_of_a_straight_line_is_as_wide_as_its_values_scatter(level: float) -> None:
    """Closed form: std of the slope = level / sqrt(sum (t - mean)^2)."""
    time, found, half = np.linspace(-1, 3, 40), [], []
    for seed in range(300):
        values, residual, rows = _fit(seed, level)
        information = rows.T @ rows
        scores = information * (residual @ residual) / (40 - 2)
        known = sandwich(information, scores, 40, LINE, values)
        found.append(values)
        half.append((known.high - known.low) / 2)
    slope = level / np.sqrt(np.sum((time - time.mean()) ** 2))
    offset = slope * np.sqrt(np.mean(time**2))
    assert np.std(found, axis=0) == pytest.approx([offset, slope], rel=0.12)
    assert np.mean(half, axis=0) == pytest.approx([1.96 * offset, 1.96 * slope], rel=0.08)


def test_correlation_and_directions_of_a_straight_line() -> None:
    """Offset and slope of points that lie to the right of zero pull against each other: -mean t / rms t."""
    time, (values, _, rows) = np.linspace(-1, 3, 40), _fit(0, 1.0)
    known = sandwich(rows.T @ rows, rows.T @ rows, 40, LINE, values)
    expected = -time.mean() / np.sqrt(np.mean(time**2))
    assert known.correlation == pytest.approx(np.array([[1, expected], [expected, 1]]), rel=1e-6)
    assert known.singular_values == pytest.approx(np.linalg.svd(rows, compute_uv=False), rel=1e-9)
    assert np.abs(rows @ known.directions.T) ** 2 @ np.ones(2) == pytest.approx((rows**2).sum(axis=1))
    for size, direction in zip(known.singular_values, known.directions, strict=True):
        assert np.linalg.norm(rows @ direction) == pytest.approx(size)


def test_only_the_sum_of_two_is_known() -> None:
    scale = Scale(tuple(Parameter(name, "", 1.0, 1e-3, 1e3) for name in ("first", "second", "other")))
    rows = np.array([[50.0, 50.0, 0.0], [0.0, 0.0, 30.0]])
    information = rows.T @ rows
    known = sandwich(information, information, 2, scale, np.ones(3))
    assert inseparable(known, ["first", "second", "other"]) == [("first", "second")]
    assert known.status == ("not determined", "not determined", "determined")


@pytest.mark.parametrize("log", [True, False])
def test_where_the_data_say_nothing_the_bounds_do(log: bool) -> None:
    """Two standard deviations either way are the whole range, on the scale of the search."""
    parameter = (
        Parameter("blind", "", 10.0, 1e-1, 1e3) if log else Parameter("blind", "", 0.0, -7.0, 7.0, log=False)
    )
    scale = Scale((parameter,))
    known = sandwich(np.zeros((1, 1)), np.zeros((1, 1)), 1, scale, np.array([parameter.initial]))
    lower, upper = scale.bounds()
    assert 4 * known.std == pytest.approx(upper - lower)
    assert known.low == pytest.approx(parameter.lower, rel=0.1)
    assert known.high == pytest.approx(parameter.upper, rel=0.1)
    assert known.status == ("not determined",)


def _jointly(rows: np.ndarray, level: float = 1.0) -> Uncertainty:
    """Of an offset and a slope beside one nuisance parameter, with noise `level` times as stated."""
    errors = np.array([False, False, True])
    variance = level**2 * rows.T @ rows
    return joint_uncertainty(
        rows.T @ rows, lambda c: c @ variance @ c.T, errors, len(rows), LINE, np.array([1.0, 2.0])
    )


def test_an_error_that_data_do_not_tell_from_an_offset_widens_it_by_its_own_size() -> None:
    rows = np.column_stack([np.full(40, 1e3), np.linspace(-1e3, 1e3, 40), np.full(40, 5e3)])
    known = _jointly(rows)
    prior = LINE.prior_information()[0]
    assert known.std[0] == pytest.approx(1 / np.sqrt(prior + 1 / 5**2), rel=1e-4)
    assert known.std[1] == pytest.approx(1 / np.linalg.norm(rows[:, 1]), rel=1e-6)
    assert known.joint is not None
    covariance = np.linalg.inv(rows.T @ rows + np.diag([*LINE.prior_information(), 1.0]))
    assert known.joint.root @ known.joint.root.T == pytest.approx(covariance, rel=1e-6, abs=1e-12)


def test_what_predictions_are_drawn_from_is_as_wide_as_the_intervals() -> None:
    """Residuals three times as large as their noise: parameters scatter so, and so must what is predicted."""
    time = np.linspace(-1, 1, 40)
    rows = np.column_stack([np.full(40, 30.0), 30.0 * time, 5.0 * time**2])
    quiet, loud = _jointly(rows), _jointly(rows, 3.0)
    assert quiet.joint is not None and loud.joint is not None
    assert np.all(loud.std > 2 * quiet.std)
    for known in (quiet, loud):
        assert known.joint is not None
        root = known.joint.root
        assert np.sqrt(np.diag(root @ root.T)[:2]) == pytest.approx(known.std, rel=1e-9)
        assert np.sqrt(np.diag(root @ root.T)[2]) == pytest.approx(known.joint.spread[0], rel=1e-9)


def test_an_error_that_was_not_fitted_moves_the_optimum_as_far_as_it_is_large() -> None:
    """Its part is added to that of noise, and the truth of both goes along with it."""
    rows = np.column_stack([np.full(40, 30.0), np.linspace(-30, 30, 40)])
    information, moved = rows.T @ rows, np.array([[0.5, 0.0], [-0.2, 0.1]])
    given = 40, LINE, np.array([1.0, 2.0])
    plain = sandwich(information, 4 * information, *given)
    found = propagated_uncertainty(information, 4 * information, moved, *given)
    assert found.std == pytest.approx(np.hypot(plain.std, np.linalg.norm(moved, axis=1)), rel=1e-9)
    assert found.joint is not None
    assert found.joint.stated == pytest.approx(moved)
    assert found.joint.spread == pytest.approx([1.0, 1.0])
    root = found.joint.root
    assert np.linalg.norm(root[:2], axis=1) == pytest.approx(found.std)
    bare = propagated_uncertainty(information, information, moved, *given).joint
    assert bare is not None
    assert bare.information @ bare.root @ bare.root.T == pytest.approx(np.eye(4), abs=1e-8)


def test_what_only_rounding_tells_apart_is_known_as_far_as_bounds_say() -> None:
    """The inverse of such information is not positive definite."""
    rows = np.random.default_rng(0).normal(size=(40, 3)) * 1e9
    rows[:, 1] = rows[:, 0] * (1 + 1e-12)
    information = rows.T @ rows + np.diag([*LINE.prior_information(), 1.0])
    with pytest.raises(np.linalg.LinAlgError):
        np.linalg.cholesky(np.linalg.inv(information))
    known = _jointly(rows)
    assert known.std[:2] == pytest.approx(1 / np.sqrt(2 * LINE.prior_information()), rel=0.01)
