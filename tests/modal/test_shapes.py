"""LSFD, refinement, scaling and window correction against systems with known modes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from identify.measured.frf_records import WindowEnd
from identify.measured.frf_set import FrfSet
from identify.modal.layout import Layout, arrange
from identify.modal.lsfd import contributions, lsfd, synthesise
from identify.modal.mac import mac
from identify.modal.refine import FULL, QUICK, Equations, Fit, fit, minimise
from identify.modal.scaling import scale
from identify.modal.settings import ModalSettings
from identify.modal.verify import covariance, leverage, noise_variance
from identify.modal.weights import reweighted
from identify.modal.window import frequency_and_damping, seen_through
from tests.modal.systems import System, chain, channels, measure

FREQUENCY = np.arange(20, 281) * 0.25
RESIDUALS = ("lower", "upper")
SYSTEM = chain([1.0, 20.0, 33.0, 36.0, 60.0, 900.0], [0.01, 0.01, 0.02, 0.015, 0.03, 0.01])
INSIDE = slice(1, 5)
"""Modes of SYSTEM in the band."""


def layout_of(noise: float = 0.0, seed: int = 0, system: System = SYSTEM) -> Layout:
    return arrange(measure(system, FREQUENCY, [0, 1], noise=noise, seed=seed), ModalSettings())


def refine(
    layout: Layout, poles: np.ndarray, participation: np.ndarray, kinds: tuple[str, ...], free: np.ndarray
) -> Fit:
    """As `verify` does it: weights from what is left, twice, then until nothing moves."""
    state = fit(Equations.of(layout, kinds), poles, participation, free)
    for effort in (QUICK, QUICK, FULL):
        state = minimise(fit(reweighted(state), state.poles, state.participation, free), *effort)
    return state


def test_shapes_and_residuals_rebuild_the_frfs() -> None:
    layout = layout_of()
    poles, shapes = SYSTEM.poles[INSIDE], SYSTEM.shapes[INSIDE]
    model = lsfd(layout, poles, shapes[:, :2], RESIDUALS)
    np.testing.assert_allclose(np.diag(mac(model.shapes, shapes)), 1, atol=1e-6)
    rebuilt = synthesise(model, layout.s, layout.power)
    assert np.linalg.norm(rebuilt - layout.frf) < 2e-3 * np.linalg.norm(layout.frf)
    without = synthesise(lsfd(layout, poles, shapes[:, :2], ()), layout.s, layout.power)
    assert np.linalg.norm(without - layout.frf) > 2 * np.linalg.norm(rebuilt - layout.frf)


def test_a_response_without_one_reference_gets_its_shape_from_the_other() -> None:
    data = measure(SYSTEM, FREQUENCY, [0, 1])
    frf = data.frf.copy()
    frf[:, 3, 1] = np.nan
    layout = arrange(replace(data, frf=frf), ModalSettings())
    model = lsfd(layout, SYSTEM.poles[INSIDE], SYSTEM.shapes[INSIDE, :2], RESIDUALS)
    np.testing.assert_allclose(np.diag(mac(model.shapes, SYSTEM.shapes[INSIDE])), 1, atol=1e-6)
    assert np.isnan(model.residuals["upper"][3, 1])


def test_a_mode_that_is_not_there_contributes_nothing() -> None:
    layout = layout_of(noise=1e-3)
    poles = np.append(SYSTEM.poles[INSIDE], 2 * np.pi * 48 * (-0.02 + 1j))
    participation = np.vstack([SYSTEM.shapes[INSIDE, :2], [1, 1]])
    share = contributions(layout, poles, participation, RESIDUALS)
    assert np.all(share[:4] > 0.1)
    assert share[4] < 0.01


def test_refinement_moves_wrong_poles_to_the_true_ones() -> None:
    layout, true = layout_of(noise=1e-3), SYSTEM.poles[INSIDE]
    start = true * np.array([1.002, 0.999, 1.003, 0.998]) + 0.3 * true.real
    found = refine(
        layout, start, SYSTEM.shapes[INSIDE, :2] * np.array([1.0, 0.8]), RESIDUALS, np.ones(4, dtype=bool)
    )
    assert np.all(np.abs(found.poles - true) < 0.01 * -true.real)
    assert np.all(np.abs(start - true) > 0.2 * -true.real)


def test_a_held_mode_does_not_move() -> None:
    start = SYSTEM.poles[INSIDE] * 1.001
    free = np.array([True, False, True, True])
    found = refine(layout_of(noise=1e-3), start, SYSTEM.shapes[INSIDE, :2], RESIDUALS, free)
    assert found.poles[1] == start[1]
    assert np.all(found.poles[free] != start[free])


def test_the_stated_covariance_is_the_scatter_over_noise() -> None:
    true = SYSTEM.poles[INSIDE]
    deviations = []
    for seed in range(40):
        found = refine(
            layout_of(noise=0.02, seed=seed),
            true,
            SYSTEM.shapes[INSIDE, :2],
            RESIDUALS,
            np.ones(4, dtype=bool),
        )
        std = np.sqrt(np.diagonal(covariance(found), axis1=1, axis2=2))
        deviations.append(np.stack([(found.poles - true).real, (found.poles - true).imag], axis=1) / std)
    inside = np.mean(np.abs(deviations) < 1)
    assert 0.6 < inside < 0.76  # 68 % of 320 numbers, give or take three standard deviations
    assert 0.92 < np.mean(np.abs(deviations) < 2) < 0.985


def test_noise_is_told_right_where_peaks_are_a_few_lines_wide() -> None:
    narrow = chain([1.0, 20.0, 33.0, 36.0, 60.0, 900.0], [0.01, 0.02, 0.012, 0.011, 0.0066, 0.01])
    frequency, free, told, taken = np.arange(20, 141) * 0.5, np.ones(4, dtype=bool), [], []
    for seed in range(20):
        layout = arrange(measure(narrow, frequency, [0], noise=0.003, seed=seed), ModalSettings())
        start = fit(
            Equations.of(layout, RESIDUALS), narrow.poles[INSIDE], narrow.shapes[INSIDE, :1] + 0j, free
        )
        found = minimise(start, *FULL)
        true = 0.003**2 * np.mean(np.abs(layout.frf) ** 2) / 2
        told.append(noise_variance(found) / true)
        peaks = np.searchsorted(frequency, narrow.poles[INSIDE].imag / (2 * np.pi))
        taken.append(np.mean(leverage(found)[peaks] / 2))
    assert np.mean(told) == pytest.approx(1, abs=0.05)
    # Negative control: where peaks are, the unknowns take a fifth of the noise, and what is left is less.
    assert np.mean(told) * (1 - np.mean(taken)) < 0.85


def test_a_resonance_that_residual_terms_replace_leaves_the_others_their_intervals() -> None:
    layout, kinds = layout_of(noise=1e-3), ("lower", "upper", "s^-1", "s^1", "s^-4", "s^-3", "s^2")
    poles = np.append(SYSTEM.poles[INSIDE], 2 * np.pi * (-0.04 + 0.3j))
    shapes = np.vstack([SYSTEM.shapes[INSIDE, :2], SYSTEM.shapes[:1, :2]])
    equations = Equations.of(layout, kinds)
    found = fit(equations, poles, shapes, np.ones(5, dtype=bool))
    alone = fit(equations, poles[:4], shapes[:4], np.ones(4, dtype=bool))
    deviation, expected = (np.sqrt(np.trace(covariance(f), axis1=1, axis2=2)) for f in (found, alone))
    np.testing.assert_allclose(deviation[:4], expected, rtol=0.05)
    # Negative control: of that resonance itself next to nothing is known.
    assert deviation[4] > 100 * -poles[4].real


def test_modal_mass_at_a_drive_point() -> None:
    layout = layout_of()
    model = lsfd(layout, SYSTEM.poles[INSIDE], SYSTEM.shapes[INSIDE, :2], RESIDUALS)
    shapes, mass_normalised = scale(model, layout)
    assert mass_normalised
    # The orthogonal shapes of `chain` have unit modal mass.
    true = np.linalg.qr(np.random.default_rng(0).normal(size=(6, 6)))[0].T[INSIDE]
    np.testing.assert_allclose(np.abs(shapes), np.abs(true), atol=0.01)


def test_without_a_drive_point_the_largest_component_is_one() -> None:
    layout = replace(layout_of(), references=channels(2, direction=1))
    model = lsfd(layout, SYSTEM.poles[INSIDE], SYSTEM.shapes[INSIDE, :2], RESIDUALS)
    shapes, mass_normalised = scale(model, layout)
    assert not mass_normalised
    largest = np.argmax(np.abs(shapes), axis=1)
    np.testing.assert_allclose(shapes[np.arange(4), largest], 1, atol=1e-3)


def windowed_hammer_test(decay: float, duration_s: float = 1.6) -> FrfSet:
    """Receptance by Fourier transform of a windowed time record of two decaying modes, 64 times
    oversampled.
    """
    count, rate = round(duration_s * 512 * 16), 512 * 16
    time = np.arange(count) / rate
    signal = np.zeros((count, 2))
    for frequency, damping, residue in ((20.0, 0.04, [1.0, 0.5]), (31.0, 0.05, [-0.7, 1.0])):
        omega = 2 * np.pi * frequency
        damped = omega * np.sqrt(1 - damping**2)
        signal += np.outer(np.exp(-damping * omega * time) * np.sin(damped * time) / damped, residue)
    spectrum = np.fft.rfft(signal * np.exp(-decay * time)[:, None], axis=0) / rate
    lines = np.arange(5, 110)
    sensors = channels(2)
    return FrfSet(
        lines / duration_s,
        spectrum[lines][:, :, None],
        sensors,
        sensors[:1],
        "receptance",
        window_decay_per_s=decay,
    )


@pytest.mark.parametrize("told", [True, False])
def test_damping_is_corrected_for_an_exponential_window_of_a_time_record(told: bool) -> None:
    decay = WindowEnd(percent=32.9, at_s=1.6).decay_per_s
    assert decay == pytest.approx(0.6948, abs=1e-4)
    data = windowed_hammer_test(decay)
    layout = arrange(data if told else replace(data, window_decay_per_s=0.0), ModalSettings())
    true = np.array([2 * np.pi * f * (-z + 1j * np.sqrt(1 - z**2)) for f, z in ((20.0, 0.04), (31.0, 0.05))])
    found = refine(layout, true, np.ones((2, 1), dtype=complex), ("upper",), np.ones(2, dtype=bool))
    frequency, damping = frequency_and_damping(found.poles)
    np.testing.assert_allclose(frequency, [20, 31], rtol=1e-3)
    if told:
        np.testing.assert_allclose(damping, [0.04, 0.05], rtol=0.01)
        seen = frequency_and_damping(seen_through(found.poles, decay))[1]
        np.testing.assert_allclose(seen - damping, decay / (2 * np.pi * np.array([20, 31])), rtol=0.01)
    else:  # negative control: without the correction the window counts as damping
        assert np.all(damping > [0.044, 0.053])
