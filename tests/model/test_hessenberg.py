"""FRFs by the Hessenberg form against a solve per line, also where eigenvalues are no way; and the residual
that guards them.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from identify.core.arrays import Array
from identify.core.parameters import Scale
from identify.model import frf as frf_module
from identify.model import hessenberg
from identify.model.frf import end_added, frf, frf_by_solve
from identify.model.superposition import modal_form
from tests.arms import ALL_EFFECTS, arm, initial, system

S = 2j * np.pi * np.linspace(0.5, 150.0, 60)
Matrices = tuple[Array, Array, Array]


@pytest.fixture
def by_modes(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Grows by one for each call of the route through eigenvalues."""
    calls: list[int] = []
    route = frf_module._by_modes

    def counted(*given: object) -> object:
        calls.append(1)
        return route(*given)  # type: ignore[arg-type]

    monkeypatch.setattr(frf_module, "_by_modes", counted)
    return calls


def _error(matrices: Matrices, out: Array, force: Array, s: np.ndarray = S) -> float:
    """Largest at any line, relative to the largest FRF there."""
    found, expected = (route(*matrices, s, out, force, 2) for route in (frf, frf_by_solve))
    size = np.abs(expected).max(axis=(-2, -1))
    return float((np.abs(found - expected).max(axis=(-2, -1)) / size).max())


def _arm(folder: Path) -> tuple[Matrices, Array, Array]:
    model, parameters, _ = system(arm(folder), ALL_EFFECTS)
    out = model.jacobian("link6", np.array([0.1, 0.0, 0.1]))
    return model.matrices(initial(parameters)), out, model.jacobian("link3", np.zeros(3))[2:3].T


@pytest.mark.parametrize("kind", ["plain", "hysteretic", "moving", "windowed"])
def test_an_arm_of_any_kind(tmp_path: Path, by_modes: list[int], kind: str) -> None:
    (mass, damping, stiffness), out, force = _arm(tmp_path)
    if kind == "hysteretic":
        stiffness = stiffness + 0.03j * stiffness
    if kind == "moving":
        turning = np.random.default_rng(0).normal(size=damping.shape) * damping.max() / 10
        damping = damping + turning - turning.T
    s = S + 4.0 if kind == "windowed" else S
    assert _error((mass, damping, stiffness), out, force, s) < 1e-11
    assert not by_modes


def test_any_values_that_a_fit_may_try(tmp_path: Path, by_modes: list[int]) -> None:
    """Stiffnesses apart by five orders of magnitude, where eigenvalues are not as exact."""
    model, parameters, _ = system(
        arm(tmp_path), [{"kind": "joint-compliance", "axes": ["rx", "ry", "rz", "tx"]}]
    )
    scale = Scale(tuple(parameters))
    low, high = scale.bounds()
    drawn = low + (high - low) * np.random.default_rng(0).uniform(size=(40, len(low)))
    matrices = model.matrices(np.array([scale.to_values(x) for x in drawn]))
    out = model.jacobian("link6", np.zeros(3))
    assert _error(matrices, out, out[:1].T) < 1e-10
    assert not by_modes
    assert all(modal_form(*(one[n] for one in matrices), S, out[:1].T) is not None for n in range(40))


@pytest.mark.parametrize("apart", [0.0, 1e-14, 1e-9, 1e-4])
def test_defective_and_nearly_so(by_modes: list[int], apart: float) -> None:
    """Critical damping: two equal eigenvalues with one eigenvector, by which `modal_form` is no way."""
    stiffness = np.array([[3e4, -1e4], [-1e4, 3e4]])
    values, shapes = np.linalg.eigh(stiffness)
    damping = shapes * (2 * np.sqrt(values) * (1 + apart)) @ shapes.T
    matrices, force = (np.eye(2), damping, stiffness), np.array([[1.0], [0.2]])
    assert _error(matrices, np.eye(2), force) < 1e-12
    assert not by_modes
    assert (modal_form(*matrices, S, force) is None) == (apart < 1e-4)


def test_a_force_that_does_not_reach_all(by_modes: list[int]) -> None:
    """Two chains without a connection, and one coordinate alone: entries below the diagonal are zero."""
    chain = np.diag([2e4, 3e4, 1e4, 5e4, 7e4])
    chain[0, 1] = chain[1, 0] = chain[2, 3] = chain[3, 2] = -5e3
    matrices = np.diag([1.0, 2.0, 1.0, 3.0, 1.0]), 1e-3 * chain, chain
    for force in np.eye(5):
        assert _error(matrices, np.eye(5), force[:, None]) < 1e-12
    assert _error((np.eye(1), np.eye(1), 1e4 * np.eye(1)), np.eye(1), np.eye(1)) < 1e-13
    assert not by_modes


def test_several_forces_at_few_lines(tmp_path: Path, by_modes: list[int]) -> None:
    matrices, out, _ = _arm(tmp_path)
    assert _error(matrices, out, out[:3].T) < 1e-11
    assert not by_modes
    assert _error(matrices, out, out[:4].T) < 1e-8
    assert by_modes


def test_the_end_of_the_record_by_both_routes(tmp_path: Path) -> None:
    """With a record the modes are needed anyway; without one they are not asked."""
    matrices, out, force = _arm(tmp_path)
    s, record = S + 2.0, 0.5
    ended, whole = (frf(*matrices, s, out, force, 2, length) for length in (record, None))
    added = end_added(matrices, s, out, force, 2, record)
    assert np.abs(added).max() > 1e-3 * np.abs(whole).max()
    assert ended == pytest.approx(whole + added, rel=1e-8, abs=1e-9 * np.abs(whole).max())


def test_the_residual_notices_a_wrong_form(
    tmp_path: Path, by_modes: list[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Negative control: one part in a million of the form, which without the residual is a wrong FRF."""
    matrices, out, force = _arm(tmp_path)
    reduced = hessenberg._reduced

    def wrong(state: Array) -> tuple[Array, Array]:
        form, turned = reduced(state)
        return form * (1 + 1e-6), turned

    monkeypatch.setattr(hessenberg, "_reduced", wrong)
    assert _error(matrices, out, force) < 1e-8
    assert len(by_modes) == 1
    monkeypatch.setattr(frf_module, "TOLERANCE", np.inf)
    assert _error(matrices, out, force) > 1e-7
    assert len(by_modes) == 1


def test_only_the_model_that_needs_it_takes_the_slow_way(by_modes: list[int]) -> None:
    """A negative mass that leaves no dynamic stiffness at the rate of the shift, in a population."""
    rate = np.sqrt(np.abs(S).min() * np.abs(S).max())
    mass = np.array([np.eye(2), np.diag([-1.0, 1.0]), 2 * np.eye(2)])
    stiffness = np.tile(np.diag([rate**2, 2e4]), (3, 1, 1))
    matrices = mass, np.zeros((3, 2, 2)), stiffness
    assert _error(matrices, np.eye(2), np.array([[1.0], [1.0]])) < 1e-9
    assert len(by_modes) == 1
