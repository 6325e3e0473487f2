"""What FRFs look like whatever their level and, of magnitudes, whatever delay turns them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from identify.core.arrays import Array, Complex
from identify.core.parameters import Scale
from identify.vibration.log_shape import LogShape, frf_targets
from identify.vibration.problem import Measurement, Problem, load_problem
from identify.vibration.study import read_study
from tests.setup.studies import config, written


@pytest.fixture(scope="module")
def problem(tmp_path_factory: pytest.TempPathFactory) -> Problem:
    return load_problem(read_study(written(tmp_path_factory.mktemp("arm"), config())))


def test_a_level_does_not_count_and_is_read_off(problem: Problem) -> None:
    values = problem.initial
    own, tenfold = LogShape(problem), LogShape(_times(problem, lambda f: np.full(len(f), 10.0)))
    assert tenfold.costs(values[None]) == pytest.approx(own.costs(values[None]))
    assert tenfold.level(values) - own.level(values) == pytest.approx(np.log(10))


def test_the_first_measurement_alone_is_a_study_of_it(problem: Problem) -> None:
    values = problem.initial[None]
    alone = LogShape(replace(problem, measurements=problem.measurements[:1]))
    assert LogShape(problem).of_first().costs(values) == pytest.approx(alone.costs(values))
    assert LogShape(problem).costs(values) != pytest.approx(alone.costs(values), rel=1e-3)


def test_all_measurements_are_seen_in_their_order(tmp_path: Path) -> None:
    """Also where the first is kept for validation."""
    measured = config()["measurements"]
    kept = config(measurements=[{**measured[0], "use": "validate"}, *measured[1:]])
    problem = load_problem(read_study(written(tmp_path, kept)))
    targets = frf_targets(problem)
    assert len(targets) == 2
    assert all(one is m.target for one, m in zip(targets, problem.measurements, strict=True))


def test_a_delay_turns_phases_and_no_magnitudes(problem: Problem) -> None:
    values, late = problem.initial[None], _times(problem, lambda f: np.exp(-2j * np.pi * f * 2e-3))
    own, delayed = LogShape(problem), LogShape(late)
    assert delayed.costs(values) != pytest.approx(own.costs(values), rel=0.01)
    assert delayed.of_magnitudes().costs(values) == pytest.approx(own.of_magnitudes().costs(values))


def test_slopes_are_those_of_differences(problem: Problem) -> None:
    scale, step = Scale(problem.parameters), 1e-6
    for shape in (LogShape(problem), LogShape(problem).of_magnitudes()):
        product = shape.product(problem.initial, scale.free)
        for place, number in enumerate(scale.free[:3]):
            moved = np.repeat(problem.initial[None], 2, axis=0)
            size = step * problem.initial[number]
            moved[:, number] += [-size, size]
            low, high = shape.costs(moved) ** 2 * shape.count
            assert product[place, -1] == pytest.approx((high - low) / (4 * size), rel=1e-3)


def _times(problem: Problem, factor: Callable[[Array], Array | Complex]) -> Problem:
    """The problem with measured FRFs times a factor of their frequencies, Hz."""

    def changed(m: Measurement) -> Measurement:
        data = m.target.data
        each = factor(data.frequency_hz)[:, None, None]
        noise = m.target.noise * np.mean(np.abs(each))
        return replace(m, target=replace(m.target, data=replace(data, frf=data.frf * each), noise=noise))

    return replace(problem, measurements=tuple(changed(m) for m in problem.measurements))
