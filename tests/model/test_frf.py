"""FRFs and sensitivities by independent routes: eigenvalues against solves, exact gradients against complex
steps, reciprocity.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from identify.model.frf import dynamic_stiffness, frf, frf_and_gradient, frf_by_solve
from tests.arms import ALL_EFFECTS, arm, initial, system

S = 3.0 + 2j * np.pi * np.linspace(1.0, 120.0, 37)


def test_one_degree_of_freedom_in_closed_form() -> None:
    m, c, k = 2.0, 3.0, 4e4
    found = frf(np.array([[m]]), np.array([[c]]), np.array([[k]]), S, np.ones((1, 1)), np.ones((1, 1)), 2)[
        :, 0, 0
    ]
    assert found == pytest.approx(S**2 / (k + S * c + S**2 * m), rel=1e-12)


def test_an_ordinary_arm_needs_no_solve_per_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The route through the eigenvalues measures its own error, and an error in it would pass as slowness."""

    def solved(*_: object) -> None:
        raise AssertionError("solved line by line")

    monkeypatch.setattr("identify.model.frf.frf_by_solve", solved)
    model, parameters, _ = system(arm(tmp_path), ALL_EFFECTS)
    matrices, out = model.matrices(initial(parameters)), model.jacobian("link6", np.zeros(3))
    assert np.isfinite(frf(*matrices, S, out, out.T, 2)).all()
    defective = np.eye(2), 2 * np.eye(2), np.eye(2)
    with pytest.raises(AssertionError, match="line by line"):
        frf(*defective, S, np.eye(2), np.eye(2), 2)


@pytest.mark.parametrize("power", [0, 1, 2])
def test_eigenvalues_and_solves_agree_on_a_full_arm(tmp_path: Path, power: int) -> None:
    robot = arm(tmp_path)
    model, parameters, _ = system(robot, ALL_EFFECTS)
    matrices = model.matrices(initial(parameters))
    out, force = model.jacobian("link6", np.array([0.1, 0.0, 0.1])), model.jacobian("link3", np.zeros(3)).T
    one, other = (route(*matrices, S, out, force, power) for route in (frf, frf_by_solve))
    assert one == pytest.approx(other, rel=1e-9, abs=1e-10 * np.abs(other).max())


@pytest.mark.parametrize(("lines", "solved"), [(32, True), (33, False)])
def test_few_lines_are_solved_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, lines: int, solved: bool
) -> None:
    """16 for each input, and the same as by recurrences."""
    model, parameters, _ = system(arm(tmp_path), ALL_EFFECTS)
    values = initial(parameters)
    mass, damping, stiffness = model.matrices(np.stack([values, 1.2 * values]))
    s, force = 2j * np.pi * np.linspace(2.0, 90.0, lines), model.jacobian("link3", np.zeros(3)).T[:, :2]
    at = (s, model.jacobian("link6", np.zeros(3)), force, 2)
    by_recurrence = frf(mass, damping, stiffness, *at)
    monkeypatch.setattr("identify.model.frf._SOLVED", 16)
    found = frf(mass, damping, stiffness, *at)
    assert found == pytest.approx(by_recurrence, rel=1e-8, abs=1e-9 * np.abs(found).max())
    assert np.array_equal(found, frf_by_solve(mass, damping, stiffness, *at)) == solved
    monkeypatch.setattr("identify.model.frf._AT_ONCE", 1)
    assert np.array_equal(frf(mass, damping, stiffness, *at), found)


def test_population_is_evaluated_as_its_members(tmp_path: Path) -> None:
    model, parameters, _ = system(arm(tmp_path), ALL_EFFECTS)
    population = initial(parameters) * np.exp(
        np.random.default_rng(0).normal(size=(5, len(parameters))) * 0.3
    )
    out = model.jacobian("link6", np.zeros(3))
    together = frf(*model.matrices(population), S, out, out.T, 2)
    apart = [frf(*model.matrices(values), S, out, out.T, 2) for values in population]
    assert together.shape == (5, len(S), 6, 6)
    assert together == pytest.approx(np.array(apart), rel=1e-8, abs=1e-12)


def test_reciprocity_holds_and_a_velocity_coupling_would_break_it(tmp_path: Path) -> None:
    model, parameters, _ = system(arm(tmp_path), ALL_EFFECTS)
    mass, damping, stiffness = model.matrices(initial(parameters))
    out = model.jacobian("link6", np.zeros(3))
    h = frf(mass, damping, stiffness, S, out, out.T, 0)
    assert h == pytest.approx(np.swapaxes(h, 1, 2), rel=1e-8, abs=1e-9 * np.abs(h).max())
    gyroscopic = np.triu(np.ones_like(damping), 1) * damping.max()
    broken = frf_by_solve(mass, damping + gyroscopic - gyroscopic.T, stiffness, S, out, out.T, 0)
    assert np.abs(broken - np.swapaxes(broken, 1, 2)).max() > 1e-3 * np.abs(broken).max()


def test_gradient_against_complex_steps(tmp_path: Path) -> None:
    model, parameters, _ = system(arm(tmp_path, seed=4), ALL_EFFECTS, seed=4)
    values, numbers = initial(parameters), np.arange(len(parameters))
    out, force = (
        model.jacobian("link6", np.array([0.1, 0.2, 0.3])),
        model.jacobian("link2", np.zeros(3)).T[:, :2],
    )
    h, gradient = frf_and_gradient(model.matrices(values), model.factors, S, out, force, 2, numbers)
    assert h == pytest.approx(frf_by_solve(*model.matrices(values), S, out, force, 2), rel=1e-9, abs=1e-15)
    for number, value in enumerate(values):
        # H is analytic in each parameter: the mean over four directions in the complex plane is exact to the
        # fourth order.
        step, expected = 1e-3 * value, 0.0
        for direction in (1, 1j, -1, -1j):
            moved = values + step * direction * (numbers == number)
            expected = expected + frf_by_solve(*_complex_matrices(model, moved), S, out, force, 2) / (
                4 * step * direction
            )
        error = np.abs(gradient[..., number] - expected).max()
        assert error < 1e-6 * np.abs(expected).max(), parameters[number].name


def _complex_matrices(model, values):  # type: ignore[no-untyped-def]
    k, c, m = (
        np.tensordot(values, model.terms[role][:], axes=1) for role in ("stiffness", "damping", "mass")
    )
    return model.mass + m, c, model.stiffness + k


def test_gradient_of_some_parameters_is_a_part_of_that_of_all(tmp_path: Path) -> None:
    model, parameters, _ = system(arm(tmp_path), ALL_EFFECTS)
    out = model.jacobian("link6", np.zeros(3))
    everything = frf_and_gradient(
        model.matrices(initial(parameters)), model.factors, S, out, out.T, 1, np.arange(len(parameters))
    )[1]
    some = np.array([1, 5, len(parameters) - 3])
    part = frf_and_gradient(model.matrices(initial(parameters)), model.factors, S, out, out.T, 1, some)[1]
    assert np.array_equal(part, everything[..., some])


def test_effect_of_locking_is_the_limit_of_stiffening(tmp_path: Path) -> None:
    robot = arm(tmp_path)
    drive = {"kind": "joint-compliance", "axes": ["rz"]}
    free, parameters, _ = system(robot, [drive, {"kind": "base-compliance", "axes": ["rx"]}])
    locked, _, _ = system(robot, [drive])
    values = initial(parameters)
    stiff = np.where(
        [parameter.name.startswith("base.rx.stiffness") for parameter in parameters], 1e15, values
    )
    point = np.array([0.1, 0.0, 0.2])
    one = frf(*free.matrices(stiff), S, free.jacobian("link6", point), free.jacobian("link6", point).T, 2)
    other = frf(
        *locked.matrices(values[:-2]),
        S,
        locked.jacobian("link6", point),
        locked.jacobian("link6", point).T,
        2,
    )
    assert one == pytest.approx(other, rel=1e-5, abs=1e-7 * np.abs(other).max())


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(1, 6), st.floats(0.0, 3.0))
def test_any_system_defective_or_overdamped_is_right(seed: int, size: int, damping_scale: float) -> None:
    rng = np.random.default_rng(seed)
    a = rng.normal(size=(size, size))
    mass = a @ a.T + 0.1 * np.eye(size)
    stiffness = np.diag(10 ** rng.uniform(0, 6, size)) * rng.integers(0, 2, size)  # some coordinates are free
    damping = damping_scale * np.diag(np.sqrt(np.diag(stiffness) * np.diag(mass)))
    out = rng.normal(size=(2, size))
    found = frf(mass, damping, stiffness, S, out, out.T, 1)
    z = dynamic_stiffness(mass, damping, stiffness, S)
    expected = S[:, None, None] * (out @ np.linalg.inv(z) @ out.T)
    assert found == pytest.approx(expected, rel=1e-5, abs=1e-6 * np.abs(expected).max())
