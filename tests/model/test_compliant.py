"""Springs by compliance: the same FRFs as by stiffness, and exact slopes where a joint is rigid, also of
records that end.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from identify.core.arrays import Array, Complex, Index
from identify.model.compliances import Compliances
from identify.model.compliant import (
    Response,
    Slopes,
    add_gradient,
    along_s,
    by_columns,
    by_matrices,
    by_springs,
    respond,
    shortened,
)
from identify.model.frf import frf

SIZE, RECORD = 8, 1.6
S = 0.7 + 2j * np.pi * np.arange(3, 40) / RECORD
RNG = np.random.default_rng(1)
_ROOT = RNG.normal(size=(SIZE, SIZE))
MASS = _ROOT @ _ROOT.T / SIZE + np.eye(SIZE)
_WEIGHT = RNG.normal(size=(SIZE, SIZE))
STIFFNESS = 5 * (_WEIGHT + _WEIGHT.T) + np.diag([0.0] * 6 + [3000.0, 5000.0])
DAMPING = np.diag([0.0] * 6 + [3.0, 4.0])
OUT, FORCE = RNG.normal(size=(5, SIZE)), RNG.normal(size=(SIZE, 2))
BLOCK = np.array([[1.0, 0.3], [0.2, 1.5]])
COLUMNS = np.zeros((SIZE, 6))
COLUMNS[:4, :4], COLUMNS[4:6, 4:6] = np.eye(4), BLOCK
SPRINGS = Compliances(COLUMNS, np.array([0, 1, 2, 3, 4, 4]), np.arange(5), np.arange(5, 10))
SOFT = np.array([1 / 2000, 1 / 8000, 0.0, 1e-14, 1 / 4000])
TAU = 2e-3
VALUES = np.concatenate([SOFT, np.full(5, TAU)])
ENDS = [None, RECORD]


def h(values: Array, power: int, record: float | None, mass: Array = MASS) -> Complex:
    return respond(SPRINGS, values, (mass, DAMPING, STIFFNESS), S, OUT, FORCE, power, record).h()


def gradient(model: Response, slopes: Slopes, owner: Index, count: int) -> Complex:
    found = np.zeros((len(S), len(OUT), FORCE.shape[1], count), dtype=complex)
    add_gradient(found, model, slopes, owner)
    return found


def central(of: Callable[[float], Complex], step: float) -> Complex:
    return (of(step) - of(-step)) / (2 * step)


def near(found: Complex, wanted: Complex, tolerance: float) -> bool:
    return bool(np.abs(found - wanted).max() <= tolerance * np.abs(wanted).max())


@pytest.mark.parametrize("record", ENDS)
@pytest.mark.parametrize("power", [0, 1, 2])
def test_frfs_are_those_of_stiffnesses_with_rigid_coordinates_locked(
    power: int, record: float | None
) -> None:
    """By another route: a stiffness matrix over the coordinates that move, and FRFs by its modes."""
    free = [0, 1, 4, 5, 6, 7]
    spring = np.zeros((SIZE, SIZE))
    spring[0, 0], spring[1, 1] = 2000.0, 8000.0
    spring[4:6, 4:6] = 4000 * np.linalg.inv(BLOCK @ BLOCK.T)
    pick = np.ix_(free, free)
    told = frf(
        MASS[pick],
        (DAMPING + TAU * spring)[pick],
        (STIFFNESS + spring)[pick],
        S,
        OUT[:, free],
        FORCE[free],
        power,
        record,
    )
    assert near(h(VALUES, power, record), told, 1e-9)
    assert not near(h(VALUES * 1.001, power, record), told, 1e-9)


@pytest.mark.parametrize("record", ENDS)
@pytest.mark.parametrize("power", [0, 1, 2])
def test_slopes_by_compliance_are_exact_down_to_a_rigid_joint(power: int, record: float | None) -> None:
    model = respond(SPRINGS, VALUES, (MASS, DAMPING, STIFFNESS), S, OUT, FORCE, power, record)
    assert (len(model.poles) > 2) == (record is not None)
    by_compliance, by_retardation = by_springs(model)
    slopes = gradient(model, by_compliance, SPRINGS.owner, 5)
    here = model.h()
    for spring, amount in enumerate(SOFT):

        def at(change: float, spring: int = spring) -> Complex:
            return h(VALUES + change * np.eye(10)[spring], power, record)

        if amount > 1e-10:
            told, tolerance = central(at, 1e-4 * amount), 1e-5
        else:  # one-sided, of third order: no compliance is less than none
            e = 1e-8
            told, tolerance = (-11 * here + 18 * at(e) - 9 * at(2 * e) + 2 * at(3 * e)) / (6 * e), 1e-5
        assert near(slopes[..., spring], told, tolerance), spring
    late = gradient(model, by_retardation, SPRINGS.owner, 5)
    for spring in (0, 4):

        def at_time(change: float, spring: int = spring) -> Complex:
            return h(VALUES + change * np.eye(10)[5 + spring], power, record)

        assert near(late[..., spring], central(at_time, 1e-7), 1e-6)
    assert not late[..., 2].any()


@pytest.mark.parametrize("record", ENDS)
def test_slopes_by_anything_else_are_exact_too(record: float | None) -> None:
    """Thin columns and whole matrices are two routes to the same."""
    model = respond(SPRINGS, VALUES, (MASS, DAMPING, STIFFNESS), S, OUT, FORCE, 2, record)
    body = RNG.normal(size=SIZE)
    changed = np.outer(body, body)
    slopes = by_columns(model, body[:, None], np.array([2]), np.array([1.0]))
    found = gradient(model, slopes, np.array([0]), 1)[..., 0]
    assert near(found, central(lambda e: h(VALUES, 2, record, MASS + e * changed), 1e-6), 1e-6)
    assert near(by_matrices(model, {2: changed[None], 0: 0 * changed[None]})[..., 0], found, 1e-9)


def test_what_the_end_of_the_record_changes() -> None:
    model = respond(SPRINGS, VALUES, (MASS, DAMPING, STIFFNESS), S, OUT, FORCE, 2, RECORD)
    told = central(lambda e: h(VALUES, 2, RECORD - e), 1e-5)
    assert near(shortened(model), told, 1e-5)


@pytest.mark.parametrize("record", ENDS)
@pytest.mark.parametrize("power", [0, 1, 2])
def test_what_another_decay_of_the_window_changes(power: int, record: float | None) -> None:
    def at(s: Complex) -> Complex:
        return respond(SPRINGS, VALUES, (MASS, DAMPING, STIFFNESS), s, OUT, FORCE, power, record).h()

    model = respond(SPRINGS, VALUES, (MASS, DAMPING, STIFFNESS), S, OUT, FORCE, power, record)
    assert near(along_s(model), central(lambda e: at(S + e), 1e-4), 1e-6)


def test_slopes_beside_hysteresis() -> None:
    """A stiffness that is complex."""

    def at(change: float) -> Complex:
        values = VALUES + change * np.eye(10)[1]
        return respond(SPRINGS, values, (MASS, DAMPING, STIFFNESS * (1 + 0.1j)), S, OUT, FORCE, 1, None).h()

    model = respond(SPRINGS, VALUES, (MASS, DAMPING, STIFFNESS * (1 + 0.1j)), S, OUT, FORCE, 1, None)
    found = gradient(model, by_springs(model)[0], SPRINGS.owner, 5)[..., 1]
    assert near(found, central(at, 1e-4 * SOFT[1]), 1e-5)
