"""Modes: poles against peaks and closed forms, undamped against lightly damped, sensitivities against
differences.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from identify.core.threads import each
from identify.model import modes as modes_module
from identify.model.frf import frf_by_solve
from identify.model.modes import (
    complex_modes,
    eigenvalue_gradient,
    frequency_and_damping_gradient,
    state_eigen,
)
from tests.arms import ALL_EFFECTS, arm, initial, system
from tests.model.undamped import undamped_modes


def test_one_degree_of_freedom_in_closed_form() -> None:
    m, c, k = 2.0, 3.0, 4e4
    modes = complex_modes(np.array([[m]]), np.array([[c]]), np.array([[k]]))
    assert modes.frequency_hz == pytest.approx([np.sqrt(k / m) / (2 * np.pi)])
    assert modes.damping_ratio == pytest.approx([c / (2 * np.sqrt(k * m))])


def test_overdamped_modes_have_no_frequency_and_are_left_out() -> None:
    modes = complex_modes(np.eye(2), np.diag([1.0, 1e4]), np.diag([100.0, 100.0]))
    assert modes.frequency_hz == pytest.approx([10 / (2 * np.pi)])


def test_eigenvectors_solve_the_quadratic_problem_and_are_scaled(tmp_path: Path) -> None:
    model, parameters, _ = system(arm(tmp_path), ALL_EFFECTS)
    mass, damping, stiffness = model.matrices(initial(parameters))
    modes = complex_modes(mass, damping, stiffness)
    for value, shape in zip(modes.eigenvalues, modes.shapes, strict=True):
        residual = (value**2 * mass + value * damping + stiffness) @ shape
        assert np.abs(residual).max() < 1e-7 * np.abs(stiffness @ shape).max()
        assert shape @ (2 * value * mass + damping) @ shape == pytest.approx(1.0)


def test_without_damping_complex_and_undamped_modes_agree(tmp_path: Path) -> None:
    model, parameters, _ = system(arm(tmp_path), ALL_EFFECTS)
    mass, _, stiffness = model.matrices(initial(parameters))
    frequencies, shapes = undamped_modes(mass, stiffness)
    assert complex_modes(mass, 0 * mass, stiffness).frequency_hz == pytest.approx(frequencies, rel=1e-7)
    assert shapes @ mass @ shapes.T == pytest.approx(np.eye(len(frequencies)), abs=1e-8)


def test_poles_are_where_the_frf_peaks(tmp_path: Path) -> None:
    model, parameters, _ = system(
        arm(tmp_path), [{"kind": "joint-compliance", "damping": {"damping_ratio": 0.003}}]
    )
    matrices = model.matrices(initial(parameters))
    first = complex_modes(*matrices).frequency_hz[0]
    f = np.linspace(0.9 * first, 1.1 * first, 2001)
    out = model.jacobian("link6", np.zeros(3))
    h = frf_by_solve(*matrices, 2j * np.pi * f, out, out.T, 0)
    assert f[np.argmax(np.linalg.norm(h, axis=(1, 2)))] == pytest.approx(first, rel=2e-3)


def test_sensitivities_against_central_differences(tmp_path: Path) -> None:
    model, parameters, _ = system(arm(tmp_path, seed=2), ALL_EFFECTS, seed=2)
    values = initial(parameters)
    modes = complex_modes(*model.matrices(values))
    slopes = eigenvalue_gradient(modes, model.factors, len(values))
    frequency, damping = frequency_and_damping_gradient(modes, model.factors, len(values))
    kept = np.arange(8)  # far beyond the band modes cluster, and differences lose digits
    for number, value in enumerate(values):
        step = 1e-4 * value * (np.arange(len(values)) == number)
        plus, minus = (
            complex_modes(*model.matrices(values + step)),
            complex_modes(*model.matrices(values - step)),
        )
        for name, exact in (("eigenvalues", slopes), ("frequency_hz", frequency), ("damping_ratio", damping)):
            expected = (getattr(plus, name) - getattr(minus, name))[kept] / (2 * step[number])
            scale = np.abs(getattr(modes, name)[kept]).max() / value
            assert exact[kept, number] == pytest.approx(expected, rel=1e-5, abs=1e-7 * scale), (
                parameters[number].name,
                name,
            )


def test_eigenvalues_are_the_same_in_however_many_threads(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """And they are taken in so many, where they take some time."""
    model, parameters, _ = system(arm(tmp_path), ALL_EFFECTS)
    population = initial(parameters) * np.exp(
        np.random.default_rng(0).normal(size=(3, 10, len(parameters))) * 0.3
    )
    asked: list[int] = []

    def counted(work, parts):  # type: ignore[no-untyped-def]
        asked.append(len(parts))
        return each(work, parts)

    monkeypatch.setattr(modes_module, "each", counted)
    found = []
    for threads in (1, 2, 3):
        monkeypatch.setattr(modes_module, "threads", lambda threads=threads: threads)
        found.append(state_eigen(*model.matrices(population)))
        state_eigen(*model.matrices(population[0, 0]))
    assert asked == [1, 1, 2, 1, 3, 1]
    for values, shapes in found[1:]:
        assert np.array_equal(values, found[0][0])
        assert np.array_equal(shapes, found[0][1])


def test_a_model_that_is_not_finite_has_no_modes_and_spoils_no_other() -> None:
    mass, damping = np.tile(np.eye(2), (3, 1, 1)), np.zeros((3, 2, 2))
    stiffness = np.array([np.diag([1.0, 4.0])] * 3)
    stiffness[1, 0, 0] = np.inf
    values, shapes = state_eigen(mass, damping, stiffness)
    assert np.isnan(values[1]).all() and np.isnan(shapes[1]).all()
    for alone in (0, 2):
        assert sorted(values[alone].imag) == pytest.approx([-2, -1, 1, 2])
    assert not complex_modes(mass[1], damping[1], stiffness[1]).eigenvalues.size
