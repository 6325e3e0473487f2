"""A contract battery over every registered cost, and what is special of each."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from pydantic import ValidationError

from identify.core.errors import InputError
from identify.measured.modal_tables import ModalTable
from identify.model.modes import complex_modes
from identify.vibration.costs.base import COSTS, parse_cost
from identify.vibration.costs.eigenfrequency import pair_all
from identify.vibration.costs.make_target import ModalTarget, Targets
from tests.arms import initial
from tests.targets import targets

VARIANTS = [
    {"kind": "frf-least-squares"},
    {"kind": "frf-least-squares", "residual": "log"},
    {"kind": "frf-area"},
    {"kind": "frf-area", "scale": "log"},
    {"kind": "frf-area", "compare": "complex"},
    {"kind": "frf-area", "scale": "log", "compare": "complex"},
    {"kind": "eigenfrequency"},
    {
        "kind": "eigenfrequency",
        "scale": "relative",
        "conditions": [{"mode": 1, "above_hz": 500.0}, {"mode": 5, "below_hz": 1.0}],
    },
    {
        "kind": "normalized-response",
        "excitation": {"3:+X": 0, "3:+Y": -90},
        "weights": {"modes_hz": [15.0, 30.0]},
    },
]


def test_every_registered_cost_is_in_this_battery() -> None:
    assert {variant["kind"] for variant in VARIANTS} == set(COSTS.names())


@pytest.mark.parametrize("variant", VARIANTS, ids=str)
class TestContract:
    def test_zero_at_the_truth_and_positive_elsewhere(
        self, variant: dict[str, object], tmp_path: Path
    ) -> None:
        data, parameters = targets(tmp_path)
        objective = parse_cost(
            {**variant, "conditions": []} if "conditions" in variant else variant
        ).objective(data)
        truth = initial(parameters)
        off = truth * np.exp(np.random.default_rng(0).normal(size=(6, len(truth))) * 0.2)
        costs = objective.costs(np.vstack([truth, off]))
        assert costs[0] < 1e-6 * costs[1:].min()
        assert np.all(costs[1:] > 0)

    def test_population_and_inputs(self, variant: dict[str, object], tmp_path: Path) -> None:
        data, parameters = targets(tmp_path, noise=0.02)
        objective = parse_cost(variant).objective(data)
        population = initial(parameters) * np.exp(
            np.random.default_rng(0).normal(size=(4, len(parameters))) * 0.2
        )
        before = population.copy()
        together = objective.costs(population)
        assert together == pytest.approx([objective.costs(one[None])[0] for one in population], rel=1e-7)
        assert np.array_equal(population, before)

    def test_derivatives_of_residuals(self, variant: dict[str, object], tmp_path: Path) -> None:
        data, parameters = targets(tmp_path, noise=0.02)
        objective = parse_cost(variant).objective(data)
        values, free = initial(parameters) * 1.1, np.array([0, 3, 8])
        _, slopes = objective.residuals(values, free)
        for column, number in enumerate(free):
            step = 1e-5 * values[number] * (np.arange(len(values)) == number)
            plus, minus = (objective.residuals(values + sign * step, free)[0] for sign in (1, -1))
            expected = (plus - minus) / (2 * step[number])
            assert np.abs(slopes[:, column] - expected).max() < 1e-5 * np.abs(expected).max()

    def test_a_hopeless_candidate_costs_infinity_not_an_exception(
        self, variant: dict[str, object], tmp_path: Path
    ) -> None:
        data, parameters = targets(tmp_path)
        hopeless = np.full(len(parameters), np.nan)
        with np.errstate(all="ignore"):
            costs = parse_cost(variant).objective(data).costs(np.vstack([hopeless, initial(parameters)]))
        assert costs[0] == np.inf
        assert np.isfinite(costs[1])

    def test_unknown_option_is_refused(self, variant: dict[str, object]) -> None:
        with pytest.raises(ValidationError, match="typo"):
            parse_cost({**variant, "typo": 1})


def test_gap_is_one_where_only_noise_is_left(tmp_path: Path) -> None:
    data, parameters = targets(tmp_path, noise=0.03)
    assert parse_cost("frf-least-squares").objective(data).costs(initial(parameters)[None])[
        0
    ] == pytest.approx(1.0, abs=0.03)


def test_eigenfrequency_is_eq_2_of_umons(tmp_path: Path) -> None:
    data, parameters = targets(tmp_path)
    modal = data.modal[0]
    shifts = np.array([0.1, -0.2, 0.3]), np.array([0.01, 0.0, -0.02])
    table = ModalTable(modal.data.frequency_hz[:3] + shifts[0], modal.data.damping_ratio[:3] + shifts[1])
    cost = parse_cost({"kind": "eigenfrequency", "conditions": [{"mode": 4, "above_hz": 1000.0}]})
    found = cost.objective(Targets(modal=(ModalTarget("m", table, modal.system),))).costs(
        initial(parameters)[None]
    )[0]
    missing = 1000.0 - modal.data.frequency_hz[3]
    assert found == pytest.approx(0.6 + 3.0 + missing)


def test_modes_are_paired_by_shape_where_frequency_misleads(tmp_path: Path) -> None:
    data, parameters = targets(tmp_path)
    modal = data.modal[0]
    shapes = modal.data.shapes
    assert shapes is not None
    crossed = replace(modal.data, shapes=shapes[[1, 0, 2, 3]])
    modes = complex_modes(*modal.system.matrices(initial(parameters)))
    assert pair_all(replace(modal, data=crossed), modes).tolist() == [1, 0, 2, 3]
    assert pair_all(replace(modal, data=replace(crossed, shapes=None)), modes).tolist() == [0, 1, 2, 3]


def test_modes_that_the_channels_cannot_tell_apart_are_paired_by_frequency(tmp_path: Path) -> None:
    """One channel: every MAC is 1, and the first and third modes are near themselves only."""
    data, parameters = targets(tmp_path)
    modal = data.modal[0]
    assert modal.data.shapes is not None and modal.out is not None
    modes = complex_modes(*modal.system.matrices(initial(parameters)))
    table = ModalTable(
        modal.data.frequency_hz[[0, 2, 3]] * [1.02, 0.99, 1.01],
        modal.data.damping_ratio[[0, 2, 3]],
        modal.data.channels[:1],
        modal.data.shapes[[0, 2, 3], :1],
    )
    assert pair_all(replace(modal, data=table, out=modal.out[:1]), modes).tolist() == [0, 2, 3]


@pytest.mark.parametrize(("factor", "decibels"), [(10.0, 20.0), (2.0, 6.0206), (0.1, 20.0)])
def test_decibels_of_an_amplitude(factor: float, decibels: float, tmp_path: Path) -> None:
    """Measured FRFs ten times as large are 20 dB away, line by line and pair by pair."""
    data, parameters = targets(tmp_path)
    frf = data.frf[0]
    larger = Targets(frf=(replace(frf, data=replace(frf.data, frf=factor * frf.data.frf)),))
    found = (
        parse_cost({"kind": "frf-area", "scale": "log"}).objective(larger).costs(initial(parameters)[None])[0]
    )
    assert found == pytest.approx(decibels * frf.data.frf.size, rel=1e-4)


@pytest.mark.parametrize(
    ("noise", "off", "expected"),
    [(1e-6, 0.1, 1.0), (0.1, 0.1, 1 / np.sqrt(2)), (2.0, 2.0, 1.0), (0.3, 0.0, 0.0), (1e-6, 0.2, 2.0)],
)
def test_a_tenth_counts_as_one_where_noise_is_small_and_noise_as_one_where_it_is_large(
    noise: float, off: float, expected: float, tmp_path: Path
) -> None:
    """The logarithm of every FRF is off by the same; error of the model and noise add as variances."""
    data, parameters = targets(tmp_path)
    frf = data.frf[0]
    scaled = replace(frf.data, frf=np.exp(off) * frf.data.frf)
    target = replace(frf, data=scaled, noise=noise * np.abs(scaled.frf))
    cost = parse_cost({"kind": "frf-least-squares", "residual": "log"}).objective(Targets(frf=(target,)))
    found = float(cost.costs(initial(parameters)[None])[0])
    # The root of the mean over real and imaginary parts, of which only the real one is off.
    assert found == pytest.approx(expected / np.sqrt(2), rel=2e-3, abs=1e-6)


def test_the_weight_of_a_mode_is_a_bell_of_the_stated_width() -> None:
    """Its standard deviation by moments, its height at the mode and far away."""
    from identify.vibration.costs.normalized_response import ResonanceWeights

    f = np.linspace(0.0, 60.0, 6001)
    bell = ResonanceWeights(modes_hz=[30.0], width_hz=2.5, height=4.0).at(f) - 1
    assert bell.max() == pytest.approx(3.0)
    assert bell[[0, -1]] == pytest.approx([0, 0], abs=1e-9)
    assert np.sum(bell * f) / bell.sum() == pytest.approx(30.0)
    assert np.sqrt(np.sum(bell * (f - 30) ** 2) / bell.sum()) == pytest.approx(2.5, rel=1e-4)


def test_normalized_response_combines_force_columns(tmp_path: Path) -> None:
    data, parameters = targets(tmp_path)
    values = initial(parameters) * 1.2
    found = (
        parse_cost({"kind": "normalized-response", "excitation": {"3:+X": 0, "3:+Y": -90}})
        .objective(data)
        .costs(values[None])[0]
    )
    target = data.frf[0]
    difference = target.predict(values) - target.data.frf
    assert found == pytest.approx(np.abs(difference[..., 0] - 1j * difference[..., 1]).sum())


def test_costs_refuse_data_of_another_kind(tmp_path: Path) -> None:
    data, _ = targets(tmp_path)
    with pytest.raises(InputError, match="compares FRFs"):
        parse_cost("frf-area").objective(Targets(modal=data.modal))
    with pytest.raises(InputError, match="compares modes"):
        parse_cost("eigenfrequency").objective(Targets(frf=data.frf))
    with pytest.raises(InputError, match="noise is not known"):
        parse_cost("frf-least-squares").objective(Targets(frf=(replace(data.frf[0], noise=None),)))
    with pytest.raises(InputError, match="force channel 9:"):
        parse_cost({"kind": "normalized-response", "excitation": {"9:+X": 0}}).objective(data)
