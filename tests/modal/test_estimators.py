"""pLSCF and LSCE: exact on clean data, the same poles by both, and what they leave out."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from identify.modal import plscf
from identify.modal.mac import mac
from identify.modal.poles import Band, moments, pole_set
from tests.modal.systems import chain, measure

FREQUENCY = np.arange(40, 401) * 0.25
ESTIMATORS = [plscf.denominators, plscf.denominators]


def nearest(found: np.ndarray, true: np.ndarray) -> np.ndarray:
    return np.array([np.argmin(np.abs(found - pole)) for pole in true])


@pytest.mark.parametrize("denominators", ESTIMATORS)
def test_poles_shapes_and_participation_of_a_clean_system(denominators) -> None:
    system = chain([20.0, 33.0, 33.6, 60.0], [0.01, 0.02, 0.015, 0.03])
    frf = measure(system, FREQUENCY, [0, 2], quantity="receptance").frf
    *_, beta = denominators(frf, range(2, 31))
    found = pole_set(beta, moments(frf, 30), Band.of(FREQUENCY), 0.2)
    at = nearest(found.poles, system.poles)
    error = np.abs(found.poles[at] - system.poles)
    assert np.all(error < 0.02 * -system.poles.real)
    assert np.min(np.diag(mac(found.shapes[at], system.shapes))) > 0.999
    # With reciprocity the participation is the shape at the inputs.
    assert np.min(np.diag(mac(found.participation[at], system.shapes[:, [0, 2]]))) > 0.99


def test_two_references_resolve_a_repeated_pole_and_one_does_not() -> None:
    system = chain([20.0, 33.0, 33.0, 60.0], [0.01, 0.02, 0.02, 0.03])
    data = measure(system, FREQUENCY, [0, 1], noise=1e-4)
    counts = []
    for inputs in ([0, 1], [0]):
        frf = data.frf[:, :, inputs]
        *_, beta = plscf.denominators(frf, range(2, 16))
        found = pole_set(beta, moments(frf, 15), Band.of(FREQUENCY), 0.2)
        near = np.abs(found.poles - system.poles[1]) < 0.2 * -system.poles[1].real
        counts.append(int(near.sum()))
    assert counts[0] >= 2 > counts[1]


@pytest.mark.parametrize("denominators", ESTIMATORS)
def test_every_order_has_its_size_and_one_as_lowest_coefficient(denominators) -> None:
    frf = measure(chain([20.0, 60.0], [0.01, 0.02]), FREQUENCY, [0, 1], noise=0.01).frf
    sizes = [beta.shape for beta in denominators(frf, range(3, 7))]
    assert sizes == [(p + 1, 2, 2) for p in range(3, 7)]
    for beta in denominators(frf, range(3, 7)):
        np.testing.assert_array_equal(beta[0], np.eye(2))


def test_the_fast_normal_equations_minimise_the_linearised_error() -> None:
    frf = measure(chain([20.0, 60.0], [0.01, 0.02]), FREQUENCY, [0, 1], noise=0.05).frf
    order, lines = 4, len(FREQUENCY)
    *_, beta = plscf.denominators(frf, range(2, order + 1))
    z = np.exp(-2j * np.pi * np.arange(lines) / lines)
    basis = z[:, None] ** np.arange(order + 1)
    reference = []
    for response in range(2):
        right = np.concatenate([basis[:, b, None] * frf[:, response] for b in range(order + 1)], axis=1)
        # Eliminate the numerators the slow way.
        reference.append(right - basis @ np.linalg.lstsq(basis, right, rcond=None)[0])
    rows = np.concatenate(reference)
    slow = np.linalg.lstsq(rows[:, 2:], -rows[:, :2], rcond=None)[0].reshape(order, 2, 2)
    np.testing.assert_allclose(beta[1:], slow, rtol=1e-6, atol=1e-8)


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 1000), st.floats(12.0, 95.0), st.floats(0.002, 0.08))
def test_one_mode_anywhere_in_the_band(seed: int, natural_hz: float, damping: float) -> None:
    system = chain([natural_hz, 300.0], [damping, 0.01], seed)
    frf = measure(system, FREQUENCY, [0], noise=1e-5, seed=seed).frf
    *_, beta = plscf.denominators(frf, range(2, 25))
    found = pole_set(beta, moments(frf, 24), Band.of(FREQUENCY), 0.3)
    assert np.min(np.abs(found.poles - system.poles[0])) < 0.05 * -system.poles[0].real


def test_growing_and_overdamped_poles_are_left_out() -> None:
    frf = measure(chain([20.0, 60.0], [0.01, 0.02]), FREQUENCY, [0, 1], noise=0.1).frf
    *_, beta = plscf.denominators(frf, range(2, 31))
    found = pole_set(beta, moments(frf, 30), Band.of(FREQUENCY), 0.05)
    assert np.all(found.poles.real < 0)
    assert np.all(-found.poles.real <= 0.05 * np.abs(found.poles))
    assert len(found.poles) < 60
