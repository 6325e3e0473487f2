"""The whole analysis on simulated tests: automatic and manual choice, windows, roving hammers, directions,
uncertainty, nothing to find.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from identify.core.errors import InputError
from identify.measured.channel import Channel
from identify.measured.frf_set import FrfSet
from identify.modal.analysis import ModalAnalysis, analyse
from identify.modal.layout import arrange, cmif
from identify.modal.mac import mac
from identify.modal.scaling import reciprocity
from identify.modal.settings import ModalSettings
from tests.modal.systems import System, chain, measure

FREQUENCY = np.arange(4, 129) * 0.625
"""As a robot's hammer test: 2.5 to 80 Hz."""
ROBOT = chain([12.0, 16.7, 17.5, 27.4, 62.0, 150.0], [0.06, 0.07, 0.04, 0.08, 0.05, 0.1], seed=3)
INSIDE = slice(0, 5)


def errors(found: ModalAnalysis, system: System, modes: slice) -> tuple[np.ndarray, np.ndarray]:
    """Relative errors of frequency and damping; the table must have exactly these modes."""
    poles = system.poles[modes]
    assert len(found.table) == len(poles), found.table.frequency_hz
    frequency = found.table.frequency_hz / (np.abs(poles) / (2 * np.pi)) - 1
    return frequency, found.table.damping_ratio / (-poles.real / np.abs(poles)) - 1


@pytest.mark.parametrize("estimator", ["plscf", "lsce"])
@pytest.mark.parametrize("decay", [0.0, 0.695])
def test_all_modes_of_a_noisy_hammer_test_and_no_other(estimator: str, decay: float) -> None:
    found = analyse(
        measure(ROBOT, FREQUENCY, [0, 1, 2], noise=0.01, decay=decay), ModalSettings(estimator=estimator)
    )
    frequency, damping = errors(found, ROBOT, INSIDE)
    assert np.max(np.abs(frequency)) < 0.002
    assert np.max(np.abs(damping)) < 0.03
    assert np.min(np.diag(mac(found.table.shapes, ROBOT.shapes[INSIDE]))) > 0.99
    assert found.total_error < 0.03
    shift = decay / (2 * np.pi * found.table.frequency_hz)
    np.testing.assert_allclose(found.seen[1] - found.table.damping_ratio, shift, rtol=0.02, atol=1e-12)


@pytest.mark.parametrize("quantity", ["receptance", "mobility", "accelerance"])
def test_every_quantity_gives_the_same_modes(quantity: str) -> None:
    found = analyse(measure(ROBOT, FREQUENCY, [0, 1, 2], noise=1e-3, quantity=quantity))
    frequency, damping = errors(found, ROBOT, INSIDE)
    assert np.max(np.abs(frequency)) < 0.002
    assert np.max(np.abs(damping)) < 0.03
    assert found.table.modal_mass_kg is not None
    true = (
        1 / np.max(np.abs(np.linalg.qr(np.random.default_rng(3).normal(size=(6, 6)))[0]), axis=0)[INSIDE] ** 2
    )
    np.testing.assert_allclose(1 / np.max(np.abs(found.table.shapes), axis=1) ** 2, true, rtol=0.1)


def test_a_repeated_pole_is_two_modes() -> None:
    system = chain([20.0, 33.0, 33.05, 60.0], [0.01, 0.02, 0.02, 0.03])
    found = analyse(measure(system, np.arange(40, 401) * 0.25, [0, 1], noise=0.002))
    frequency, damping = errors(found, system, slice(0, 4))
    assert np.max(np.abs(frequency)) < 0.001
    assert np.max(np.abs(damping)) < 0.03


def test_responses_to_a_rotating_force_have_the_modes_of_the_structure() -> None:
    """Two forces at once, 1 and -j, one of them at a sensor: that makes no drive point."""
    one = measure(ROBOT, FREQUENCY, [0, 1], noise=0.003)
    frf = np.full_like(one.frf, np.nan)
    frf[:, :, 0] = one.frf @ [1, -1j]
    found = analyse(replace(one, frf=frf, simultaneous_inputs=(1, -1j)))
    frequency, damping = errors(found, ROBOT, INSIDE)
    assert np.max(np.abs(frequency)) < 0.003
    assert np.max(np.abs(damping)) < 0.05
    assert np.min(np.diag(mac(found.table.shapes, ROBOT.shapes[INSIDE]))) > 0.98
    assert found.table.modal_mass_kg is None
    with pytest.raises(InputError):
        analyse(replace(one, frf=frf))


def test_a_roving_hammer_gives_what_roving_accelerometers_give() -> None:
    fixed = measure(ROBOT, FREQUENCY, [0, 1], noise=0.003)
    roving = FrfSet(
        fixed.frequency_hz, fixed.frf.transpose(0, 2, 1), fixed.inputs, fixed.outputs, "accelerance"
    )
    one, other = analyse(fixed).table, analyse(roving).table
    np.testing.assert_array_equal(one.frequency_hz, other.frequency_hz)
    np.testing.assert_array_equal(one.shapes, other.shapes)
    assert one.channels == other.channels


@pytest.mark.parametrize("seeds", [5, pytest.param(20, marks=pytest.mark.exam)])
def test_the_true_values_lie_within_the_stated_deviations(seeds: int) -> None:
    deviations = []
    for seed in range(seeds):
        table = analyse(measure(ROBOT, FREQUENCY, [0, 1, 2], noise=0.02, seed=seed)).table
        true = ROBOT.poles[INSIDE]
        at = [int(np.argmin(np.abs(table.frequency_hz - abs(pole) / (2 * np.pi)))) for pole in true]
        deviations.append((table.frequency_hz[at] - np.abs(true) / (2 * np.pi)) / table.frequency_std_hz[at])
        deviations.append((table.damping_ratio[at] + true.real / np.abs(true)) / table.damping_std[at])
    assert np.mean(np.abs(deviations) < 2) > 0.95
    assert 0.6 < np.sqrt(np.mean(np.square(deviations))) < 1.1


def test_the_manual_choice_takes_these_and_says_what_it_left() -> None:
    data = measure(ROBOT, FREQUENCY, [0, 1, 2], noise=0.01)
    found = analyse(data, ModalSettings(modes_hz=(27.4, 12.0)))
    np.testing.assert_allclose(found.table.frequency_hz, [12, 27.4], rtol=0.02)
    assert any(
        "not chosen" in candidate.reason and abs(candidate.frequency_hz - 62) < 1
        for candidate in found.rejected
    )
    with pytest.raises(InputError, match=r"no cluster of poles within 2% of 200 Hz.*one of"):
        analyse(data, ModalSettings(modes_hz=(200.0,)))


def test_noise_alone_has_no_modes_and_reasons_are_given() -> None:
    data = measure(ROBOT, FREQUENCY, [0, 1, 2])
    random = np.random.default_rng(0)
    noise = replace(data, frf=random.normal(size=data.frf.shape) + 1j * random.normal(size=data.frf.shape))
    found = analyse(noise)
    assert len(found.table) == 0
    assert found.total_error > 0.9
    assert all(candidate.reason for candidate in found.rejected)


def test_criteria_reject_with_their_reason() -> None:
    data = measure(ROBOT, FREQUENCY, [0, 1, 2], noise=0.01)
    strict = analyse(data, ModalSettings(max_damping_ratio=0.075))
    np.testing.assert_allclose(strict.table.frequency_hz, [12, 16.7, 17.5, 62], rtol=0.01)
    assert analyse(data, ModalSettings(min_mpc=1.0)).rejected[0].reason
    assert any("MPC" in candidate.reason for candidate in analyse(data, ModalSettings(min_mpc=1.0)).rejected)
    assert any(
        "explains only" in candidate.reason
        for candidate in analyse(data, ModalSettings(min_contribution=0.9)).rejected
    )


def test_a_weak_mode_is_kept_while_noise_does_not_hide_it() -> None:
    system = chain([20.0, 33.0, 33.3, 60.0], [0.01, 0.02, 0.02, 0.03], seed=2)
    lines = np.arange(40, 401) * 0.25
    found = analyse(measure(system, lines, [0], noise=0.001))
    frequency, _ = errors(found, system, slice(0, 4))
    assert np.max(np.abs(frequency)) < 1e-3
    noisy = analyse(measure(system, lines, [0], noise=0.5))
    np.testing.assert_allclose(noisy.table.frequency_hz, [20.0, 33.0, 33.3, 60.0], rtol=0.005)
    hidden = analyse(measure(system, lines, [0], noise=1.0))
    assert len(hidden.table) < 4


def test_a_resonance_beyond_the_band_is_no_mode_but_helps_the_fit() -> None:
    system = chain([12.0, 30.0, 60.0, 88.0], [0.06, 0.05, 0.06, 0.05], seed=5)
    found = analyse(measure(system, FREQUENCY, [0, 1], noise=0.003))
    frequency, damping = errors(found, system, slice(0, 3))
    assert np.max(np.abs(frequency)) < 0.002
    assert np.max(np.abs(damping)) < 0.03
    assert found.total_error < 0.01
    np.testing.assert_allclose(np.abs(found.outside.poles) / (2 * np.pi), [88], rtol=0.01)
    assert any("beyond the band" in candidate.reason for candidate in found.rejected)


def test_unrefined_poles_are_the_medians_of_their_clusters() -> None:
    found = analyse(measure(ROBOT, FREQUENCY, [0, 1, 2], noise=0.01), ModalSettings(refine=False))
    np.testing.assert_allclose(found.model.poles, [mode.pole for mode in found.modes])
    frequency, _ = errors(found, ROBOT, INSIDE)
    assert np.max(np.abs(frequency)) < 0.01


def test_directions_apart_show_only_what_moves_that_way() -> None:
    # Two uncoupled chains: what moves along x never moves along y.
    x, y = chain([10.0, 30.0, 50.0], [0.02] * 3), chain([20.0, 40.0, 60.0], [0.02] * 3, seed=1)
    zero = np.zeros((3, 3))
    both = System(
        *(
            np.block([[getattr(x, name), zero], [zero, getattr(y, name)]])
            for name in ("mass", "damping", "stiffness")
        )
    )
    sensors = tuple(Channel(node, direction) for direction in (1, 2) for node in (1, 2, 3))
    data = measure(both, np.arange(8, 281) * 0.25, [0, 3], noise=0.002)
    data = replace(data, outputs=sensors, inputs=(sensors[0], sensors[3]))
    for direction, frequencies in (("X", [10, 30, 50]), ("Y", [20, 40, 60])):
        found = analyse(data, ModalSettings(direction=direction))
        np.testing.assert_allclose(found.table.frequency_hz, frequencies, rtol=1e-3)


def test_the_mode_indicator_peaks_at_the_modes() -> None:
    data = measure(chain([20.0, 33.0, 33.0], [0.01] * 3), np.arange(40, 201) * 0.25, [0, 1])
    values = cmif(arrange(data, ModalSettings()))
    assert values.shape == (161, 2)
    peaks = [k for k in range(1, 160) if values[k, 0] > max(values[k - 1, 0], values[k + 1, 0])]
    np.testing.assert_allclose(data.frequency_hz[peaks], [20, 33], atol=0.26)
    at_20, at_33 = (values[np.argmin(np.abs(data.frequency_hz - f))] for f in (20, 33))
    assert at_20[1] < 0.1 * at_20[0]
    assert at_33[1] > 0.3 * at_33[0]  # the second singular value shows the second mode there


def test_reciprocity_sees_a_turned_sensor_and_a_swapped_one() -> None:
    data = measure(ROBOT, FREQUENCY, [0, 1, 2])
    good = reciprocity(data)
    assert len(good) == 3
    assert max(check.error for check in good) < 1e-9
    turned = data.frf.copy()
    turned[:, 0] *= -1
    levels = {(check.a.node, check.b.node): check.level for check in reciprocity(replace(data, frf=turned))}
    assert levels[1, 2] == pytest.approx(-1)
    assert levels[2, 3] == pytest.approx(1)
    swapped = replace(data, outputs=(data.outputs[1], data.outputs[0], *data.outputs[2:]))
    assert min(check.frac for check in reciprocity(swapped)) < 0.9
    named = replace(data, frf=turned, outputs=(Channel(1, -3), *data.outputs[1:]))
    assert max(check.error for check in reciprocity(named)) < 1e-9


def test_the_input_is_left_as_it_was_and_the_result_is_repeatable() -> None:
    data = measure(ROBOT, FREQUENCY, [0, 1], noise=0.01)
    before = data.frf.copy()
    one, other = analyse(data), analyse(data)
    np.testing.assert_array_equal(data.frf, before)
    np.testing.assert_array_equal(one.table.frequency_hz, other.table.frequency_hz)
    np.testing.assert_array_equal(one.table.shapes, other.table.shapes)
