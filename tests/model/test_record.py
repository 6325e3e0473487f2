"""FRFs of records that end too early: against a plain sum over time, two routes, and exact gradients."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from identify.model.effects.base import parse_effect
from identify.model.frf import end_added, frf, frf_and_gradient, frf_by_solve, frf_slope
from identify.model.modes import state_eigen
from identify.model.truncation import end_by_matrices, end_of_record, left_at_end, rest_by_exponential
from tests.arms import ALL_EFFECTS, arm, initial, system
from tests.targets import model, predictor

S = 0.5 + 2j * np.pi * np.array([4.0, 9.0, 17.0, 33.0])
T = 0.4


@pytest.mark.parametrize("power", [0, 1, 2])
def test_frf_of_a_short_record_is_the_sum_over_that_record(power: int) -> None:
    m, c, k = 2.0, 3.0, 2.0 * (2 * np.pi * 9) ** 2
    speed, decay = np.sqrt(k / m - (c / m / 2) ** 2), c / m / 2
    t = np.arange(0, T, 1e-5) + 5e-6
    x = np.exp(-decay * t) * np.sin(speed * t) / (m * speed)
    v = np.exp(-decay * t) * (np.cos(speed * t) - decay / speed * np.sin(speed * t)) / m
    motion = {0: x, 1: v, 2: -(c * v + k * x) / m}[power]
    expected = np.array([np.sum(motion * np.exp(-s * t)) * 1e-5 for s in S]) + (
        1 / m if power == 2 else 0
    )  # the impact itself
    matrices = [np.array([[value]]) for value in (m, c, k)]
    found = frf(*matrices, S, np.ones((1, 1)), np.ones((1, 1)), power, T)[:, 0, 0]
    assert found == pytest.approx(expected, rel=1e-5)
    assert (
        np.abs(frf(*matrices, S, np.ones((1, 1)), np.ones((1, 1)), power)[:, 0, 0] / expected - 1).max() > 0.1
    )


@pytest.mark.parametrize("power", [0, 1, 2])
def test_modes_and_matrix_exponentials_agree_for_a_population(power: int, tmp_path: Path) -> None:
    arm_model, parameters, _ = system(arm(tmp_path), ALL_EFFECTS)
    population = initial(parameters) * np.exp(
        0.2 * np.random.default_rng(0).normal(size=(3, len(parameters)))
    )
    matrices, out = arm_model.matrices(population), arm_model.jacobian("link6", np.zeros(3))
    cut = frf(*matrices, S, out, out.T, power, T)
    whole, rest = (
        frf_by_solve(*matrices, S, out, out.T, power),
        rest_by_exponential(*matrices, S, out, out.T, power, T),
    )
    assert cut == pytest.approx(whole - rest, rel=1e-7, abs=1e-9 * np.abs(whole).max())
    assert np.abs(rest).max() > 1e-3 * np.abs(whole).max()


@pytest.mark.parametrize("damping", [12.0, 20.0])
def test_records_of_a_population_may_end_at_different_times(damping: float) -> None:
    """Also where one of its systems is defective (critically damped)."""
    stiffness = np.array([80.0, 100.0, 130.0])[:, None, None]
    mass, c = np.ones((3, 1, 1)), np.full((3, 1, 1), damping)
    ends, one = np.array([0.2, 0.3, 0.25]), np.ones((1, 1))
    together = frf(mass, c, stiffness, S, one, one, 2, ends)
    alone = [frf(mass[n], c[n], stiffness[n], S, one, one, 2, float(ends[n])) for n in range(3)]
    assert together == pytest.approx(np.array(alone), rel=1e-7)
    assert frf(mass, c, stiffness, S, one, one, 2, ends[::-1]) != pytest.approx(np.array(alone), rel=1e-2)


def test_a_defective_system_takes_the_exponential() -> None:
    matrices = [np.array([[value]]) for value in (1.0, 20.0, 100.0)]  # critically damped
    z = S + 10
    expected = 1 / z**2 - np.exp(-0.2 * z) * (0.2 / z + 1 / z**2)  # the integral of t e^(-zt) to 0.2
    assert frf(*matrices, S, np.ones((1, 1)), np.ones((1, 1)), 0, 0.2)[:, 0, 0] == pytest.approx(
        expected, rel=1e-9
    )


@pytest.mark.parametrize("power", [0, 1, 2])
def test_gradients_are_exact(power: int, tmp_path: Path) -> None:
    arm_model, parameters, _ = system(arm(tmp_path, seed=4), ALL_EFFECTS, seed=4)
    values, numbers = initial(parameters), np.random.default_rng(0).permutation(len(parameters))[:15]
    out, force = (
        arm_model.jacobian("link6", np.array([0.1, 0.2, 0.3])),
        arm_model.jacobian("link2", np.zeros(3)).T[:, :2],
    )

    def cut(moved: np.ndarray, s: np.ndarray = S) -> np.ndarray:
        matrices = arm_model.matrices(moved)
        return frf_by_solve(*matrices, s, out, force, power) - rest_by_exponential(
            *matrices, s, out, force, power, T
        )

    matrices = arm_model.matrices(values)
    h, gradient = frf_and_gradient(matrices, arm_model.factors, S, out, force, power, numbers, T)
    whole = frf_and_gradient(matrices, arm_model.factors, S, out, force, power, numbers)[1]
    assert h == pytest.approx(cut(values), rel=1e-8, abs=1e-9 * np.abs(h).max())
    assert np.abs(gradient - whole).max() > 1e-3 * np.abs(gradient).max()
    for column, number in enumerate(numbers):
        step = 1e-4 * values[number] * (np.arange(len(values)) == number)
        near, far = (cut(values + size * step) - cut(values - size * step) for size in (1, 2))
        expected = (8 * near - far) / 12 / step.max()
        assert np.abs(gradient[..., column] - expected).max() < 1e-5 * np.abs(expected).max(), parameters[
            number
        ].name
    slope = (cut(values, S + 1e-4) - cut(values, S - 1e-4)) / 2e-4
    assert frf_slope(matrices, S, out, force, power, T) == pytest.approx(
        slope, rel=1e-6, abs=1e-6 * np.abs(slope).max()
    )


def test_a_response_that_dies_out_is_left_alone(tmp_path: Path) -> None:
    arm_model, parameters, _ = system(arm(tmp_path), ALL_EFFECTS)
    matrices, unit = arm_model.matrices(initial(parameters)), np.eye(len(arm_model.coordinates))
    assert end_of_record(matrices, arm_model.factors, S + 40.0, unit, 2.0, np.arange(3)) is None
    assert np.array_equal(
        frf(*matrices, S + 40.0, unit, unit, 2, 2.0), frf(*matrices, S + 40.0, unit, unit, 2)
    )


def test_targets_know_their_record_where_impacts_were_windowed(tmp_path: Path) -> None:
    effects = [
        parse_effect({"kind": "joint-compliance"}),
        parse_effect({"kind": "window-decay", "error": {"initial": 0.3}}),
    ]
    arm_system, parameters = model(arm(tmp_path), effects)
    target, values = predictor(arm_system, lines=40, band=(4.0, 43.0)), initial(parameters)
    assert target.record == pytest.approx(1.0)
    h, gradient = target.gradient(values, np.arange(len(values)))
    assert h == pytest.approx(target.predict(values), rel=1e-8)
    whole = replace(target, record=None).predict(values)
    assert np.abs(h - whole).max() > 1e-3 * np.abs(whole).max()
    step = np.zeros(len(values))
    step[-1] = 1e-4
    assert gradient[..., -1] == pytest.approx(
        (target.predict(values + step) - target.predict(values - step)) / 2e-4, rel=1e-5
    )
    assert predictor(arm_system, lines=1).record is None


def test_an_unstable_model_has_no_rest_and_spoils_no_population() -> None:
    """A negative mass, as an optimizer may try, beside a sound model."""
    mass, damping, stiffness = (
        np.array(values)[:, None, None] for values in ([2.0, -2.0], [3.0, 3.0], [900.0, 900.0])
    )
    one = np.ones((1, 1))
    together = frf(mass, damping, stiffness, S, one, one, 2, T)
    apart = [frf(mass[n], damping[n], stiffness[n], S, one, one, 2, T) for n in range(2)]
    assert together == pytest.approx(np.array(apart), rel=1e-12)
    # What grows is left out; what decays beside it is missing what it does beyond the record.
    decays = np.roots([-2.0, 3.0, 900.0]).min()
    rest = decays**2 * np.exp((decays - S) * T) / (S - decays) / (2 * -2.0 * decays + 3.0)
    whole = frf(mass[1], damping[1], stiffness[1], S, one, one, 2)
    assert apart[1] == pytest.approx(whole - rest[:, None, None], rel=1e-12)
    assert np.abs(apart[0] / frf(mass[0], damping[0], stiffness[0], S, one, one, 2) - 1).max() > 0.01
    assert rest_by_exponential(mass, damping, stiffness, S, one, one, 2, T)[1, :, 0, 0] == pytest.approx(rest)


def test_what_grows_far_above_the_band_leaves_the_rest_as_it_was() -> None:
    """A section of a link with less than no mass, behind a stiff spring, beside a sound mass."""
    matrices, gone = _beside_sound_mass(-1e-4), _beside_sound_mass(1e-9)
    out = np.array([[1.0, 0.0]])
    assert state_eigen(*matrices)[0].real.max() > 1e4
    found, plain = (frf(*some, S, out, out.T, 2, T) for some in (matrices, gone))
    assert found == pytest.approx(plain, rel=1e-5)
    whole = frf(*matrices, S, out, out.T, 2)
    assert np.abs(found / whole - 1).max() > 0.01, "the record ends before the response does"
    by_exponential = frf_by_solve(*matrices, S, out, out.T, 2) - rest_by_exponential(
        *matrices, S, out, out.T, 2, T
    )
    assert by_exponential == pytest.approx(found, rel=1e-6)
    softer, (m, c, k) = np.array([[1.0, -1.0], [-1.0, 1.0]]), matrices
    model = end_by_matrices(matrices, S, out.T, T, np.zeros((1, 2, 2)), softer[None])
    assert model is not None
    none = np.zeros((0, 2, 2))
    before, after = (
        end_by_matrices((m, c, k + change * softer), S, out.T, T, none, none) for change in (-1e-3, 1e-3)
    )
    assert before is not None
    assert after is not None
    assert model.slopes[0, ..., 0] == pytest.approx((after.x - before.x) / 2e-3, rel=1e-4, abs=1e-12)


def _beside_sound_mass(mass: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """M, C, K of 2 kg on a spring, held by another spring to a mass that a stiff one holds."""
    stiffness = np.array([[1100.0, -200.0], [-200.0, 50200.0]])
    return np.diag([2.0, mass]), np.diag([3.0, 3.0]), stiffness


def test_gradient_with_a_coordinate_that_nothing_holds(tmp_path: Path) -> None:
    """A damper alone lets the base drift for ever: an eigenvalue of zero."""
    effects = [{"kind": "joint-compliance"}, {"kind": "base-compliance", "axes": ["tx"]}]
    arm_model, parameters, _ = system(arm(tmp_path), effects)
    values, out = initial(parameters), arm_model.jacobian("link6", np.zeros(3))[:3]
    values[-2] = 0.0
    free = np.array([1, 12, 13])
    h, gradient = frf_and_gradient(arm_model.matrices(values), arm_model.factors, S, out, out.T, 2, free, T)
    assert h == pytest.approx(
        frf(*arm_model.matrices(values), S, out, out.T, 2, T), rel=1e-7, abs=1e-9 * np.abs(h).max()
    )
    step = 1e-3 * values * (np.arange(14) == 13)
    expected = [frf(*arm_model.matrices(values + sign * step), S, out, out.T, 2, T) for sign in (1, -1)]
    slope = (expected[0] - expected[1]) / (2 * step.max())
    assert gradient[..., 2] == pytest.approx(slope, abs=1e-4 * np.abs(slope).max())


@pytest.mark.parametrize("power", [0, 1, 2])
def test_what_the_end_adds_is_the_difference_of_both_frfs(power: int, tmp_path: Path) -> None:
    """Also of a defective system, which takes the exponential; a record twice as long ends otherwise."""
    arm_model, parameters, _ = system(arm(tmp_path), ALL_EFFECTS)
    matrices = arm_model.matrices(initial(parameters))
    out = arm_model.jacobian("link6", np.zeros(3))
    whole = frf_by_solve(*matrices, S, out, out.T, power)
    found = end_added(matrices, S, out, out.T, power, T)
    expected = frf(*matrices, S, out, out.T, power, T) - whole
    assert np.abs(expected).max() > 1e-3 * np.abs(whole).max()
    assert np.abs(found - expected).max() < 1e-8 * np.abs(whole).max()
    longer = end_added(matrices, S, out, out.T, power, 2 * T)
    assert np.abs(longer - expected).max() > 0.01 * np.abs(expected).max()
    one, critical = np.eye(1), 2 * np.eye(1)
    s = 0.01 + 1j * np.linspace(0.1, 3.0, 5)
    defective = end_added((one, critical, one), s, one, one, power, 2.0)
    by_both = frf(one, critical, one, s, one, one, power, 2.0) - frf(one, critical, one, s, one, one, power)
    assert np.abs(defective).max() > 1e-3
    assert defective == pytest.approx(by_both, abs=1e-9)


def test_records_that_begin_before_the_impact_have_less_of_the_response(tmp_path: Path) -> None:
    joints = parse_effect({"kind": "joint-compliance"})
    early = parse_effect({"kind": "pre-trigger", "time": {"initial": 0.03}})
    robot = arm(tmp_path)
    arm_system, parameters = model(robot, [joints, early])
    target, values = predictor(arm_system, lines=40, band=(4.0, 43.0)), initial(parameters)
    plain = predictor(model(robot, [joints])[0], lines=40, band=(4.0, 43.0))
    shorter, whole = (replace(plain, record=length).predict(values[:-1]) for length in (0.97, 1.0))
    assert target.predict(values) == pytest.approx(shorter, rel=1e-12)
    assert np.abs(shorter - whole).max() > 1e-3 * np.abs(whole).max()
    moved = np.repeat(values[None], 3, axis=0)
    moved[:, -1] += 1e-5 * np.array([1, -1, 0])
    several = target.predict(moved)
    assert several[2] == pytest.approx(shorter, rel=1e-9)
    h, gradient = target.gradient(values, np.arange(len(values)))
    assert h == pytest.approx(shorter, rel=1e-8)
    expected = (several[0] - several[1]) / 2e-5
    assert gradient[..., -1] == pytest.approx(expected, rel=1e-5, abs=1e-6 * np.abs(expected).max())


def test_what_is_left_is_kept_down_to_rounding() -> None:
    """Of a model that outlasts its record; nothing of one that does not."""
    eigenvalues = np.array([-2.0 + 60j, -30.0 + 200j, -90.0 + 300j])
    left = left_at_end(eigenvalues, S, T)
    assert left[:2] == pytest.approx(np.exp(eigenvalues[:2] * T), rel=1e-12)
    assert left[2] == 0 != np.exp(eigenvalues[2] * T)
    assert not left_at_end(eigenvalues, S + 25.0, T).any()
