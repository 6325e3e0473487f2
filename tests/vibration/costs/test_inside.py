"""Products of derivatives by way of few coordinates against those made for every sensor."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from identify.core.arrays import Array, Index
from identify.discovery.decimated import decimated
from identify.vibration.costs import information as information_module
from identify.vibration.costs.frf_least_squares import FrfLeastSquares, PosteriorObjective
from identify.vibration.costs.information import information_by_force
from identify.vibration.costs.inside import inside_of
from identify.vibration.problem import Problem, load_problem
from identify.vibration.study import read_study

CONFIG = Path(__file__).parents[3] / "configs" / "arm_hammer_test.yaml"
_STATED = """uncertainty:
  like: typical
  channels: {force_gain: 0.02}
  kinematics: {position_m: 0.001}
  sets: {delay_s: 1.0e-4}
"""
_WINDOW = """effects:
  - {kind: window-decay, error: {initial: 0.2}}
  - {kind: pre-trigger, time: {initial: 0.01}}"""


@pytest.fixture(scope="module")
def problem(tmp_path_factory: pytest.TempPathFactory) -> Problem:
    """All that can be uncertain, in records that end, of which neither length nor window are known."""
    text = CONFIG.read_text().replace("../data", str(CONFIG.parents[1] / "data"))
    path = tmp_path_factory.mktemp("study") / "study.yaml"
    path.write_text(f"{text.replace('effects:', _WINDOW, 1)}\n{_STATED}")
    return decimated(load_problem(read_study(path)))


def _values(problem: Problem) -> Array:
    rng = np.random.default_rng(0)
    errors = np.array([p.nuisance for p in problem.parameters])
    moved = problem.initial * np.exp(0.1 * rng.normal(size=len(errors)))
    return np.where(errors, 0.5 * rng.normal(size=len(errors)), moved)


def _compared(found: Array, expected: Array) -> None:
    scale = np.sqrt(np.abs(np.diag(expected)))
    scale[scale == 0] = 1.0
    assert np.abs((found - expected) / np.outer(scale, scale)).max() < 1e-12


def _chosen(problem: Problem) -> list[Index]:
    """Unknowns: all, those of the model alone, errors alone, every third."""
    every = np.arange(len(problem.parameters))
    errors = np.array([p.nuisance for p in problem.parameters])
    return [every, every[~errors], every[errors], every[::3]]


@pytest.mark.parametrize("residual", ["complex", "log"])
def test_products_and_bends_are_those_of_every_sensor(
    residual: str, problem: Problem, monkeypatch: pytest.MonkeyPatch
) -> None:
    values, asked = _values(problem), list[bool]()
    sides = np.array([values + 1e-3 * np.abs(values), values - 1e-3 * np.abs(values)])
    cost = FrfLeastSquares.model_validate({"residual": residual})
    objective = PosteriorObjective(cost, problem.targets(), 2.0)
    for free in _chosen(problem):
        inner = objective.product(values, free), objective.bend(values, free, sides)
        asked += [inside_of(target, values, free) is not None for target in problem.targets().frf]
        with monkeypatch.context() as patched:
            patched.setattr(information_module, "inside_of", lambda *given: None)
            outer = objective.product(values, free), objective.bend(values, free, sides)
        _compared(inner[0], outer[0])
        assert inner[1] == pytest.approx(outer[1], rel=1e-7, abs=1e-8 * np.abs(outer[1]).max())
    assert all(asked)


def test_each_force_says_what_it_says_to_every_sensor(
    problem: Problem, monkeypatch: pytest.MonkeyPatch
) -> None:
    values, [free, *_] = _values(problem), _chosen(problem)
    inner = information_by_force(problem.targets().frf, values, free)
    monkeypatch.setattr(information_module, "inside_of", lambda *given: None)
    for one, other in zip(inner, information_by_force(problem.targets().frf, values, free), strict=True):
        _compared(one.product, other.product)


def test_more_coordinates_are_left_to_the_sensors(problem: Problem) -> None:
    values, [free, *_] = _values(problem), _chosen(problem)
    target = problem.targets().frf[0]
    few = len(target.data.outputs) // 2
    assert target.out.shape[1] <= few
    outputs = np.arange(2 * target.out.shape[1] - 1)
    less = target.data.chosen([str(target.data.outputs[n]) for n in outputs], None, "test")
    assert inside_of(replace(target, data=less, out=target.out[outputs]), values, free) is None


def test_late_responses_change_with_parameters_as_differences_say(problem: Problem) -> None:
    """Also by the decay of the window, on which the delay itself depends."""
    values = _values(problem)
    for target in problem.targets().frf:
        free = np.arange(len(target.system.parameters))
        _, slopes = target.parameter_gradient(values, free)
        for number in free[target.decay != 0]:
            step = 1e-5 * abs(values[number]) * np.eye(len(values))[number]
            sides = target.predict(values + step), target.predict(values - step)
            expected = (sides[0] - sides[1]) / (2 * step[number])
            error = np.abs(slopes[..., number] - expected).max()
            assert error < 1e-6 * np.abs(expected).max()
